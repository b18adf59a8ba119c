"""Importance sampling: rows are drawn where the event happens, and weighted by how likely they are.

Where it happens, subset simulation says, and rows that are spread over the ranges: they also find
what its levels do not lead to (`exploration`). For what rows are drawn from, see `proposals`.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import scipy.special

from bridgegen.arrays import Float
from bridgegen.risk.estimators import exploration, subset
from bridgegen.risk.estimators.problem import SCORE, Aim, Problem, block_of
from bridgegen.risk.estimators.proposals import DEFENSIVE, OF_CHAIN, Proposals
from bridgegen.risk.estimators.weighted import FEWEST_HITS, Weighted

ROUNDS, OF_ROUND = 2, 2000
"""How often proposals are fitted again, and to how many rows."""
PREPARED, FOUND = 0.6, 0.5
"""The share of the budget that subset simulation may take, and the precision at which it stops."""
EXPLORED, CHECKED = 0.5, 0.1
"""The share of what is left that exploration may take, if subset simulation is in doubt or not."""
STRANGE = 0.25
"""Of the first proposals at most are around spread points, beside those of levels."""
SINGLE = 50
"""Spread points at most that rows are drawn around where they are too few for more."""
TRIED, COPIES, BESIDE = 128, 8, 0.01
"""Points of the event around which copies are evaluated, and how far away these are, as a share of
the narrow kernels."""
ROUGH = 0.02
"""The share of points without any copy in the event, from which on proposals do not cover it."""
FEWEST_ROWS = 100  # of a round
BLOCK, FIRST = 16_384, 1024
MOST_UNSEEN = 0.9  # of the probability in regions that nobody has seen: no upper end to speak of
HEAVIEST = 0.2
"""Of the estimate at most may come from one row."""


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
    levels = subset.estimate(problem, less, seed)
    left = aim.budget - levels.evaluations
    check = min(int(CHECKED * left), levels.evaluations)
    rest = replace(aim, budget=int(EXPLORED * left) if levels.doubts else check)
    spread = exploration.explore(problem, rest, seed)
    Z, weights = seen = _points(levels, spread, aim)
    if start is not None and len(start):
        more = (weights.sum() if len(Z) else 1.0) / len(start)  # half of the rows look there
        Z, weights = np.concatenate([Z, start]), np.append(weights, np.full(len(start), more))
    spent = levels.evaluations + spread.evaluations
    if not len(Z):
        return replace(levels, evaluations=spent)
    random = block_of(seed, 0, 1)
    helped = start is not None and len(start) > 0
    size = _hits(spread, aim) if levels.doubts and not helped else len(Z) / OF_CHAIN
    proposals = Proposals.of(Z, weights, size, random)
    if spread.doubts and not levels.doubts:
        proposals = proposals.also_around(_heaviest_points(spread, aim))
    rough, copies = _rough(problem, aim, seed, proposals, seen)
    spent += copies
    if rough > ROUGH:
        doubt = (
            f"{rough:.0%} of the harmful rows are single ones, with none beside them, as noise "
            "makes them: only mc sees them all"
        )
        known, facts = spread if levels.doubts else levels, {"single": rough, "reached": 0.0}
        return replace(known, evaluations=spent, doubts=(doubt, *known.doubts), facts=facts)
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
    return _drawn(problem, aim, seed, proposals, spent, (levels, spread), helped, rough)


def _rough(
    problem: Problem, aim: Aim, seed: int, proposals: Proposals, points: tuple[Float, Float]
) -> tuple[float, int]:
    """Return the share of weighted points of the event without any other close to them.

    Where harm has noise of its own, as that of perception, it happens at single points; rows drawn
    around them meet the event no more often than elsewhere.

    Returns:
        The share; and the number of evaluations that it took.
    """
    Z, weights = points
    tried = min(TRIED, aim.budget // (10 * COPIES)) if len(Z) else 0
    if tried < 1:
        return 0.0, 0
    random = block_of(seed, 0, 3)
    d = Z.shape[1]
    chosen = Z[random.choice(len(Z), tried, p=weights / weights.sum())]
    moves = BESIDE * random.standard_normal((tried, COPIES, d)) @ proposals.kernels.factor.T
    copies = (chosen[:, np.newaxis] + moves).reshape(-1, d)
    good = problem.feasible(copies)
    inside = np.zeros(len(copies), np.bool_)
    inside[good] = problem.evaluate(copies[good], aim.least)[:, SCORE] >= aim.threshold
    has_copies = good.reshape(tried, COPIES).any(axis=1)
    single = has_copies & ~inside.reshape(tried, COPIES).any(axis=1)
    return float(single.sum() / max(has_copies.sum(), 1)), int(good.sum())


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
    """Return the points of the event that are likeliest on the road, `SINGLE` at most."""
    order = np.argsort(-spread.weights * spread.there(aim.threshold), kind="stable")
    found: Float = spread.Z[order[: min(SINGLE, int(spread.there(aim.threshold).sum()))]]
    return found


def _drawn(
    problem: Problem,
    aim: Aim,
    seed: int,
    proposals: Proposals,
    spent: int,
    before: tuple[Weighted, Weighted],
    helped: bool,
    rough: float,
) -> Weighted:
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
            result = _judged(
                _result(problem, kept, drawn, spent + used), aim, before, helped, rough
            )
            if not result.doubts and result.probability(aim.threshold).precision <= aim.precision:
                break
    result = _judged(_result(problem, kept, drawn, spent + used), aim, before, helped, rough)
    components = float(len(proposals.fitted.weights))
    return replace(result, facts={"components": components, **result.facts})


def _judged(
    result: Weighted,
    aim: Aim,
    before: tuple[Weighted, Weighted],
    helped: bool,
    rough: float,
) -> Weighted:
    """Return a result with its doubts, its facts, and what regions nobody has seen may add.

    Subset simulation and exploration are heard in this order; who is not in doubt and agrees with
    the result bounds what it has not seen.
    """
    levels, spread = before
    sure = [one for one in before if not one.doubts]
    found = [_beside(result, aim, known, helped, rough) for known in sure]
    if not found:
        known = spread if len(spread.Z) and not helped else levels
        found = [_beside(result, aim, known, helped, rough)]
    best = next((one for one in found if not one.doubts), found[0])
    return replace(best, facts={**best.facts, "spread": float(spread.rows)})


def _beside(result: Weighted, aim: Aim, known: Weighted, helped: bool, rough: float) -> Weighted:
    """Return a result with the doubts and facts that it has beside what was known before."""
    low, share, high = result.share
    result = replace(result, share=(low, share, high / (1.0 - _unseen(known, aim, rough))))
    facts = {
        "effective_hits": _hits(result, aim),
        "heaviest": _heaviest(result, aim),
        "single": rough,
        "reached": known.facts.get("reached", 1.0),
    }
    if "explored_hits" in known.facts:
        facts["explored_hits"] = known.facts["explored_hits"]
    return replace(result, doubts=tuple(_doubts(result, aim, known, helped)), facts=facts)


def _hits(result: Weighted, aim: Aim) -> float:
    """Return the effective number of rows in which the event happens."""
    return result.hits(result.there(aim.threshold))


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
    hits, heaviest = _hits(result, aim), _heaviest(result, aim)
    found = result.probability(aim.threshold)
    if hits < FEWEST_HITS:
        yield (
            f"the effective number of harmful rows is {hits:.0f}, and {FEWEST_HITS:.0f} are needed"
        )
    elif heaviest > HEAVIEST:
        yield f"one row makes {heaviest:.0%} of the estimate: a region was missed"
    expected = known.probability(aim.threshold)
    before = "subset simulation" if known.repetitions else "exploration"
    more = not helped and found.low > expected.high  # what a search found may be missing there
    if not known.doubts and (more or expected.low > found.high):
        yield (
            f"{before} says {expected.low:.2g} to {expected.high:.2g}, and importance "
            f"sampling {found.low:.2g} to {found.high:.2g}"
        )


def _unseen(known: Weighted, aim: Aim, rough: float) -> float:
    """Return the share of the event's probability that proposals may not cover.

    Subset simulation that knows the probability to a relative standard error c has seen as much of
    it as n = 1 / c² independent harmful rows show; exploration, as much as its effective harmful
    rows do. Of n rows none is in a region that nobody has seen, and the share ``rough`` at single
    points: the upper end of the exact interval (Clopper and Pearson, 95 %), 3 / n if it is 0.
    """
    if known.repetitions:
        sums = known.sums(known.there(aim.threshold))
        if len(sums) < 2 or not sums.mean() > 0.0:
            return MOST_UNSEEN
        error = float(sums.std(ddof=1) / sums.mean())
        n = len(sums) / max(error * error, 1e-12)
    else:
        n = _hits(known, aim)
    missed = min(rough * n, n)
    if n - missed <= 0.0:
        return MOST_UNSEEN
    return min(float(scipy.special.betaincinv(missed + 1.0, n - missed, 0.95)), MOST_UNSEEN)


def _result(
    problem: Problem, kept: list[tuple[Float, Float, Float]], drawn: int, spent: int
) -> Weighted:
    Z, found, weight = (np.concatenate(one) for one in zip(*kept, strict=True))
    low, share, high = problem.share
    factor = 1.0 / (drawn * share)
    return Weighted(
        Z, found, weight * factor, drawn, np.empty(0, np.int64), 0, factor / DEFENSIVE,
        (1.0 / high, 1.0 / share, 1.0 / low), spent,
    )  # fmt: skip
