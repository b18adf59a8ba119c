"""Subset simulation: a rare event as a chain of events that are each likely given the last.

A pilot run chooses the levels and how far proposals go; repetitions then use these without change,
so that each is unbiased, and their spread says how sure the mean is.

Sources: Au and Beck, Probabilistic Engineering Mechanics 16 (2001) 263-277; Papaioannou, Betz,
Zwirglmaier and Straub, Probabilistic Engineering Mechanics 41 (2015) 89-103 (proposals); Botev and
Kroese, Statistics and Computing 22 (2012) 1-16 (fixed levels and numbers of copies are unbiased).
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.jobs.risk.estimators.exploration import SinglePoints, most_evaluations
from bridgegen.jobs.risk.estimators.problem import SCORE, Aim, Problem, block_of
from bridgegen.jobs.risk.estimators.proposals import OF_CHAIN, Proposals
from bridgegen.jobs.risk.estimators.weighted import Weighted

PASSING = 0.1
"""The share of each level that the next one begins with."""
PILOT = 1000  # points of the pilot run
ACCEPTED = 0.44  # share of proposals that the pilot run aims at
DEEPEST = 20  # levels, at most: a probability of 1e-20
STUCK = 0.01  # of a level at least must reach the next one
MOST_TIED = 0.5  # of a level's points at most may be in the next one
TOGETHER = 20  # repetitions that run side by side
# All repetitions have the same number. A last round of smaller ones, made of what was left of the
# budget and counted as much as the others, had 8 to 9 % of intervals that missed the truth.
POINTS, FEWEST_POINTS = 250, 25  # of a repetition; all have the same number
FEWEST_ROUNDS = 2  # so that the first one says what repetitions cost
MARGIN = 1.3  # of evaluations: repetitions take more or fewer
FEWEST_REPETITIONS, MOST_ERROR, LEAST_ACCEPTED = 10, 0.5, 0.03
"""Fewest repetitions that reach the event, largest relative standard error, and least share of
accepted moves for the interval to be believed."""
EXPLODES = "repetitions take far more evaluations than the pilot run: the levels do not mix"


@dataclass(frozen=True)
class Level:
    """A level of the chain.

    Attributes:
        score: its points reach it.
        scale: ``(d,)`` how far proposals go in the level's chains, 1 for independent ones.
    """

    score: float
    scale: Float


@dataclass(frozen=True)
class Pilot:
    """What a pilot run found.

    Attributes:
        levels: from the easiest one up to the aim, if that was reached.
        passing: the share of points that reached each level.
        accepted: the share of accepted proposals of each level.
        evaluations: that it took.
        reached: whether the last level is the aim.
    """

    levels: tuple[Level, ...]
    passing: tuple[float, ...]
    accepted: tuple[float, ...]
    evaluations: int
    reached: bool


class _OutOfBudget(Exception):
    """The next evaluations would exceed the limit.

    Attributes:
        evaluations: so far.
    """

    def __init__(self, evaluations: int) -> None:
        super().__init__(evaluations)
        self.evaluations = evaluations


class _Chains:
    """Chains of one level, of all repetitions side by side."""

    def __init__(self, problem: Problem, random: np.random.Generator, limit: int) -> None:
        self.problem, self.random, self.evaluations, self.limit = problem, random, 0, limit

    def evaluate(self, Z: Float) -> Float:
        """Evaluate points.

        Raises:
            _OutOfBudget: there are more of them than evaluations left.
        """
        if self.evaluations + len(Z) > self.limit:
            raise _OutOfBudget(self.evaluations)
        self.evaluations += len(Z)
        return self.problem.evaluate(Z)

    def start(self, count: int) -> tuple[Float, Float]:
        """Return ``count`` independent feasible points, and their outcomes."""
        parts: list[Float] = []
        have = 0
        while have < count:
            Z = self.random.standard_normal((max(count, 256), self.problem.dimensions))
            parts.append(Z[self.problem.feasible(Z)])
            have += len(parts[-1])
        Z = np.concatenate(parts)[:count]
        return Z, self.evaluate(Z)

    def step(self, Z: Float, found: Float, level: Level) -> tuple[Float, Float, Bool]:
        """Move points on by one proposal each; those that leave the level stay."""
        noise = self.random.standard_normal(Z.shape)
        # This proposal keeps the standard normal distribution, so that only the level decides on
        # acceptance.
        moved = np.sqrt(1.0 - level.scale**2) * Z + level.scale * noise
        # What breaks a constraint is rejected unevaluated: feasibility costs nothing, a simulation
        # does.
        good = self.problem.feasible(moved)
        at = np.flatnonzero(good)
        if at.size:
            outcome = self.evaluate(moved[at])
            inside = outcome[:, SCORE] >= level.score
            good[at[~inside]] = False
            Z, found = Z.copy(), found.copy()
            Z[at[inside]], found[at[inside]] = moved[at[inside]], outcome[inside]
        return Z, found, good

    def split(
        self, Z: Float, found: Float, owner: Int, times: float, level: Level
    ) -> tuple[Float, Float, Int]:
        """Make each point several of its level, ``times`` on average: itself, and its chain."""
        # Copies in a fixed number (generalised splitting, Botev and Kroese 2012): resampling
        # survivors to a constant number of points was 4 to 6 % too high, because the length of a
        # chain depends on the number of survivors.
        length = int(times) + (self.random.random(len(Z)) < times - int(times))
        parts, active = [(Z, found, owner)], np.arange(len(Z))
        for turn in range(1, int(length.max())):
            keep = length[active] > turn
            active, Z, found = active[keep], Z[keep], found[keep]
            Z, found, _ = self.step(Z, found, level)
            parts.append((Z, found, owner[active]))
        Z, found, owner = (np.concatenate(pair) for pair in zip(*parts, strict=True))
        return Z, found, owner


def pilot(problem: Problem, aim: Aim, seed: int) -> Pilot:
    """Choose levels up to the aim; or as far as a quarter of the budget suffices."""
    points = max(min(PILOT, aim.budget // 40), 1)
    chains = _Chains(problem, block_of(seed, 0), aim.budget // 4)
    Z, found = chains.start(points)
    levels: list[Level] = []
    passing: list[float] = []
    accepted: list[float] = []
    before, reached = -np.inf, False
    while len(levels) < DEEPEST:
        scores = found[:, SCORE]
        # Levels are chosen once, by the pilot run, and kept: adaptive ones are biased.
        level = min(_next_level(scores, before), aim.threshold)
        there = scores >= level
        share = float(there.mean())
        if share < STUCK or not level > before:
            break
        reached = level == aim.threshold
        passing.append(share)
        seeds, outcome = Z[there], found[there]
        scale = 0.6
        spread = seeds.std(axis=0)
        levels.append(Level(level, np.minimum(1.0, scale * spread)))
        if reached:
            break
        parts, results = [seeds], [outcome]
        have, took = len(seeds), []
        now, last = seeds, outcome
        for turn in range(1, 10 * points):
            if have >= points:
                break
            levels[-1] = Level(level, np.clip(scale * spread, 1e-6, 1.0))
            try:
                now, last, moved = chains.step(now, last, levels[-1])
            except _OutOfBudget:
                break
            took.append(float(moved.mean()))
            # Robbins and Monro: towards the aimed acceptance, by ever smaller steps.
            scale *= float(np.exp((took[-1] - ACCEPTED) / np.sqrt(turn)))
            parts.append(now)
            results.append(last)
            have += len(now)
        levels[-1] = Level(level, np.clip(scale * spread, 1e-6, 1.0))
        accepted.append(float(np.mean(took)) if took else 1.0)
        if have < points:
            break
        Z, found = np.concatenate(parts)[:points], np.concatenate(results)[:points]
        before = level
    return Pilot(tuple(levels), tuple(passing), tuple(accepted), chains.evaluations, reached)


def _next_level(scores: Float, before: float) -> float:
    """Return the score that a tenth of the points reaches; the next higher one where they tie."""
    ordered = np.sort(scores)
    level = float(ordered[len(ordered) - int(np.ceil(PASSING * len(ordered)))])
    if level > before and np.mean(scores >= level) <= MOST_TIED:
        return level
    higher = ordered[ordered > max(level, before)]
    return float(higher[0]) if higher.size else before


def repeat(
    problem: Problem, first: Pilot, points: int, count: int, random: np.random.Generator, limit: int
) -> tuple[Float, Float, Float, Int, int]:
    """Repeat a pilot run's chain with its levels as they are, ``count`` times side by side.

    Each point that reaches a level becomes as many points of it as the pilot run says that it takes
    to make up for those that do not, on average: itself, and what a chain from it visits.

    Returns:
        Points ``(M, d)``, outcomes, weights (their sum over a repetition estimates the probability
        of the first level), the number of each one's repetition; and the evaluations that it took.

    Raises:
        _OutOfBudget: there would be more than ``limit`` of these.
    """
    chains = _Chains(problem, random, limit)
    Z, found = chains.start(points * count)
    owner: Int = np.repeat(np.arange(count), points)
    weight = 1.0 / points
    kept: list[tuple[Float, Float, Float, Int]] = []
    for number, (level, passing) in enumerate(zip(first.levels, first.passing, strict=True)):
        there = found[:, SCORE] >= level.score
        if number:
            kept.append((Z[~there], found[~there], np.full((~there).sum(), weight), owner[~there]))
        Z, found, owner = Z[there], found[there], owner[there]
        if number == len(first.levels) - 1 or not len(Z):
            break
        weight *= passing
        Z, found, owner = chains.split(Z, found, owner, 1.0 / passing, level)
    kept.append((Z, found, np.full(len(Z), weight), owner))
    Z, found, weights, owner = (np.concatenate(pair) for pair in zip(*kept, strict=True))
    return Z, found, weights, owner, chains.evaluations


def estimate(problem: Problem, aim: Aim, seed: int) -> Weighted:
    """Simulate subsets, and look for single points among those of the event that were found.

    The pilot chooses levels, then repetitions until the precision or the budget is reached.
    """
    found = simulate(problem, replace(aim, budget=aim.budget - most_evaluations(aim)), seed)
    if found.doubts:
        return found
    there = found.scores >= aim.threshold
    Z, weights = found.Z[there], found.weights[there]
    around = Proposals.of(Z, weights, len(Z) / OF_CHAIN, block_of(seed, 0, 4)).kernels
    single = SinglePoints.of(problem, aim, seed, Z, weights, around)
    return replace(
        found,
        evaluations=found.evaluations + single.evaluations,
        doubts=(single.doubt,) if single.doubt else (),
        facts={**found.facts, "single": single.share},
    )


def simulate(problem: Problem, aim: Aim, seed: int) -> Weighted:
    """Run the pilot, then repetitions until the precision or the budget is reached."""
    first = pilot(problem, aim, seed)
    spent, rounds = first.evaluations, 0
    cost = 1.0 + sum(1.0 - value for value in first.passing[:-1])  # evaluations a point, expected
    affordable = (aim.budget - spent) / (MARGIN * cost * TOGETHER)
    points = int(affordable / max(FEWEST_ROUNDS, math.ceil(affordable / POINTS)))
    parts: list[tuple[Float, Float, Float, Int]] = []
    result = _result(problem, parts, 0, spent)
    while first.reached and points >= FEWEST_POINTS:
        limit = aim.budget - spent
        if MARGIN * cost * points * TOGETHER > limit:
            break
        # A stream for each round, so that a resumed estimate repeats the same rows from the ledger.
        random = block_of(seed, rounds + 1)
        try:
            Z, found, weights, owner, took = repeat(problem, first, points, TOGETHER, random, limit)
        except _OutOfBudget as error:
            return replace(result, evaluations=spent + error.evaluations, doubts=(EXPLODES,))
        rounds += 1
        kept = found[:, SCORE] >= aim.least
        number = owner[kept] + TOGETHER * (rounds - 1)
        parts.append((Z[kept], found[kept], weights[kept], number))
        spent += took
        # Costs grow with the estimate, so this makes rare estimates up to 4 % too high where the
        # budget allows two rounds.
        cost = max(cost, took / (points * TOGETHER))
        result = _result(problem, parts, TOGETHER * rounds, spent)
        if result.probability(aim.threshold).precision <= aim.precision:
            break
    sums = result.sums(result.there(aim.threshold))
    facts = {
        "levels": float(len(first.levels)),
        "repetitions": float(TOGETHER * rounds),
        "accepted": float(min(first.accepted, default=1.0)),
        "reached": float(first.reached),
        "reaching": float(np.mean(sums > 0.0)) if rounds else 0.0,
    }
    return replace(result, doubts=tuple(_doubts(first, aim, sums, facts)), facts=facts)


def _doubts(first: Pilot, aim: Aim, sums: Float, facts: dict[str, float]) -> Iterator[str]:
    if not first.reached:
        last = first.levels[-1].score if first.levels else 0.0
        yield (
            f"the levels end at a score of {last:.4g}, below {aim.threshold:g}: hardly any row "
            "comes nearer"
        )
    elif (reaching := int(np.sum(sums > 0.0))) < FEWEST_REPETITIONS:
        yield (
            f"{reaching} of {len(sums)} repetitions reach the event, and {FEWEST_REPETITIONS} are "
            "needed"
        )
    elif (error := sums.std(ddof=1) / sums.mean() / np.sqrt(len(sums))) > MOST_ERROR:
        yield (
            f"repetitions differ so much that the standard error is {error:.0%} of their mean, and "
            f"at most {MOST_ERROR:.0%} is believed: the levels do not mix"
        )
    elif facts["accepted"] < LEAST_ACCEPTED:
        yield (
            f"{facts['accepted']:.0%} of the proposals of a level are accepted, and "
            f"{LEAST_ACCEPTED:.0%} are needed"
        )


def _result(
    problem: Problem, parts: list[tuple[Float, Float, Float, Int]], count: int, spent: int
) -> Weighted:
    none = (
        np.empty((0, problem.dimensions)),
        np.empty((0, problem.columns)),
        np.empty(0),
        np.empty(0, np.int64),
    )
    Z, found, weights, owner = (
        np.concatenate(pair) for pair in zip(*(parts or [none]), strict=True)
    )
    share = weights / max(count, 1)
    # The interval allows for one more repetition like the largest: misses of Student's lie mostly
    # below the mean, which is the side that matters.
    largest = float(share.max(initial=0.0))
    return Weighted(Z, found, share, 0, owner, count, largest, (1.0, 1.0, 1.0), spent)
