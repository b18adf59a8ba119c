"""Pass/fail criteria for a job's result; a condition is applied to each of its parts."""

from collections.abc import Sequence
from dataclasses import replace

from bridgegen.cli.verdict.conditions import Conditions
from bridgegen.cli.verdict.fail_if import Outcome
from bridgegen.cli.verdict.junit import Suite, case_of, write_junit
from bridgegen.jobs.frame import Judged, JudgedResult


class JobCriteria(Conditions):
    """The criteria for a job; its `bridgegen.jobs.frame.Job` has the figures."""

    known = ()

    def judge(self, result: JudgedResult) -> tuple[Outcome, ...]:
        """Apply the criteria to each part of a result, and write the JUnit XML if requested.

        Without criteria and JUnit XML there are no outcomes. Otherwise the first of each part is
        whether its figures can be believed.
        """
        if not self.conditions and self.junit is None:
            return ()
        parts = [(one, self._of(one)) for one in result.judged()]
        if self.junit is not None:
            write_junit(self.junit, [_suite(*one) for one in parts])
        return tuple(one for _, some in parts for one in some)

    def _of(self, part: Judged) -> list[Outcome]:
        head = f"{part.of}: " if part.of else ""
        verdict = "passed" if part.holds else "unknown"
        outcomes = [Outcome(f"{head}{part.test}", verdict, part.details)]  # type: ignore[arg-type]
        for one in self.conditions:
            outcome = one.judge(part.figures)
            outcomes.append(replace(outcome, test=f"{head}{outcome.test}"))
        return outcomes


def _suite(part: Judged, outcomes: Sequence[Outcome]) -> Suite:
    """Return the tests of a part, with its facts and figures as properties."""
    facts = {**part.facts, **{key: f"{value:.6g}" for key, value in part.figures.items()}}
    return Suite(part.suite, [case_of(part.group, one) for one in outcomes], facts)
