"""What becomes of rows: how close each comes to harm, in numbers that an estimator sums up."""

from dataclasses import dataclass
from enum import IntEnum
from typing import Self

import numpy as np
import numpy.typing as npt

from bridgegen.assess.conflict.analysis import encounters
from bridgegen.assess.conflict.findings import Findings
from bridgegen.assess.conflict.harm import NEAR_MISS, Count, closeness_of_pairs, decisive
from bridgegen.assess.conflict.plausibility import Implausible, plausibility
from bridgegen.base.arrays import Float
from bridgegen.engine.pipeline import Pipeline

ALMOST = 0.999  # of the least harm that counts: conflicts that do not count lead to those that do


class Column(IntEnum):
    """The columns of an outcome; the first is what `estimators` call the score."""

    SCORE = 0
    """`conflict.harm.closeness_of_pairs` of the worst pair, from a near miss on; below, how near
    the row comes to any conflict, whether it counts or not. 0 of a row without a result.
    """
    OWN = 1
    """Likewise, where only conflicts count that the ego is responsible for or could prevent.
    """
    SEVERITY = 2
    """Probability of a MAIS3+ injury in the ego's collision."""
    RESULT = 3
    """1; 0 where the simulation failed; −1 where the traffic is implausible."""
    MODE = 4
    """Number of the failure mode among `Outcomes.modes`; −1 of a harmless row."""


@dataclass(frozen=True)
class Outcomes:
    """The outcomes of N rows.

    Attributes:
        values: ``(N, len(Column))``.
        modes: the words of each failure mode: type of conflict, rule, participant.
    """

    values: Float
    modes: tuple[str, ...]

    @classmethod
    def join(cls, parts: list[Self]) -> "Outcomes":
        """Return the outcomes of several parts, at least one, in their order."""
        modes: dict[str, int] = {}
        values = []
        for one in parts:
            numbers = np.array([modes.setdefault(mode, len(modes)) for mode in one.modes], float)
            found = one.values.copy()
            has = found[:, Column.MODE] >= 0.0
            found[has, Column.MODE] = numbers[found[has, Column.MODE].astype(np.int64)]
            values.append(found)
        return cls(np.concatenate(values), tuple(modes))

    @classmethod
    def lost(cls, n: int) -> "Outcomes":
        """Return those of N rows without a result."""
        values = np.zeros((n, len(Column)))
        values[:, Column.MODE] = -1.0
        return cls(values, ())


def outcomes(pipeline: Pipeline, X: Float, count: Count) -> Outcomes:
    """Simulate N rows, in this thread.

    Args:
        pipeline: of the driver.
        X: ``(N, len(space.names))`` feasible rows.
        count: whose conflicts count.
    """
    values = np.zeros((len(X), len(Column)))
    words = np.full(len(X), "", dtype=object)
    for at, one in pipeline.by_variant(X):
        values[at], words[at] = _outcomes(one, X[at], count)
    harmful = values[:, Column.SCORE] >= NEAR_MISS
    modes = dict.fromkeys(words[harmful])
    numbers = {mode: number for number, mode in enumerate(modes)}
    values[:, Column.MODE] = -1.0
    values[harmful, Column.MODE] = [numbers[mode] for mode in words[harmful]]
    return Outcomes(values, tuple(modes))


def _outcomes(pipeline: Pipeline, X: Float, count: Count) -> tuple[Float, npt.NDArray[np.object_]]:
    rollout = pipeline.rollout(X)
    conflicts = encounters(rollout)
    gate = plausibility(rollout)
    other, _ = decisive(conflicts, count)
    score, own, near = (
        closeness_of_pairs(conflicts, of).max(axis=1) for of in (count, "ego", "any")
    )
    rows = np.arange(len(X))
    values = np.zeros((len(X), len(Column)))
    ok = (rollout.status == 0) & (gate.code == Implausible.NONE)
    led = np.where(score >= NEAR_MISS, score, ALMOST * np.minimum(near, NEAR_MISS))
    values[ok, Column.SCORE], values[ok, Column.OWN] = led[ok], own[ok]
    values[ok, Column.SEVERITY] = conflicts.severity[rows, other][ok]
    values[:, Column.RESULT] = np.where(rollout.status != 0, 0.0, np.where(ok, 1.0, -1.0))
    found = Findings.of(conflicts, gate.labels, count)
    words = found.conflict_type + ", " + found.rule + ", with " + found.partner
    return values, words
