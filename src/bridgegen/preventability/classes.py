"""What becomes of a cell: the outcome of each driver in it, and the class that follows."""

from enum import IntEnum

import numpy as np
import numpy.typing as npt

from bridgegen import metrics
from bridgegen.arrays import Float
from bridgegen.conflict.plausibility import Implausible, plausibility
from bridgegen.pipeline import Pipeline

Codes = npt.NDArray[np.int8]


class Outcome(IntEnum):
    """The outcome of one driver in one cell."""

    NOT_NEEDED = -1
    """Not simulated: the class of the cell does not depend on it."""
    AVOIDED = 0
    """No contact of the ego with another participant."""
    COLLIDED = 1
    """A contact."""
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
    for at, one in pipeline.by_variant(X):
        rollout = one.rollout(X[at])
        collided = metrics.evaluate(rollout, ["n_collision"])[:, 0] > 0.0  # False for NaN
        code = np.where(collided, Outcome.COLLIDED, Outcome.AVOIDED)
        implausible = plausibility(rollout).code != Implausible.NONE
        code = np.where(implausible, Outcome.NOT_APPLICABLE, code)
        found[at] = np.where(rollout.status != 0, Outcome.FAILED, code)
    return found


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
    prevented = (models == Outcome.AVOIDED).any(axis=0)
    open_ = np.isin(models, (Outcome.FAILED, Outcome.NOT_NEEDED)).any(axis=0)
    judged = (models == Outcome.COLLIDED).any(axis=0) & ~open_
    found[collided & prevented] = CellClass.PREVENTABLE
    found[collided & ~prevented & judged] = CellClass.UNPREVENTABLE
    return found
