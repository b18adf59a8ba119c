"""Rows that are run again to be looked at: the motion, the ego's plans, the weather."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.engine.runner import Runner
from bridgegen.simulation.embedded.intentions import Intentions
from bridgegen.simulation.rollout import Rollout


@dataclass(frozen=True)
class Replay:
    """A rollout of N rows with the egos' plans and the weather.

    Attributes:
        rollout: the motion.
        intentions: the egos' plans, if they were requested.
        ways: by row and number the ways that the plans name, ``(n, 2)`` float64 [m] each.
        weathers: by row the weather from the start on, and from each change of it: the instant, and
            ``(WEATHER,)`` as the sensors perceive it (``ego._weather_columns``).
    """

    rollout: Rollout
    intentions: Intentions | None
    ways: Sequence[Mapping[int, Float]]
    weathers: Sequence[Sequence[tuple[int, Float]]]

    def take(self, at: Int) -> "Replay":
        """Return some of the rows."""
        if np.array_equal(at, np.arange(self.rollout.shape[0])):
            return self
        meant, rows = self.intentions, at.tolist()
        return Replay(
            self.rollout.take(at),
            None if meant is None else meant.take(at),
            [self.ways[row] for row in rows] if self.ways else [],
            [self.weathers[row] for row in rows],
        )


@dataclass(frozen=True)
class Replays:
    """Replays of N rows, one for each storyboard that they have.

    Attributes:
        parts: the numbers of its rows, ascending, and each replay.
    """

    parts: tuple[tuple[Int, Replay], ...]

    def take(self, at: Int) -> "Replays":
        """Return some of the rows, in the order of their numbers ``at``."""
        found = []
        for rows, part in self.parts:
            mine = np.flatnonzero(np.isin(at, rows))
            if mine.size:
                found.append((mine, part.take(np.searchsorted(rows, at[mine]))))
        return Replays(tuple(found))


def replay_of(runner: Runner, X: Float, rollout: Rollout, *, plans: bool) -> Replay:
    """Return the replay of N rows of one storyboard.

    Args:
        runner: of that storyboard.
        X: ``(N, len(space.names))``.
        rollout: of these rows.
        plans: whether to compute the egos' planned paths, which takes many times as long as the
            rollout; only where the embedded simulator made it.
    """
    embedded, columns = runner.embedded, runner.columns(X)
    intentions, ways = None, []
    if plans and runner.simulator is embedded:
        roads, rows = runner.roads_of(X)
        # A rollout keeps no plans: the driver's state is overwritten at every instant. It is driven
        # once more, which gives the plans that it had, for a rollout depends on nothing else.
        intentions = embedded.intentions(roads, rows, columns, rollout)
        ways = [
            {way: roads.way(p, way) for way in np.unique(named[named >= 0]).tolist()}
            for p, named in zip(rows.tolist(), intentions.way, strict=True)
        ]
    weathers = [embedded.weathers(columns, rollout, i) for i in range(len(X))]
    return Replay(rollout, intentions, ways, weathers)
