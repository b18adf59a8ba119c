"""Importance sampling: rows are drawn where the event happens, and weighted by how likely they are.

Proposals are a mixture of three: normal distributions fitted to points of the event; narrow ones
around single points of it, so that no region that was seen is left out; and, for a tenth of the
rows, the distribution of the road itself. The last one keeps all weights below ten.

Sources: Rubinstein and Kroese, The Cross-Entropy Method (2004); Owen and Zhou, Journal of the
American Statistical Association 95 (2000) 135-143 (defensive mixtures).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from bridgegen.arrays import Float
from bridgegen.risk.estimators import mixture, subset
from bridgegen.risk.estimators.mixture import Kernels, Mixture
from bridgegen.risk.estimators.problem import SCORE, Aim, Problem, block_of
from bridgegen.risk.estimators.weighted import FEWEST_HITS, Weighted

DEFENSIVE, AROUND = 0.1, 0.25
"""The shares of rows that are drawn as on the road, and around single points."""
FITTED, CENTRES = 500, 200  # points, at most
ROUNDS, OF_ROUND = 2, 2000
"""How often proposals are fitted again, and to how many rows."""
PREPARED, FOUND = 0.6, 0.5
"""The share of the budget that subset simulation may take, and the precision at which it stops."""
FEWEST_ROWS = 100  # of a round
OF_CHAIN = 5.0  # points of chains are worth one independent one
BLOCK, FIRST = 16_384, 1024
MOST_UNSEEN = 0.9  # of the probability in regions that nobody has seen: no upper end to speak of
HEAVIEST = 0.2
"""Of the estimate at most may come from one row."""
_INFLATED = 1.2  # standard deviations: tails that are too thin make weights too large


@dataclass(frozen=True)
class Proposals:
    """What rows are drawn from."""

    fitted: Mixture
    kernels: Kernels

    @classmethod
    def of(cls, Z: Float, weights: Float, size: float, random: np.random.Generator) -> "Proposals":
        """Fit them to weighted points of the event.

        Args:
            Z: ``(M, d)``, M ≥ 1.
            weights: ``(M,)``, positive.
            size: how many independent points they are worth.
            random: chooses points and where components begin.
        """
        Z, first = np.unique(Z, axis=0, return_inverse=True)
        sums = np.bincount(first.reshape(-1), weights, len(Z)).astype(np.float64)
        p = sums / sums.sum()
        if len(Z) > FITTED:
            Z = Z[random.choice(len(Z), FITTED, p=p)]
            p = np.full(FITTED, 1.0 / FITTED)
        made = mixture.fit(Z, p, size, random)
        centres = Z[random.choice(len(Z), min(CENTRES, len(Z)), replace=False, p=p)]
        wide = replace(made, factors=made.factors * _INFLATED)
        return cls(wide, Kernels.around(centres, made.within))

    def draw(self, n: int, random: np.random.Generator) -> tuple[Float, Float]:
        """Draw n points; return them and their weights."""
        d = self.fitted.means.shape[1]
        Z = self.fitted.sample(n, random)
        kind = random.random(n)
        plain, around = kind < DEFENSIVE, kind >= 1.0 - AROUND
        Z[plain] = random.standard_normal((int(plain.sum()), d))
        Z[around] = self.kernels.sample(int(around.sum()), random)
        return Z, self.weights(Z)

    def weights(self, Z: Float) -> Float:
        """Return how much likelier points are on the road than among these proposals, ``(N,)``."""
        d = Z.shape[1]
        road = -0.5 * np.sum(Z * Z, axis=1) - 0.5 * d * np.log(2.0 * np.pi)
        parts = (
            (1.0 - DEFENSIVE - AROUND, self.fitted.log_density(Z)),
            (AROUND, self.kernels.log_density(Z)),
        )
        ratio = sum(share * np.exp(np.minimum(one - road, 700.0)) for share, one in parts)
        found: Float = 1.0 / (DEFENSIVE + ratio)
        return found


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
    known = subset.estimate(problem, less, seed)
    there = known.scores >= aim.threshold
    Z, weights = known.Z[there], known.weights[there]
    if start is not None and len(start):
        more = (weights.sum() if len(Z) else 1.0) / len(start)  # half of the rows look there
        Z, weights = np.concatenate([Z, start]), np.append(weights, np.full(len(start), more))
    if not len(Z):
        return known
    random, spent = block_of(seed, 0, 1), known.evaluations
    proposals = Proposals.of(Z, weights, len(Z) / OF_CHAIN, random)
    rows = min(OF_ROUND, (aim.budget - spent) // (4 * ROUNDS))
    for _ in range(ROUNDS if rows >= FEWEST_ROWS else 0):
        Z, weights = proposals.draw(rows, random)
        good = problem.feasible(Z)
        Z, weights = Z[good], weights[good]
        inside = problem.evaluate(Z, aim.least)[:, SCORE] >= aim.threshold
        spent += len(Z)
        if inside.any():
            weights = weights[inside]
            size = float(weights.sum() ** 2 / np.sum(weights * weights))
            found = Proposals.of(Z[inside], weights, size, random)
            proposals = replace(found, kernels=proposals.kernels)
    helped = start is not None and len(start) > 0
    return _drawn(problem, aim, seed, proposals, spent, known, helped)


def _drawn(
    problem: Problem,
    aim: Aim,
    seed: int,
    proposals: Proposals,
    spent: int,
    known: Weighted,
    helped: bool,
) -> Weighted:
    unseen = _unseen(known, aim)
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
            result = _result(problem, kept, drawn, spent + used, unseen)
            if result.probability(aim.threshold).precision <= aim.precision and not any(
                _doubts(result, aim, known, helped)
            ):
                break
    result = _result(problem, kept, drawn, spent + used, unseen)
    facts = {
        "components": float(len(proposals.fitted.weights)),
        "effective_hits": result.hits(result.there(aim.threshold)),
        "heaviest": _heaviest(result, aim),
        "reached": known.facts.get("reached", 1.0),
    }
    return replace(result, doubts=tuple(_doubts(result, aim, known, helped)), facts=facts)


def _heaviest(result: Weighted, aim: Aim) -> float:
    """Return the share of the estimate that the heaviest row has."""
    parts = result.weights * result.there(aim.threshold)
    total = float(parts.sum())
    return float(parts.max()) / total if total > 0.0 else 0.0


def _doubts(result: Weighted, aim: Aim, known: Weighted, helped: bool) -> Iterator[str]:
    """Yield why a result is not believed; ``helped`` by further points of the event or not."""
    if known.doubts and helped:
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
            f"the effective number of harmful rows is {hits:.0f}, and {FEWEST_HITS:.0f} are needed"
        )
    elif heaviest > HEAVIEST:
        yield f"one row makes {heaviest:.0%} of the estimate: a region was missed"
    expected = known.probability(aim.threshold)
    more = not helped and found.low > expected.high  # what a search found may be missing there
    if not known.doubts and (more or expected.low > found.high):
        yield (
            f"subset simulation says {expected.low:.2g} to {expected.high:.2g}, and importance "
            f"sampling {found.low:.2g} to {found.high:.2g}"
        )


def _unseen(known: Weighted, aim: Aim) -> float:
    """Return the share of the event's probability that regions may have which nobody has seen.

    Subset simulation that knows the probability to a relative standard error c has seen as much of
    it as 1 / c² independent harmful rows show. A region that n of them all miss has less than 3 / n
    of the probability, with 95 % confidence.
    """
    sums = known.sums(known.there(aim.threshold))
    if len(sums) < 2 or not sums.mean() > 0.0:
        return MOST_UNSEEN
    error = float(sums.std(ddof=1) / sums.mean())
    return min(3.0 * error * error / len(sums), MOST_UNSEEN)


def _result(
    problem: Problem, kept: list[tuple[Float, Float, Float]], drawn: int, spent: int, unseen: float
) -> Weighted:
    Z, found, weight = (np.concatenate(one) for one in zip(*kept, strict=True))
    low, share, high = problem.share
    factor = 1.0 / (drawn * share)
    return Weighted(
        Z, found, weight * factor, drawn, np.empty(0, np.int64), 0, factor / DEFENSIVE,
        (1.0 / high, 1.0 / share, 1.0 / (low * (1.0 - unseen))), spent,
    )  # fmt: skip
