"""Importance sampling: rows are drawn where the event happens, and weighted by how likely they are.

Where it happens, subset simulation says, and rows that are spread over the ranges: they also find
what its levels do not lead to (`exploration`). For what rows are drawn from, see `proposals` and
`learning`; for whether the result is believed, `evidence`.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy.special

from bridgegen.base.arrays import Float
from bridgegen.jobs.risk.estimators import exploration, subset
from bridgegen.jobs.risk.estimators.exploration import SinglePoints
from bridgegen.jobs.risk.estimators.problem import SCORE, Aim, Problem, block_of
from bridgegen.jobs.risk.estimators.proposals import DEFENSIVE, OF_CHAIN, Proposals
from bridgegen.jobs.risk.estimators.weighted import FEWEST_HITS, Weighted

# --- Compares importance sampling with subset simulation and exploration, and states its doubts ---
# These two found the event first. How many independent harmful rows they saw bounds the probability
# of a harmful region that they missed, and that the proposals do not cover.


MOST_UNSEEN = 0.9
"""Maximum share of the probability in regions that were not found; the upper end is ten times the
sampled one then, and says little."""
HEAVIEST = 0.2
"""Maximum share of the estimate that may come from one row."""


@dataclass(frozen=True)
class Evidence:
    """What is known of an event before rows are drawn from the proposals.

    Attributes:
        levels: result of subset simulation.
        spread: result of exploration, by rows that are spread over the ranges.
        helped: whether further points of the event were given, for example by a search.
        single: share of the event's probability at single points.
    """

    levels: Weighted
    spread: Weighted
    helped: bool
    single: float

    def judge(self, result: Weighted, aim: Aim) -> Weighted:
        """Return a result of importance sampling with its doubts, facts and final upper end.

        It is compared with subset simulation and then with exploration, unless these are in doubt.
        Those that agree raise the upper end by what all of them may have missed.
        """
        # Whoever of subset simulation and exploration is not in doubt and agrees with the result
        # bounds what the proposals do not cover.
        believed = [weighted for weighted in (self.levels, self.spread) if not weighted.doubts]
        if not believed:
            believed = [self.spread if len(self.spread.Z) and not self.helped else self.levels]
        found = [self._compared(result, known, aim) for known in believed]
        pairs = zip(believed, found, strict=True)
        agreeing = [(known, weighted) for known, weighted in pairs if not weighted.doubts]
        best = agreeing[0][1] if agreeing else found[0]
        if len(agreeing) > 1:  # what is unseen was missed by both, which share no random numbers
            low, share, high = result.share
            unseen = self._unseen(sum(self._worth(known, aim) for known, _ in agreeing))
            best = replace(best, share=(low, share, high / (1.0 - unseen)))
        return replace(best, facts={**best.facts, "spread": float(self.spread.rows)})

    def _compared(self, result: Weighted, known: Weighted, aim: Aim) -> Weighted:
        """Return a result with the doubts, facts and upper end that one known result implies."""
        low, share, high = result.share
        unseen = self._unseen(self._worth(known, aim))
        result = replace(result, share=(low, share, high / (1.0 - unseen)))
        facts = {
            "effective_hits": result.hits(result.there(aim.threshold)),
            "heaviest": _heaviest(result, aim),
            "single": self.single,
            "reached": known.facts.get("reached", 1.0),
        }
        if "explored_hits" in known.facts:
            facts["explored_hits"] = known.facts["explored_hits"]
        return replace(result, doubts=tuple(self._doubts(result, known, aim)), facts=facts)

    def _doubts(self, result: Weighted, known: Weighted, aim: Aim) -> Iterator[str]:
        """Yield why a result is not believed, a sentence each."""
        if known.doubts and self.helped:
            yield (
                f"subset simulation is in doubt ({known.doubts[0]}), so harm other than what the "
                "search found is not bounded; what it found is counted"
            )
        else:
            yield from known.doubts
        hits, heaviest = result.hits(result.there(aim.threshold)), _heaviest(result, aim)
        found = result.probability(aim.threshold)
        if hits < FEWEST_HITS:
            yield (
                f"the effective number of harmful rows is {hits:.0f}, and {FEWEST_HITS:.0f} are "
                "needed"
            )
        elif heaviest > HEAVIEST:
            yield f"one row makes {heaviest:.0%} of the estimate: a region was missed"
        expected = known.probability(aim.threshold)
        before = "subset simulation" if known.repetitions else "exploration"
        more = found.low > expected.high and not self.helped  # a search may have found the rest
        if not known.doubts and (more or expected.low > found.high):
            yield (
                f"{before} says {expected.low:.2g} to {expected.high:.2g}, and importance "
                f"sampling {found.low:.2g} to {found.high:.2g}"
            )

    def _worth(self, known: Weighted, aim: Aim) -> float:
        """Return how many independent harmful rows a known result is worth.

        For subset simulation 1 / c², where c is the relative standard error; for exploration its
        effective number of harmful rows.
        """
        there = known.there(aim.threshold)
        if not known.repetitions:
            return known.hits(there)
        sums = known.sums(there)
        if len(sums) < 2 or not sums.mean() > 0.0:
            return 0.0
        error = float(sums.std(ddof=1) / sums.mean())
        # As many independent harmful rows as the error is worth: a region that n of them all miss
        # has less than 3 / n of the probability (95 %).
        return len(sums) / max(error * error, 1e-12)

    def _unseen(self, n: float) -> float:
        """Return an upper bound of the event's probability that proposals do not cover, a share.

        None of n independent harmful rows lies in a region that was not found, and the share
        `single` of them is at single points. The bound is the upper end of the exact interval for
        that share (Clopper and Pearson, one-sided, 95 %): about 3 / n without single points.
        """
        missed = min(self.single * n, n)
        if n - missed <= 0.0:
            return MOST_UNSEEN
        return min(float(scipy.special.betaincinv(missed + 1.0, n - missed, 0.95)), MOST_UNSEEN)


def _heaviest(result: Weighted, aim: Aim) -> float:
    """Return the share of the estimate that the heaviest row has."""
    parts = result.weights * result.there(aim.threshold)
    total = float(parts.sum())
    return float(parts.max()) / total if total > 0.0 else 0.0


# --- Fits proposals again and again, to the points of the event that they draw themselves ---
# A point's weight is its density on the road over the mean density of all proposals so far. A point
# that the first proposals seldom draw therefore does not outweigh all others. Rows of the result
# are # drawn afterwards, so learning does not bias it.
#
# Source: Cornuet, Marin, Mira and Robert, Scandinavian Journal of Statistics 39 (2012) 798-812
# (adaptive multiple importance sampling).


OF_ROUND, FEWEST_ROWS = 2000, 100
"""Largest and least number of rows of a round."""
ROUNDS, MOST_ROUNDS = 10, 20
"""Number of rounds that a small budget is divided into, and maximum number of rounds."""
OF_BUDGET = 4
"""Part of the budget that all rounds take together at most: a quarter."""
ENOUGH = 400.0
"""Effective number of points of the event at which learning ends."""


def learn(
    problem: Problem, aim: Aim, first: Proposals, budget: int, random: np.random.Generator
) -> tuple[Proposals, int]:
    """Return fitted proposals, and the number of evaluations spent.

    Args:
        problem: the experiment.
        aim: the event.
        first: initial proposals; their kernels are kept, so that no known region is lost.
        budget: remaining evaluations.
        random: source of all random numbers.
    """
    most = budget // OF_BUDGET
    rows = min(OF_ROUND, most // ROUNDS)
    rounds = min(MOST_ROUNDS, most // rows) if rows >= FEWEST_ROWS else 0
    proposals, spent = first, 0
    drawn: list[Proposals] = []
    found: list[Float] = []
    for _ in range(rounds):
        Z, _ = proposals.draw(rows, random)
        Z = Z[problem.feasible(Z)]
        drawn.append(proposals)
        found.append(Z[problem.evaluate(Z, aim.least)[:, SCORE] >= aim.threshold])
        spent += len(Z)
        points = np.concatenate(found)
        if not len(points):
            continue
        # Fitted twice, to the last proposals' rows alone, 150,000 rows in cut-in were worth 8
        # harmful ones.
        weights = 1.0 / np.mean([1.0 / item.weights(points) for item in drawn], axis=0)
        size = float(weights.sum() ** 2 / np.sum(weights * weights))
        proposals = replace(Proposals.of(points, weights, size, random), kernels=first.kernels)
        if size >= ENOUGH:
            break
    return proposals, spent


PREPARED, FOUND = 0.6, 0.5
"""The share of the budget that subset simulation may take, and the precision at which it stops."""
EXPLORED, CHECKED = 0.5, 0.3
"""The share of what is left that exploration may take, if subset simulation is in doubt or not."""
STRANGE = 0.25
"""Largest share of the first proposals that are around spread points rather than those of
levels."""
FEW = 50
"""Largest number of spread points that rows are drawn around where they are too few for more."""
BLOCK, FIRST = 16_384, 1024


def estimate(problem: Problem, aim: Aim, seed: int, start: Float | None = None) -> Weighted:
    """Find the event by subset simulation, fit proposals, and draw rows from them.

    Until the precision or the budget is reached.

    Args:
        problem: the experiment.
        aim: the event.
        seed: of all random numbers.
        start: ``(M, d)`` further points of the event, from a search say.
    """
    less = replace(aim, budget=max(int(PREPARED * aim.budget), 1), precision=FOUND)
    levels = subset.simulate(problem, less, seed)
    left = aim.budget - levels.evaluations
    # Always, not only where subset simulation is in doubt: a score that led to a fifth of the
    # probability, and said nothing of the rest, gave 0.20 to 0.21 of the truth with a narrow
    # interval.
    check = min(int(CHECKED * left), levels.evaluations)
    rest = replace(aim, budget=int(EXPLORED * left) if levels.doubts else check)
    spread = exploration.explore(problem, rest, seed)
    Z, weights = seen = _points(levels, spread, aim)
    helped = start is not None and len(start) > 0
    if start is not None and helped:
        more = (weights.sum() if len(Z) else 1.0) / len(start)  # half of the rows look there
        Z, weights = np.concatenate([Z, start]), np.append(weights, np.full(len(start), more))
    spent = levels.evaluations + spread.evaluations
    if not len(Z):
        return replace(levels, evaluations=spent)
    random = block_of(seed, 0, 1)
    explored = levels.doubts and not helped
    size = spread.hits(spread.there(aim.threshold)) if explored else len(Z) / OF_CHAIN
    proposals = Proposals.of(Z, weights, size, random)
    if spread.doubts and not levels.doubts:
        # Narrow kernels alone: as a part of what mixtures are fitted to, one point that weighed
        # more than all others left a tenth of the effective rows in 20 dimensions.
        proposals = proposals.also_around(_heaviest_points(spread, aim))
    single = SinglePoints.of(problem, aim, seed, *seen, proposals.kernels)
    spent += single.evaluations
    # Noise is a function of the row: proposals draw rows around harmful ones, and meet harm that
    # noise makes no more often than on the road. lead-brakes with `reference` was estimated at
    # 2.6e-4 where 3.4e-4 are counted.
    if single.doubt:
        known, facts = spread if levels.doubts else levels, {"single": single.share, "reached": 0.0}
        doubts = (single.doubt, *known.doubts)
        return replace(known, evaluations=spent, doubts=doubts, facts=facts)
    proposals, took = learn(problem, aim, proposals, aim.budget - spent, random)
    spent += took
    evidence = Evidence(levels, spread, helped, single.share)
    return _drawn(problem, aim, seed, proposals, spent, evidence)


def _points(levels: Weighted, spread: Weighted, aim: Aim) -> tuple[Float, Float]:
    """Return points of the event that proposals begin with, ``(M, d)``, and weights, ``(M,)``."""
    Z, weights = (part[spread.scores >= aim.threshold] for part in (spread.Z, spread.weights))
    if levels.doubts or not levels.repetitions:
        return Z, weights
    there = levels.scores >= aim.threshold
    known = levels.weights[there]
    if spread.doubts:
        return levels.Z[there], known
    most = STRANGE / (1.0 - STRANGE) * float(known.sum())
    weights = weights * min(most / float(weights.sum()), 1.0)
    return np.concatenate([levels.Z[there], Z]), np.append(known, weights)


def _heaviest_points(spread: Weighted, aim: Aim) -> Float:
    """Return the points of the event that are likeliest on the road, `FEW` at most."""
    order = np.argsort(-spread.weights * spread.there(aim.threshold), kind="stable")
    found: Float = spread.Z[order[: min(FEW, int(spread.there(aim.threshold).sum()))]]
    return found


def _drawn(
    problem: Problem, aim: Aim, seed: int, proposals: Proposals, spent: int, evidence: Evidence
) -> Weighted:
    """Draw rows until the result is believed and precise, or the budget is spent."""
    kept: list[tuple[Float, Float, Float]] = []
    drawn = used = block = 0
    check, limit = FIRST, max(aim.budget - spent, 1)
    while used < limit:
        block += 1
        n = min(check - drawn, BLOCK, limit - used)
        Z, weights = proposals.draw(n, block_of(seed, 0, 2, block))
        drawn += n
        good = problem.feasible(Z)
        found = problem.evaluate(Z[good], aim.least)
        used += len(found)
        hit = found[:, SCORE] >= aim.least
        kept.append((Z[good][hit], found[hit], weights[good][hit]))
        if drawn == check:
            check *= 2
            result = evidence.judge(_result(problem, kept, drawn, spent + used), aim)
            if not result.doubts and result.probability(aim.threshold).precision <= aim.precision:
                break
    result = evidence.judge(_result(problem, kept, drawn, spent + used), aim)
    components = float(len(proposals.fitted.weights))
    return replace(result, facts={"components": components, **result.facts})


def _result(
    problem: Problem, kept: list[tuple[Float, Float, Float]], drawn: int, spent: int
) -> Weighted:
    Z, found, weight = (np.concatenate(pair) for pair in zip(*kept, strict=True))
    low, share, high = problem.share
    factor = 1.0 / (drawn * share)
    return Weighted(
        Z,
        found,
        weight * factor,
        drawn,
        np.empty(0, np.int64),
        0,
        factor / DEFENSIVE,
        (1.0 / high, 1.0 / share, 1.0 / low),
        spent,
    )
