"""Pass/fail criteria for a preventability map."""

from collections.abc import Sequence
from dataclasses import replace
from math import isnan

from bridgegen.cli.verdict.conditions import Conditions
from bridgegen.cli.verdict.fail_if import Outcome, Verdict
from bridgegen.cli.verdict.junit import Suite, case_of, write_junit
from bridgegen.jobs.preventability import PreventabilityMap

FIGURES = {
    "avoided": "cells in which the driver does not collide",
    "preventable": "cells in which it collides, and a model does not",
    "unpreventable": "cells in which it collides, and so do all models",
    "not_applicable": "cells whose values break a constraint, or whose traffic is implausible",
    "no_result": "cells in which the driver failed, or a model that decides",
    "avoided_share": "avoided / cells that apply and have a result",
    "preventable_share": "preventable / the same",
    "unpreventable_share": "unpreventable / the same",
}
"""The figures of a map, for each driver, that ``--fail-if`` accepts."""

_OUTCOMES = ("avoided", "preventable", "unpreventable")


class MapCriteria(Conditions):
    """The criteria for a map; a condition is applied to each driver under test."""

    known = FIGURES

    def judge(self, result: PreventabilityMap) -> tuple[Outcome, ...]:
        """Apply the criteria to each driver of a map, and write the JUnit XML if requested.

        Without criteria and JUnit XML there are no outcomes. Otherwise the first of each driver is
        whether any cell has a result.
        """
        if not self.conditions and self.junit is None:
            return ()
        by_driver = {name: self._of(result, name) for name in result.drivers}
        if self.junit is not None:
            write_junit(self.junit, [_suite(result, *one) for one in by_driver.items()])
        return tuple(one for some in by_driver.values() for one in some)

    def _of(self, result: PreventabilityMap, driver: str) -> list[Outcome]:
        figures = figures_of(result, driver)
        counts = ((name, count) for name, count in figures.items() if not name.endswith("_share"))
        details = ", ".join(f"{name} {count:.0f}" for name, count in counts)
        verdict: Verdict = "unknown" if isnan(figures["avoided"]) else "passed"
        found = [Outcome(f"{driver}: the map has results", verdict, details)]
        for one in self.conditions:
            outcome = one.judge(figures)
            found.append(replace(outcome, test=f"{driver}: {outcome.test}"))
        return found


def figures_of(result: PreventabilityMap, driver: str) -> dict[str, float]:
    """Return FIGURES of a driver; NaN is an unknown one: of outcomes, where no cell has any."""
    known = result.figures(driver)
    judged = any(known[name] for name in _OUTCOMES)
    return {
        name: known[name] if judged or name in ("not_applicable", "no_result") else float("nan")
        for name in FIGURES
    }


def _suite(result: PreventabilityMap, driver: str, outcomes: Sequence[Outcome]) -> Suite:
    """Return the tests of a driver, with the figures of the map as properties."""
    name = result.scenario.name
    facts = {"scenario": name, "ego": driver, "models": ", ".join(result.models)}
    for axis, unit, values in zip(
        result.grid.names, result.grid.units, result.grid.values, strict=True
    ):
        facts[f"axis {axis}"] = f"{values[0]:.6g} to {values[-1]:.6g} {unit}, {len(values)} values"
    facts |= {key: f"{value:.6g}" for key, value in figures_of(result, driver).items()}
    facts |= {"command": result.command, "page": str(result.page)}
    group = f"bridgegen.{name}.{driver.replace('.', '_')}"
    return Suite(f"{name} preventability", [case_of(group, one) for one in outcomes], facts)
