"""How things stand: a verdict for each scenario and driver, and failures over versions."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

from bridgegen.jobs.dashboard.modes import OpenMode
from bridgegen.jobs.dashboard.results import Result, current, in_order
from bridgegen.pages.templates import when

Verdict = Literal["fails", "no failure found", "not judged", "never tried"]


@dataclass(frozen=True)
class Standing:
    """How a driver stands in a scenario.

    Attributes:
        verdict: of the current results.
        modes: that fail now, the gravest first; none where only random draws fail.
        results: the current ones, the latest first.
    """

    verdict: Verdict
    modes: tuple[OpenMode, ...] = ()
    results: tuple[Result, ...] = ()

    @property
    def worst(self) -> Result | None:
        """The result that a reader looks at first: of the gravest mode, else the latest."""
        some = self.modes[0].results if self.modes else self.results
        return some[0] if some else None


def standings(
    results: Iterable[Result], failing: Iterable[OpenMode]
) -> dict[tuple[str, str], Standing]:
    """Return how drivers, by name, stand in the scenarios that they were tried in.

    A run that counts only what another driver avoids finds no verdict but failures.

    Args:
        results: of the project.
        failing: the failure modes of its current results.
    """
    held: dict[tuple[str, str], list[Result]] = {}
    for result in current(results):
        held.setdefault((result.scenario, result.driver.name), []).insert(0, result)
    modes: dict[tuple[str, str], list[OpenMode]] = {}
    for mode in sorted(failing, key=lambda mode: (-mode.severity, -mode.count, mode.key)):
        modes.setdefault((mode.key.scenario, mode.key.driver), []).append(mode)
    found = {}
    for key, some in held.items():
        verdict: Verdict = "no failure found"
        if key in modes or any(map(is_rare, some)):
            verdict = "fails"
        elif any(
            result.unjudged or not result.finished or not result.evaluations for result in some
        ) or all(result.kind == "difference" for result in some):
            verdict = "not judged"
        found[key] = Standing(verdict, tuple(modes.get(key, ())), tuple(some))
    return found


def is_rare(result: Result) -> bool:
    """Return whether a run fails in its fresh random draws alone: it has no failure mode then."""
    return not result.failures and result.space is not None and result.space.harmful > 0


@dataclass(frozen=True)
class Step:
    """The results of one version of a driver; of one day where the version is not known.

    Attributes:
        name: the version, or the day.
        time: of the first result [s since 1970].
        modes: number of failure modes.
        failing: number of scenarios with one.
        scenarios: number of all.
    """

    name: str
    time: float
    modes: int
    failing: int
    scenarios: int


def history(results: Sequence[Result]) -> dict[str, list[Step]]:
    """Return the versions of each driver in the order of their first results; what ended counts."""
    held: dict[str, dict[str, list[Result]]] = {}
    for result in in_order(results):
        if result.finished and not result.unjudged:
            name = result.driver.version or when(result.time)[:10]
            held.setdefault(result.driver.name, {}).setdefault(name, []).append(result)
    return {
        driver: [
            Step(
                name,
                some[0].time,
                len({failure.key for result in some for failure in result.failures}),
                len({result.scenario for result in some if result.failures}),
                len({result.scenario for result in some}),
            )
            for name, some in steps.items()
        ]
        for driver, steps in sorted(held.items())
    }
