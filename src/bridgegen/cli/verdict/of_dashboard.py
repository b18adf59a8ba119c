"""Pass/fail criteria for the dashboard of a project."""

from bridgegen.cli.verdict.conditions import Conditions
from bridgegen.cli.verdict.fail_if import Outcome
from bridgegen.jobs.dashboard import Dashboard

FIGURES = {
    "new": "failure modes of current results with the status new, or with none",
    "known": "failure modes of current results with the status known",
    "accepted": "failure modes of current results with the status accepted",
    "fixed": "failure modes with the status fixed that no current result has",
    "regressions": "failure modes with the status fixed that a current result has",
    "failing": "all failure modes of current results",
    "worst_severity": "the worst probability of MAIS3+ of these",
    "requirements": "requirements",
    "violated_requirements": "requirements that a driver violates",
    "untested_requirements": "requirements that no scenario tests",
    "scenarios_without_requirement": "scenarios that test no requirement",
    "runs": "runs",
    "suites": "suites",
    "maps": "preventability maps",
    "comparisons": "comparisons of algorithms",
    "scenarios": "scenarios that runs and suites test",
    "drivers": "drivers, each version by itself",
    "evaluations": "evaluations of runs and variations of suites",
    "problems": "folders and scenarios that cannot be read",
}
"""The figures of a dashboard that ``--fail-if`` accepts."""


class DashboardCriteria(Conditions):
    """The criteria for a dashboard; without conditions, nothing fails it."""

    known = FIGURES

    def judge(self, found: Dashboard) -> tuple[Outcome, ...]:
        """Apply the criteria to a dashboard."""
        return tuple(one.judge(found.figures) for one in self.conditions)
