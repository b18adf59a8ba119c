"""What becomes of a cell: the outcome of each driver in it, and the class that follows."""

from enum import IntEnum

import numpy as np
import numpy.typing as npt

from bridgegen.assess.conflict.plausibility import Implausible, plausibility
from bridgegen.assess.metrics.metric import distance, steps
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.engine.judged import judge
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.runner import Runner
from bridgegen.simulation.rollout import Rollout

TOUCH = 0.01
"""Overlap of two boxes [m] up to which they only touch: a model that stops at the other's bumper,
as the fuzzy safety model may, overlaps it by some millimetres, by the rounding of a time step."""

Codes = npt.NDArray[np.int8]


class Outcome(IntEnum):
    """The outcome of one driver in one cell."""

    NOT_NEEDED = -1
    """Not simulated: the class of the cell does not depend on it."""
    AVOIDED = 0
    """The ego's box overlaps no other participant's by more than `TOUCH`."""
    COLLIDED = 1
    """The ego's box overlaps another participant's by more than `TOUCH`."""
    FAILED = 2
    """No result: the driver or the simulation failed."""
    NOT_APPLICABLE = 3
    """The values break a constraint of the scenario, or the traffic is implausible."""


class CellClass(IntEnum):
    """The class of a cell, of one driver."""

    AVOIDED = 0
    PREVENTABLE = 1
    UNPREVENTABLE = 2
    NOT_APPLICABLE = 3
    NO_RESULT = 4

    @property
    def label(self) -> str:
        """The class in words."""
        return _LABELS[self]


_LABELS = {
    CellClass.AVOIDED: "avoided",
    CellClass.PREVENTABLE: "not avoided though preventable",
    CellClass.UNPREVENTABLE: "not preventable",
    CellClass.NOT_APPLICABLE: "not applicable",
    CellClass.NO_RESULT: "no result",
}


def outcomes(pipeline: Pipeline, X: Float) -> Codes:
    """Return the outcome of a pipeline's driver in N rows, in this thread.

    Args:
        pipeline: of the driver.
        X: ``(N, len(space.names))``, feasible rows.

    Returns:
        ``(N,)``, an `Outcome` each.
    """
    found = np.empty(len(X), np.int8)
    for at, runner in pipeline.runner.by_variant(X):
        judged = judge(runner, X[at], until_collision=True)
        if judged is None:
            found[at] = _of_motion(runner, X[at])
            continue
        code = np.where(judged.code != Implausible.NONE, Outcome.NOT_APPLICABLE, Outcome.AVOIDED)
        found[at] = np.where(judged.status != 0, Outcome.FAILED, code)
        # How deep boxes overlap is seen in the motion.
        if (touching := at[judged.touches & (found[at] == Outcome.AVOIDED)]).size:
            found[touching] = _of_motion(runner, X[touching])
    return found


def _of_motion(runner: Runner, X: Float) -> Codes:
    """Return the outcome of N rows of one storyboard."""
    # A cell asks only whether there is a collision, so a row ends with it.
    rollout = runner.run(X, until_collision=True)
    code = np.where(collides(rollout), Outcome.COLLIDED, Outcome.AVOIDED)
    implausible = plausibility(rollout).code != Implausible.NONE
    code = np.where(implausible, Outcome.NOT_APPLICABLE, code)
    found: Codes = np.where(rollout.status != 0, Outcome.FAILED, code).astype(np.int8)
    return found


def collides(rollout: Rollout) -> Bool:
    """Return which rows have the ego's box overlap another's by more than `TOUCH`.

    Args:
        rollout: of N rows.

    Returns:
        ``(N,)`` bool.
    """
    n, _, t = rollout.shape
    within = np.arange(t) < steps(rollout)[:, np.newaxis]
    # Contacts first: how deep boxes overlap is worked out for these few instants alone.
    row, e, k = np.nonzero((distance(rollout) <= 0.0) & within[:, np.newaxis])
    found = np.zeros(n, np.bool_)
    found[row[_overlap(rollout, row, e, k) > TOUCH]] = True
    return found


def _overlap(rollout: Rollout, row: Int, e: Int, k: Int) -> Float:
    """Return how deep the ego's box and another's overlap, along the axis of least depth [m].

    Args:
        rollout: of N rows.
        row: ``(M,)`` of each case.
        e: ``(M,)`` the other entity.
        k: ``(M,)`` the instant.
    """
    zero = np.zeros_like(e)
    centres, axes, halves = [], [], []
    for body in (zero, e):
        h = rollout.h[row, body, k]
        along = np.stack((np.cos(h), np.sin(h)), axis=-1)
        base = np.stack((rollout.x[row, body, k], rollout.y[row, body, k]), axis=-1)
        centres.append(base + rollout.box[body, 2, np.newaxis] * along)
        axes += [along, np.stack((-along[:, 1], along[:, 0]), axis=-1)]
        halves.append(0.5 * rollout.box[body, :2])
    apart = centres[1] - centres[0]
    depth = np.full(len(row), np.inf)
    for axis in axes:  # the separating axes of two rectangles
        reach = sum(
            half[:, i] * np.abs((axes[2 * b + i] * axis).sum(axis=-1))
            for b, half in enumerate(halves)
            for i in range(2)
        )
        depth = np.minimum(depth, reach - np.abs((apart * axis).sum(axis=-1)))
    return depth


def classes(driver: Codes, models: Codes) -> Codes:
    """Return the class of N cells for one driver.

    A collision is preventable if one of the models avoids it, and not if all that have a result
    collide.

    Args:
        driver: ``(N,)``, its `Outcome`.
        models: ``(M, N)``, theirs.

    Returns:
        ``(N,)``, a `CellClass` each.
    """
    found = np.full(driver.shape, CellClass.NO_RESULT, np.int8)
    found[driver == Outcome.AVOIDED] = CellClass.AVOIDED
    found[driver == Outcome.NOT_APPLICABLE] = CellClass.NOT_APPLICABLE
    collided = driver == Outcome.COLLIDED
    # One model that avoids it suffices, whatever the others did. That none avoids it needs an
    # answer of each: a model without a result leaves the question open.
    prevented = (models == Outcome.AVOIDED).any(axis=0)
    open_ = np.isin(models, (Outcome.FAILED, Outcome.NOT_NEEDED)).any(axis=0)
    judged = (models == Outcome.COLLIDED).any(axis=0) & ~open_
    found[collided & prevented] = CellClass.PREVENTABLE
    found[collided & ~prevented & judged] = CellClass.UNPREVENTABLE
    return found
