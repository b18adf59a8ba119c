"""auto: Monte Carlo where it suffices, else importance sampling, else subset simulation.

A first few thousand rows decide, as they happen on the road. Where their share of harmful ones lets
Monte Carlo reach the precision within the budget, it is taken: it assumes nothing. Otherwise
importance sampling; if its result is in doubt, subset simulation; if that is, too, or if it lies
below what importance sampling has shown at least, what is left of the budget is counted.
"""

from dataclasses import replace

from bridgegen.base.arrays import Float
from bridgegen.jobs.risk.estimators import importance, monte_carlo, subset
from bridgegen.jobs.risk.estimators.problem import Aim, Problem
from bridgegen.jobs.risk.estimators.weighted import Weighted

LOOK = 2000
"""Number of rows that decide, or a twentieth of the budget."""
FEWEST = 10  # harmful rows among them, to know roughly how many it takes
FIRST_SHARE = 0.7  # of the budget, for importance sampling
SECOND_SHARE = 0.6  # of what is left then, for subset simulation
_NORMAL = 1.96


def estimate(
    problem: Problem, aim: Aim, seed: int, start: Float | None = None
) -> tuple[str, str, Weighted]:
    """Estimate by the method that suits.

    Returns:
        The method's name; why it was taken; and the result.
    """
    look = max(min(LOOK, aim.budget // 20), 1)
    first = monte_carlo.estimate(problem, replace(aim, budget=look, precision=0.0), seed)
    hits = int(first.there(aim.threshold).sum())
    wanted = aim.precision or 0.05
    # The binomial's: rows for a relative error of `wanted` at 95 %.
    needed = (_NORMAL / wanted) ** 2 * (look / hits - 1.0) if hits else float("inf")
    if hits >= FEWEST and needed <= aim.budget - look:
        return (
            "mc",
            f"{hits} of {look} rows are harmful, so counting suffices",
            _rest(problem, aim, seed, look),
        )
    why = f"{hits} of {look} rows are harmful, too few to count"
    spent = look
    part = replace(aim, budget=int(FIRST_SHARE * (aim.budget - spent)))
    found = importance.estimate(problem, part, seed, start)
    spent += found.evaluations
    if not found.doubts:
        return "importance", why, replace(found, evaluations=spent, road=first.road)
    doubt = found.doubts[0]
    if found.facts.get("reached", 1.0):
        least = found.probability(aim.threshold).low
        part = replace(aim, budget=int(SECOND_SHARE * (aim.budget - spent)))
        found = subset.estimate(problem, part, seed + 1)
        spent += found.evaluations
        # Subset simulation is not believed below what importance sampling has shown at least.
        if not found.doubts and found.probability(aim.threshold).high >= least:
            why = f"{why}, and importance sampling is in doubt ({doubt})"
            return "subset", why, replace(found, evaluations=spent, road=first.road)
    return (
        "mc",
        f"{why}, and other methods are in doubt ({doubt})",
        _rest(problem, aim, seed, spent),
    )


def _rest(problem: Problem, aim: Aim, seed: int, spent: int) -> Weighted:
    """Count rows with what is left of the budget."""
    left = replace(aim, budget=max(aim.budget - spent, 1))
    found = monte_carlo.estimate(problem, left, seed + 1)
    return replace(found, evaluations=found.evaluations + spent)
