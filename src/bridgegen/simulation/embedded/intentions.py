"""Where the ego means to go, instant by instant: its ways, where it is on them, what it plans.

A rollout keeps what happened, not what was meant. The reference driver is therefore rolled out
again up to each instant and asked; a rollout depends on nothing else, so that is what it meant.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from bridgegen.base import elementary
from bridgegen.base.arrays import Float, Int
from bridgegen.drivers.drivers import REFERENCE, STORYBOARD
from bridgegen.simulation.embedded.places.network import Network
from bridgegen.simulation.embedded.program import Program
from bridgegen.simulation.rollout import Rollout

EVERY = 0.2
"""Time between two instants that are looked at [s]; the reference driver plans twice as often."""

NEAR = 6.0
"""Distance from its route within which a driver that keeps its plans to itself follows it [m]."""


@dataclass(frozen=True)
class Intentions:
    """What the egos of N rows mean to do at P instants.

    Attributes:
        steps: ``(P,)`` int64, the instants; those at or after a row's end are meaningless.
        way: ``(N, P)`` int64, number of the way; -1 where it follows none.
        station: ``(N, P)`` float64, of its reference point along the way [m].
        acceleration: ``(N, P)`` float64 [m/s²], as planned; NaN where the driver does not report
        it.
        shift: ``(N, P, 4)`` float64, its course beside the way, see ``ego._shift_kernels``.
        plans: of each row the trajectories that a user's driver planned: the instant, and its
            states ``(K, 6)``, see ``ego._trajectory_kernels``; empty where it planned none.
    """

    steps: Int
    way: Int
    station: Float
    acceleration: Float
    shift: Float
    plans: tuple[Mapping[int, Float], ...] = ()

    def take(self, at: Int) -> "Intentions":
        """Return some of the rows."""
        plans = tuple(self.plans[row] for row in at.tolist()) if self.plans else ()
        return Intentions(
            self.steps, self.way[at], self.station[at], self.acceleration[at], self.shift[at], plans
        )


def intentions(
    program: Program,
    roads: Network,
    rows: Int,
    values: Mapping[str, npt.ArrayLike],
    rollout: Rollout,
) -> Intentions:
    """Return what the egos of a rollout meant to do.

    The reference driver is asked; of any other the way is known, and nothing else here.

    Args:
        program: the compiled storyboard.
        roads: as of the rollout, and so are those that follow.
        rows: row i's road network.
        values: by parameter.
        rollout: of these rows.
    """
    n, last = rollout.shape[0], int(rollout.n_steps.max(initial=1))
    steps = np.arange(0, last, max(1, round(EVERY / rollout.time_step)))
    nothing = np.full((n, len(steps)), np.nan)
    found = Intentions(
        steps, np.full(nothing.shape, -1), nothing.copy(), nothing, np.zeros((*nothing.shape, 4))
    )
    if program.driver.name == REFERENCE.name:
        _ask(program, roads, rows, values, found)
    elif program.driver != STORYBOARD:
        _follow(roads, rows, rollout, found)
    return found


def _ask(
    program: Program,
    roads: Network,
    rows: Int,
    values: Mapping[str, npt.ArrayLike],
    out: Intentions,
) -> None:
    from bridgegen.drivers._lane_change_kernels import AFTER, BEFORE, BEGINS, LENGTH
    from bridgegen.drivers._reference_kernels import PLANNED
    from bridgegen.simulation.embedded.batch import Batch  # numba is slow to import

    for i, k in enumerate(out.steps.tolist()):
        # From the start each time. To go in lock-step would be fewer instants, but its kernels
        # would have to be compiled for this alone.
        batch = Batch(replace(program, n_steps=k + 1), roads, rows, values)
        batch.run()
        state = batch.state
        out.way[:, i], out.station[:, i] = state.on[:, 0], state.station[:, 0]
        out.acceleration[:, i] = state.mind[:, PLANNED]
        out.shift[:, i] = state.mind[:, [BEFORE, AFTER, BEGINS, LENGTH]]


def _follow(roads: Network, rows: Int, rollout: Rollout, out: Intentions) -> None:
    """Find where on their first ways the egos are, each looking on from where it was."""
    tables = roads.tables
    for row, p in enumerate(rows.tolist()):
        count, step = int(tables.counts[p, 0]), float(tables.steps[p, 0])
        way = tables.paths[p, 0, :count, :2]
        at = 0
        for i, k in enumerate(out.steps.tolist()):
            reach = int((EVERY * rollout.v[row, 0, max(0, k - 1)] + NEAR) / step) + 2
            part = way[at : at + reach] if i else way
            gap = elementary.hypot(
                part[:, 0] - rollout.x[row, 0, k], part[:, 1] - rollout.y[row, 0, k]
            )
            nearest = int(gap.argmin())
            if gap[nearest] < NEAR:
                at += nearest
                out.way[row, i], out.station[row, i] = 0, at * step
