"""Pass/fail criteria for a risk."""

from bridgegen.cli.verdict.conditions import Conditions
from bridgegen.cli.verdict.fail_if import Outcome, Verdict
from bridgegen.cli.verdict.junit import Suite, case_of, write_junit
from bridgegen.jobs.risk.outcomes import WORDS
from bridgegen.jobs.risk.result import Risk

_OF = {"": "probability of {} per encounter", "_upper": "it is below this, with 95 % confidence"}
FIGURES = {
    **{
        f"{name}{end}": text.format(words)
        for name, words in WORDS.items()
        for end, text in _OF.items()
    },
    **{f"{name}_per_hour": f"{words}, per hour" for name, words in WORDS.items()},
    **{f"{name}_per_km": f"{words}, per km" for name, words in WORDS.items()},
    "evaluations": "simulations",
}
"""The figures of a risk that ``--fail-if`` accepts."""


class RiskCriteria(Conditions):
    """The criteria for a risk."""

    known = FIGURES

    def judge(self, result: Risk) -> tuple[Outcome, ...]:
        """Apply the criteria to a risk, and write the JUnit XML if requested.

        Without criteria and JUnit XML there are no outcomes. Otherwise the first is whether the
        aimed event's interval is believed.
        """
        if not self.conditions and self.junit is None:
            return ()
        figures = figures_of(result)
        verdict: Verdict = "passed" if result.believed else "unknown"
        doubt = result.findings[result.event].doubt
        details = doubt or f"method {result.estimated.method}"
        found = [Outcome("the interval is believed", verdict, details)]
        found += [one.judge(figures) for one in self.conditions]
        if self.junit is not None:
            write_junit(self.junit, [_suite(result, found)])
        return tuple(found)


def figures_of(result: Risk) -> dict[str, float]:
    """Return FIGURES of a risk; NaN is one that is not known."""
    found = {"evaluations": float(result.weighted.evaluations)}
    for name, one in result.findings.items():
        p, nan = one.probability, float("nan")
        found[name] = nan if p is None else p.estimate
        found[f"{name}_upper"] = nan if p is None else p.upper
        for unit, words in (("h", "hour"), ("km", "km")):
            rate = result.rate(name, unit)
            found[f"{name}_per_{words}"] = nan if rate is None else rate.estimate
    return {name: found[name] for name in FIGURES}


def _suite(result: Risk, outcomes: list[Outcome]) -> Suite:
    name = result.exposure.scenario.name
    facts = {"scenario": name, "ego": result.driver, "method": result.estimated.method}
    facts |= {key: f"{value:.6g}" for key, value in figures_of(result).items()}
    facts |= {"command": result.command}
    group = f"bridgegen.{name}.{result.driver.replace('.', '_')}"
    return Suite(f"{name} risk", [case_of(group, one) for one in outcomes], facts)
