"""The methods by name."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from bridgegen.base.arrays import Float
from bridgegen.base.errors import UnknownNameError
from bridgegen.jobs.risk.estimators import automatic, importance, monte_carlo, stratified, subset
from bridgegen.jobs.risk.estimators.problem import Aim, Problem
from bridgegen.jobs.risk.estimators.weighted import Weighted

AUTO = "auto"
METHODS: Mapping[str, str] = {
    AUTO: "Monte Carlo where it suffices, else importance sampling, else subset simulation.",
    "mc": "Rows as they happen, counted. Exact, and for rare harm slow.",
    "subset": "A chain of ever more harmful levels; for rare harm, in many dimensions.",
    "importance": "Rows drawn where subset simulation, or a search, found harm, and weighted.",
    "stratified": "More rows from the rare ends of the distribution; in few dimensions.",
}
"""By name: a description."""


@dataclass(frozen=True)
class Estimated:
    """The method that was used, why, and what it found."""

    method: str
    why: str
    weighted: Weighted


def require(name: str) -> None:
    """Check that there is a method of that name.

    Raises:
        UnknownNameError: there is none.
    """
    if name not in METHODS:
        raise UnknownNameError("method", name, METHODS)


def estimate(name: str, problem: Problem, aim: Aim, seed: int, start: Float | None) -> Estimated:
    """Estimate by a method.

    Args:
        name: one of ``METHODS``.
        problem: the experiment.
        aim: the event.
        seed: of all random numbers.
        start: points of the event that importance sampling may use.
    """
    if name == AUTO:
        return Estimated(*automatic.estimate(problem, aim, seed, start))
    if name == "importance":
        return Estimated(name, "asked for", importance.estimate(problem, aim, seed, start))
    plain: Mapping[str, Callable[[Problem, Aim, int], Weighted]] = {
        "mc": monte_carlo.estimate, "subset": subset.estimate, "stratified": stratified.estimate,
    }  # fmt: skip
    return Estimated(name, "asked for", plain[name](problem, aim, seed))
