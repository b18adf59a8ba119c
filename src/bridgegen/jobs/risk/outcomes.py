"""Outcomes of rows for estimators: how close to harm, which event, how few data weigh them."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import IntEnum
from typing import Self

import numpy as np
import numpy.typing as npt

from bridgegen.assess.conflict._limits import HORIZON
from bridgegen.assess.conflict.analysis import COURSE, Conflicts, encounters
from bridgegen.assess.conflict.analysis import NEAR_MISS as NEARLY
from bridgegen.assess.conflict.findings import Findings
from bridgegen.assess.conflict.harm import NEAR_MISS, Count, closeness_of_pairs, decisive
from bridgegen.assess.conflict.plausibility import Implausible, plausibility
from bridgegen.base.arrays import Float
from bridgegen.base.errors import UnknownNameError
from bridgegen.engine.judged import judge
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.runner import Runner
from bridgegen.jobs.risk.estimators.weighted import Weighted
from bridgegen.jobs.risk.options import WORDS
from bridgegen.scenario.exposure import Exposure
from bridgegen.scenario.exposure.fit import Fit

ALMOST = 0.999  # of the least harm that counts: conflicts that do not count lead to those that do


class Column(IntEnum):
    """The columns of an outcome; the first is what `estimators` call the score."""

    SCORE = 0
    """Score of the worst pair, `conflict.harm.closeness_of_pairs`, from a near miss on; below, how
    near the row comes to any conflict, whether it counts or not. 0 of a row without a result."""
    OWN = 1
    """Score where only conflicts count that the ego is responsible for or could prevent."""
    SEVERITY = 2
    """Probability of a MAIS3+ injury in the ego's collision."""
    RESULT = 3
    """Status of the row: 1; 0 where the simulation failed; −1 where the traffic is implausible."""
    MODE = 4
    """Number of the failure mode among `Outcomes.modes`; −1 of a harmless row."""
    TTC = 5
    """Shortest time to collision [s] of the row's collision courses, of near misses and collisions
    of those that count; 0 in a collision, `HORIZON` without any."""


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
        for part in parts:
            # Each part numbers its modes from 0 on: the same words get the same number here.
            numbers = np.array([modes.setdefault(mode, len(modes)) for mode in part.modes], float)
            found = part.values.copy()
            has = found[:, Column.MODE] >= 0.0
            found[has, Column.MODE] = numbers[found[has, Column.MODE].astype(np.int64)]
            values.append(found)
        return cls(np.concatenate(values), tuple(modes))

    @classmethod
    def lost(cls, n: int) -> "Outcomes":
        """Return those of N rows without a result."""
        values = np.zeros((n, len(Column)))
        values[:, Column.MODE], values[:, Column.TTC] = -1.0, HORIZON
        return cls(values, ())


def outcomes(pipeline: Pipeline, X: Float, count: Count, least: float = -np.inf) -> Outcomes:
    """Simulate N rows, in this thread.

    Args:
        pipeline: of the driver.
        X: ``(N, len(space.names))`` feasible rows.
        count: whose conflicts count.
        least: outcomes with a lower score may have any lower score.
    """
    values = Outcomes.lost(len(X)).values
    words = np.full(len(X), "", dtype=object)
    for at, runner in pipeline.runner.by_variant(X):
        values[at], words[at] = _outcomes(runner, X[at], count, least)
    harmful = values[:, Column.SCORE] >= NEAR_MISS
    modes = dict.fromkeys(words[harmful])
    numbers = {mode: number for number, mode in enumerate(modes)}
    values[harmful, Column.MODE] = [numbers[mode] for mode in words[harmful]]
    return Outcomes(values, tuple(modes))


def _outcomes(
    runner: Runner, X: Float, count: Count, least: float
) -> tuple[Float, npt.NDArray[np.object_]]:
    values, words = Outcomes.lost(len(X)).values, np.full(len(X), "", dtype=object)
    if (judged := judge(runner, X)) is not None:
        status, code = judged.status, judged.code.astype(np.int8)
        ok = (status == 0) & (code == Implausible.NONE)
        # Of a million rows a few hundred come near: only those are looked at one by one.
        at = np.flatnonzero(ok & (judged.worst >= NEARLY) if least >= NEAR_MISS else ok)
        conflicts = judged.conflicts(at)
    else:
        rollout = runner.run(X)
        status, code = rollout.status, plausibility(rollout).code
        # Neither a failed row nor one whose traffic could not happen counts as an event.
        ok = (status == 0) & (code == Implausible.NONE)
        at, whole = np.flatnonzero(ok), encounters(rollout)
        conflicts = whole.take(at)
    values[:, Column.RESULT] = np.where(status != 0, 0.0, np.where(ok, 1.0, -1.0))
    if at.size:
        values[at], words[at] = _of_conflicts(conflicts, count)
    return values, words


def _of_conflicts(conflicts: Conflicts, count: Count) -> tuple[Float, npt.NDArray[np.object_]]:
    """Return the outcomes of rows that could happen, and the words of their modes."""
    n = len(conflicts.kind)
    values, rows = Outcomes.lost(n).values, np.arange(n)
    other, _ = decisive(conflicts, count)
    score, own, near = (
        closeness_of_pairs(conflicts, of).max(axis=1) for of in (count, "ego", "any")
    )
    # Harm alone is 0 where the ego is not responsible: levels that followed it ended in front of
    # such conflicts (cut-in, `careful`: at 0.2, never at 0.3).
    led = np.where(score >= NEAR_MISS, score, ALMOST * np.minimum(near, NEAR_MISS))
    values[:, Column.SCORE], values[:, Column.OWN] = led, own
    values[:, Column.SEVERITY] = conflicts.severity[rows, other]
    meets = (conflicts.kind == COURSE) | conflicts.at_fault | (count == "any")
    meets[:, 0] = False
    ttc = np.where(meets, conflicts.ttc, HORIZON)
    values[:, Column.TTC], values[:, Column.RESULT] = ttc.min(axis=1, initial=HORIZON), 1.0
    found = Findings.of(conflicts, [""] * n, count)
    return values, found.conflict_type + ", " + found.rule + ", with " + found.partner


# --- The events whose probability is estimated, by severity ---


LEAST = NEAR_MISS
"""The score from which outcomes are kept."""

INJURY = "mais3"
"""Name of a serious injury: the mean probability of MAIS3+ in collisions, and no event of its
own."""


@dataclass(frozen=True)
class Event:
    """An event.

    Attributes:
        score: it happens from this score on; see `outcomes.Column`.
        description: in words.
    """

    score: float
    description: str


EVENTS: Mapping[str, Event] = {
    "conflict": Event(NEAR_MISS, WORDS["conflict"]),
    "collision": Event(2.0 * NEAR_MISS, WORDS["collision"]),
}
"""Events by name; the last one is the default."""


def require(name: str) -> Event:
    """Return the event of that name.

    Raises:
        UnknownNameError: there is none.
    """
    if name not in EVENTS:
        raise UnknownNameError("event", name, EVENTS)
    return EVENTS[name]


# --- The uncertainty that few data leave: outcomes weighted for resampled events ---


FEWEST = 10.0
"""Effective number of hits that a resampled exposure must leave for its weights to be believed."""
MOST_LEFT_OUT = 0.1  # of the exposures
MOST_ROWS = 5000  # outcomes that are weighted


@dataclass(frozen=True)
class DataBand:
    """Between which probabilities the exposures of resampled events lie.

    Attributes:
        low: the 2.5 % quantile; None if that cannot be said.
        high: the 97.5 % quantile; likewise.
        exposures: how many there are.
        left_out: how many have their harmful encounters where too few rows were simulated.
    """

    low: float | None
    high: float | None
    exposures: int
    left_out: int


def data_band(exposure: Exposure, weighted: Weighted, threshold: float, fit: Fit) -> DataBand:
    """Return how the probability of an event varies with the exposure.

    An outcome's weight is multiplied by how much likelier its row is in an exposure than in the
    fitted one.

    Args:
        exposure: of the outcomes: the fitted one, or one like it.
        weighted: the outcomes.
        threshold: the event's.
        fit: to the events.
    """
    replicates = fit.replicates
    # Outcomes are weighted anew, not simulated: hundreds of exposures cost no evaluation. Where one
    # has its harm in places with few rows, its weights are not believed (`FEWEST`).
    hits = np.flatnonzero(weighted.there(threshold))
    at = hits[:: max(1, len(hits) // MOST_ROWS)]
    if not len(at):
        return DataBand(None, None, len(replicates), len(replicates))
    X = exposure.from_normal(weighted.Z[at])
    weights, before = weighted.weights[at], fit.exposure.log_density(X)
    good = np.isfinite(before)
    # A row that the fitted exposure excludes has no ratio of densities.
    X, weights, before = X[good], weights[good], before[good]
    factors = []
    for replicate in replicates:
        # Capped, so that exp does not overflow.
        parts: Float = weights * np.exp(np.minimum(replicate.log_density(X) - before, 50.0))
        total, squares = float(parts.sum()), float(np.sum(parts * parts))
        if squares > 0.0 and total * total / squares >= FEWEST:
            factors.append(total / float(weights.sum()))
    left_out = len(replicates) - len(factors)
    if left_out > MOST_LEFT_OUT * len(replicates):
        return DataBand(None, None, len(replicates), left_out)
    p = weighted.probability(threshold).estimate
    low, high = np.quantile(factors, [0.025, 0.975]).tolist()
    return DataBand(p * low, min(p * high, 1.0), len(replicates), left_out)
