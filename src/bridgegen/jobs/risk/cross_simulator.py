"""By which factor an event is more or less likely in another simulator than in the embedded one.

In two phases, since the other one is slow. Many rows around the event's are simulated here, and
weighted by how likely they are. Of those that are the event, and of those that come close to it, a
few are then chosen with probabilities in proportion to their weights, and simulated there. The
factor is the share of the event that is confirmed there, and what is the event there of the rows
that only come close here. Where no row comes close to harm here, harm there is not looked for.

Sources: Särndal, Swensson and Wretman, Model Assisted Survey Sampling (1992), chapter 9 (two-phase
sampling); Korn and Graubard, Survey Methodology 24 (1998) 193-201 (exact intervals of weighted
shares); Zou and Donner, Statistics in Medicine 27 (2008) 1693-1702 (intervals of sums).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError
from bridgegen.base.statistics import clopper_pearson
from bridgegen.jobs.risk.estimators.problem import block_of
from bridgegen.jobs.risk.estimators.proposals import OF_CHAIN, Proposals
from bridgegen.jobs.risk.estimators.weighted import FEWEST_HITS, LEVEL, Weighted
from bridgegen.jobs.risk.experiment import Experiment
from bridgegen.jobs.risk.ledger import ELSEWHERE, Ledger
from bridgegen.jobs.risk.outcomes import Column, Outcomes
from bridgegen.simulation.choice import SimulatorChoice

CLOSE = 3.0
"""Largest weight of the rows examined that are closest to the event, as a multiple of the
event's."""
# Two phases spend what is cheap: of 200 rows in both simulators, 5 effective ones were harmful in
# cut-in.
HERE = 16_384  # rows that are simulated here
AT_A_TIME = 32  # rows there, between two entries of the ledger
MOST_FAILED = 0.2  # of the rows there: the others may be a biased choice
_STREAM = 3  # of random numbers, beside those of importance sampling
_NORMAL = 1.96


@dataclass(frozen=True)
class Ratio:
    """A ratio with its 95 % interval.

    Attributes:
        estimate: NaN where no row says it.
        low: lower end of the interval.
        high: upper end.
    """

    estimate: float
    low: float
    high: float


@dataclass(frozen=True)
class Elsewhere:
    """The event in another simulator.

    Attributes:
        simulator: its name.
        rows: how many different ones were simulated there.
        failed: how many of them have no result there, and are not compared.
        confirmed: the share of the probability here that is the event there, too.
        new: what is the event there of the rows that only come close here, over the probability
            here.
        factor: probability there over the one here; None where that is not known.
        doubt: why the factor is not known; empty where it is.
    """

    simulator: str
    rows: int
    failed: int
    confirmed: Ratio
    new: Ratio
    factor: Ratio | None
    doubt: str

    def to_dict(self) -> Mapping[str, Any]:
        """Return what ``risk.json`` says of it."""
        return {
            "simulator": self.simulator,
            "rows": self.rows,
            "failed": self.failed,
            "confirmed": _known(self.confirmed),
            "new": _known(self.new),
            "factor": None if self.factor is None else _known(self.factor),
            "doubt": self.doubt,
        }


@dataclass(frozen=True)
class Group:
    """Rows of the first phase that are the event, or that come close to it.

    Attributes:
        mass: their weight.
        worth: how many rows of equal weights are worth as much.
        weights: ``(M,)`` how often each of the rows that were simulated there was chosen.
        there: ``(M,)`` whether it is the event there.
        ran: ``(M,)`` whether it has a result there.
    """

    mass: float
    worth: float
    weights: Float
    there: Bool
    ran: Bool

    @property
    def share(self) -> Ratio:
        """The share that is the event there."""
        return share_of(self.weights[self.ran], self.there[self.ran])


def look_elsewhere(
    here: Experiment,
    there: Experiment,
    simulator: str,
    known: Weighted,
    threshold: float,
    rows: int,
    seed: int,
) -> Elsewhere:
    """Simulate rows around those of an event in two simulators.

    Args:
        here: in the embedded one.
        there: in the other one, with the same dimensions.
        simulator: its name.
        known: what an estimator found here.
        threshold: the event's score.
        rows: how many there, at most.
        seed: of all random numbers.
    """
    at = known.there(threshold) > 0.0
    if not at.any():
        nothing = Ratio(math.nan, 0.0, 1.0)
        return Elsewhere(simulator, 0, 0, nothing, nothing, None, "no harmful row was found")
    random = block_of(seed, 0, _STREAM)
    proposals = Proposals.of(known.Z[at], known.weights[at], at.sum() / OF_CHAIN, random)
    Z, weights = proposals.draw(HERE, random)
    # What breaks a constraint cannot happen on the road; its weight is 0 in both simulators.
    good = here.feasible(Z)
    Z, weights = Z[good], weights[good]
    scores = here.evaluate(Z)[:, Column.SCORE]
    is_event = scores >= threshold
    close = _closest(scores, weights, is_event)
    parts = ((is_event, rows // 2), (close, rows - rows // 2))
    return compare(
        simulator,
        *(_group(there, Z[part], weights[part], n, threshold, random) for part, n in parts),
    )


def _closest(scores: Float, weights: Float, is_event: Bool) -> Bool:
    """Return which rows that are not the event come closest to it, `CLOSE`."""
    order = np.argsort(np.where(is_event, np.inf, -scores), kind="stable")[: int(np.sum(~is_event))]
    # By weight, not by harm: rows of half a near miss's harm were 480 times as likely as harm in
    # cut-in, and no hit among 100 of them left the factor open up to 18.
    most = CLOSE * float(weights[is_event].sum())
    found = np.zeros(len(scores), np.bool_)
    found[order[np.cumsum(weights[order]) <= most]] = True
    return found


def _group(
    there: Experiment,
    Z: Float,
    weights: Float,
    rows: int,
    threshold: float,
    random: np.random.Generator,
) -> Group:
    """Simulate some of weighted rows there, chosen in proportion to their weights."""
    if not len(Z):
        none = np.empty(0)
        return Group(0.0, 0.0, none, none > 0.0, none > 0.0)
    # With replacement: each draw is then independent, and a row that is drawn often is simulated
    # once.
    chosen = random.choice(len(Z), rows, p=weights / weights.sum())
    which, often = np.unique(chosen, return_counts=True)
    found = _evaluated(there, Z[which])
    event, ran = found[:, Column.SCORE] >= threshold, found[:, Column.RESULT] != 0.0
    return Group(float(weights.sum()), worth(weights), often.astype(np.float64), event, ran)


def compare(simulator: str, event: Group, close: Group) -> Elsewhere:
    """Return what the rows of both groups say.

    Args:
        simulator: the name of the other one.
        event: the rows that are the event here.
        close: those that only come close to it here.
    """
    rows = len(event.ran) + len(close.ran)
    failed = rows - int(event.ran.sum()) - int(close.ran.sum())
    confirmed, new = event.share, _new(event, close)
    doubt = ""
    if failed > MOST_FAILED * rows:
        doubt = f"{failed} of {rows} rows have no result in {simulator}"
    elif (hits := min(event.worth, worth(event.weights))) < FEWEST_HITS:
        doubt = (
            f"the effective number of harmful rows is {hits:.0f}, and {FEWEST_HITS:.0f} are needed"
        )
    factor = None if doubt else _sum(confirmed, new)
    return Elsewhere(simulator, rows, failed, confirmed, new, factor, doubt)


def kept_elsewhere(folder: Path, choice: SimulatorChoice, settings: Mapping[str, Any]) -> Ledger:
    """Return the evaluations in another simulator that are kept beside an estimate's.

    Args:
        folder: of the estimate.
        choice: the other simulator.
        settings: what the estimate depends on.

    Raises:
        StorageError: they are those of another one, or cannot be written.
    """
    own = {"simulator": choice.name, "simulator settings": dict(choice.settings)}
    return Ledger(folder / f"{ELSEWHERE}{choice.name}", {**settings, **own})


def worth(weights: Float) -> float:
    """Return how many rows of equal weights are worth as much."""
    squares = float(np.sum(weights * weights))
    return float(weights.sum()) ** 2 / squares if squares > 0.0 else 0.0


def share_of(weights: Float, yes: Bool) -> Ratio:
    """Return the weighted share of rows, with its interval.

    Args:
        weights: ``(N,)``.
        yes: ``(N,)``, which rows make the share.
    """
    n = worth(weights)
    if not n:
        return Ratio(math.nan, 0.0, 1.0)
    share = float(np.sum(weights * yes) / weights.sum())
    return Ratio(share, *clopper_pearson(share * n, n, LEVEL))


def _evaluated(there: Experiment, Z: Float) -> Float:
    """Return outcomes of N points, some at a time so that little is lost at an interruption."""
    parts = [_ran(there, Z[k : k + AT_A_TIME]) for k in range(0, len(Z), AT_A_TIME)]
    return np.concatenate(parts)


def _ran(there: Experiment, Z: Float) -> Float:
    """Return outcomes of N points; what a simulator refuses has no result, the others go on."""
    try:
        return there.evaluate(Z)
    except InputError:
        if len(Z) == 1:
            return Outcomes.lost(1).values
    return np.concatenate([_ran(there, z[np.newaxis]) for z in Z])


def _new(event: Group, close: Group) -> Ratio:
    """Return what is the event there alone, over the probability here."""
    if not close.mass:
        return Ratio(0.0, 0.0, 0.0)
    share, size = close.share, close.mass / event.mass if event.mass else math.inf
    spread = _NORMAL * math.sqrt(1.0 / max(event.worth, 1.0) + 1.0 / close.worth)
    high = share.high * size * math.exp(spread)
    if not share.estimate > 0.0:
        return Ratio(0.0 if share.estimate == 0.0 else math.nan, 0.0, high)
    down = math.hypot(math.log(share.estimate / share.low), spread)
    up = math.hypot(math.log(share.high / share.estimate), spread)
    estimate = share.estimate * size
    return Ratio(estimate, estimate * math.exp(-down), estimate * math.exp(up))


def _sum(ratio: Ratio, other: Ratio) -> Ratio:
    # Zou and Donner's interval of a sum: the distances to both ends add like standard errors, so
    # that skewed intervals stay skewed.
    estimate = ratio.estimate + other.estimate
    low = math.hypot(ratio.estimate - ratio.low, other.estimate - other.low)
    high = math.hypot(ratio.high - ratio.estimate, other.high - other.estimate)
    return Ratio(estimate, estimate - low, estimate + high)


def _known(ratio: Ratio) -> Mapping[str, float | None]:
    """Return it for a record, which has no NaN."""
    return vars(ratio) | {"estimate": ratio.estimate if math.isfinite(ratio.estimate) else None}
