"""Pass/fail criteria for a job's result; a condition is applied to each of its parts."""

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

from bridgegen.cli.verdict.conditions import Conditions
from bridgegen.cli.verdict.fail_if import Outcome
from bridgegen.cli.verdict.junit import Suite, case_of, write_junit
from bridgegen.jobs.frame import Judged, JudgedResult


class JobCriteria(Conditions):
    """The criteria for a job; its `bridgegen.jobs.frame.Job` has the figures."""

    known = ()
    always: ClassVar[bool] = False

    def judge(self, result: JudgedResult) -> tuple[Outcome, ...]:
        """Apply the criteria to each part of a result, and write the JUnit XML if requested.

        Without criteria and JUnit XML there are no outcomes; if `always`, those that do not pass.
        Otherwise the first of each part is whether its figures can be believed, but where a
        condition says how much may be missing.
        """
        is_asked = bool(self.conditions) or self.junit is not None
        if not is_asked and not self.always:
            return ()
        parts = [(judged, self._of(judged)) for judged in result.judged()]
        if self.junit is not None:
            write_junit(self.junit, [_suite(*part) for part in parts])
        found = tuple(outcome for _, some in parts for outcome in some)
        return (
            found
            if is_asked
            else tuple(outcome for outcome in found if outcome.verdict != "passed")
        )

    def _of(self, part: Judged) -> list[Outcome]:
        head = f"{part.of}: " if part.of else ""
        verdict = "passed" if part.holds else "unknown"
        outcomes = [Outcome(f"{head}{part.test}", verdict, part.details)]  # type: ignore[arg-type]
        if any(part.missing in condition.figures for condition in self.conditions):
            outcomes = []
        for condition in self.conditions:
            outcome = condition.judge(part.figures)
            outcomes.append(replace(outcome, test=f"{head}{outcome.test}"))
        return outcomes


class JobVerdict(JobCriteria):
    """The criteria for a job whose result may be worth nothing: that is judged without any, too."""

    always = True


def _suite(part: Judged, outcomes: Sequence[Outcome]) -> Suite:
    """Return the tests of a part, with its facts and figures as properties."""
    facts = {**part.facts, **{key: f"{value:.6g}" for key, value in part.figures.items()}}
    return Suite(part.suite, [case_of(part.group, outcome) for outcome in outcomes], facts)
