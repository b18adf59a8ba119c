"""Where an agent decides for the participant while the scenarios run."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.errors import InputError
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.scenario.ontology.builder import rounded
from bridgegen.simulation.adversary.source import AdversarySource, Course
from bridgegen.simulation.embedded.places.network import Network
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator

if TYPE_CHECKING:
    from bridgegen.simulation.embedded.batch import Batch

OBSERVED = (
    "time",
    "speed",
    "place in the lane",
    "top speed",
    "ego ahead",
    "ego to the left",
    "ego's heading, cosine",
    "ego's heading, sine",
    "ego's speed",
    "ego's acceleration",
    "distance from the ego",
    "way to the conflict",
    "ego's way to it",
    "time to the conflict",
    "ego's time to it",
)
"""Observations of an adversary at each decision, each scaled to about -1 .. 1 and cut at -3 and 3.

Ways lead to where its route and the ego's meet, times are at present speeds; 3 where they never
do."""

FAR, LONG, FAST, HARD = 30.0, 5.0, 10.0, 5.0  # m, s, m/s, m/s²: what counts as 1

Act = Callable[[Float, Bool], Float]
"""Function that decides: ``(N, len(OBSERVED))`` observations and ``(N,)`` whether a row still runs
→ ``(N, 2)`` decisions in [0, 1]: the speed that it makes for, up to its highest; its place, from
right to left."""


# An agent plays a scenario once, to fill its row; the row is then evaluated, stored, resumed and
# exported like every other.
class Arena:
    """Where an agent drives the participant in closed loop, many scenarios at a time.

    Args:
        source: of the scenarios.
        simulator: holds their storyboard.
        space: the search space; names the columns of U and X.

    Attributes:
        n_decisions: of each scenario.
        n_observed: numbers that the agent sees at each.
        decisions: ``(n_decisions, 2)`` int64, the columns of U that are decided: pace and place.

    Raises:
        InputError: the ego's driver cannot be asked instant by instant.
    """

    def __init__(
        self, source: AdversarySource, simulator: EmbeddedSimulator, space: SearchSpace
    ) -> None:
        if simulator.program.driver.is_own:
            raise InputError(
                "an adversary in closed loop meets the drivers of 'bridgegen list drivers', got "
                f"{simulator.program.driver.name}; search its decisions with another algorithm"
            )
        who = source.adversary
        names = np.array([who.paces, who.offsets]).T
        if missing := {*who.controls} - {*space.variables}:
            raise InputError(
                f"an adversary in closed loop needs all of its decisions, got no {min(missing)}: "
                "it is held at a value, or its axis (extension) is not searched"
            )
        self._source, self._simulator, self._space = source, simulator, space
        self._entity = simulator.program.names.index(who.participant)
        self.n_decisions, self.n_observed = len(names), len(OBSERVED)
        self.decisions: Int = np.vectorize(space.variables.index, otypes=[np.int64])(names)

    def warm_up(self) -> None:
        """Play once, so that the kernels are compiled before time counts."""

        def wait(observation: Float, running: Bool) -> Float:
            return np.zeros((len(observation), self.decisions.shape[1]))

        self.play(np.full((1, self._space.n_var), 0.5), wait)

    def play(self, U: Float, act: Act) -> Float:
        """Let an agent decide, and return the rows that came of it.

        Args:
            U: ``(N, n_var)``; the columns of decisions do not count.
            act: decides.

        Returns:
            ``(N, n_var)``, U with what was decided; after a scenario's end nothing is, and the
            columns are 0.5.
        """
        space, who, n = self._space, self._source.adversary, len(U)
        U = U.copy()
        U[:, self.decisions.ravel()] = 0.5
        X = space.decode(U)
        rows = [space.values(x) for x in X]
        courses = [self._source.begin(row) for row in rows]
        models = [self._source.roads(row) for row in rows]
        told = [{who.participant: course.whole()} for course in courses]
        network = self._simulator.roads(models, told)
        columns = {name: X[:, i] for i, name in enumerate(space.names)}
        batch = self._simulator.batch(network, np.arange(n), columns)
        batch.start()
        pairs = zip(who.paces, who.offsets, strict=True)
        at = [[space.index(name) for name in pair] for pair in pairs]
        for k in range(self._simulator.program.n_steps):
            if not batch.running.any():
                break
            steps = courses[0].steps
            if k % steps == 0 and k // steps < self.n_decisions:
                number = k // steps
                running = batch.running
                decided = act(self._observe(k, batch, network, courses), running)
                U[np.ix_(running, self.decisions[number])] = decided[running]
                values = space.decode(U)[:, at[number]]
                for course, value in zip(courses, values.tolist(), strict=True):
                    course.decide(number, *value)
                part = np.array([item.points[k : k + steps + 1] for item in courses])
                network.amend(who.participant, k, rounded(part.reshape(-1, 4)).reshape(part.shape))
            batch.before_driver(k)
            batch.after_driver(k, *batch.demand(k))
        return U

    def _observe(
        self, k: int, batch: "Batch", network: Network, courses: Sequence[Course]
    ) -> Float:
        """Return what the adversary sees at instant k, ``(N, len(OBSERVED))``; see `OBSERVED`."""
        record, e = batch.record, self._entity
        x, y, h, v = (array[:, e, k] for array in (record.x, record.y, record.h, record.v))
        dx, dy = record.x[:, 0, k] - x, record.y[:, 0, k] - y
        turned, ego_v = record.h[:, 0, k] - h, record.v[:, 0, k]
        ego_a = record.a[:, 0, k - 1] if k else np.zeros(len(x))
        zone = network.zones(self._source.adversary.participant)
        way = zone[:, 2] - np.array([course.travelled for course in courses])
        ego_way = zone[:, 0] - batch.state.station[:, 0]
        top, room = (
            np.array([getattr(course, name) for course in courses]) for name in ("top", "room")
        )
        aside = np.array([course.state[1] for course in courses])
        with np.errstate(invalid="ignore", divide="ignore"):
            seen = [
                np.full(len(x), k / self._simulator.program.n_steps),
                v / FAST,
                aside / np.maximum(room, 1e-9),
                top / FAST,
                (dx * elementary.cos(h) + dy * elementary.sin(h)) / FAR,
                (dy * elementary.cos(h) - dx * elementary.sin(h)) / FAR,
                elementary.cos(turned),
                elementary.sin(turned),
                ego_v / FAST,
                ego_a / HARD,
                elementary.hypot(dx, dy) / FAR,
                way / FAR,
                ego_way / FAR,
                way / np.maximum(v, 0.1) / LONG,
                ego_way / np.maximum(ego_v, 0.1) / LONG,
            ]
        found: Float = np.clip(np.nan_to_num(np.column_stack(seen), nan=3.0), -3.0, 3.0)
        return found
