"""Pass/fail criteria for a confirmation."""

from collections.abc import Sequence
from pathlib import Path

from bridgegen.cli.verdict.conditions import Conditions
from bridgegen.cli.verdict.fail_if import Outcome
from bridgegen.cli.verdict.junit import Case, Suite, case_of, write_junit
from bridgegen.jobs.search.confirm import RunConfirmation
from bridgegen.results.confirmation.record import Scenario

FIGURES = {
    "confirmed": "scenarios that are critical there, too / scenarios that ran there",
    "lost": "scenarios that ran there and are not critical",
    "not_run": "scenarios that failed there",
    "scenarios": "scenarios that were requested",
    "harm_change": "the largest difference of harm",
    "d_min_change": "the largest difference of d_min [m]",
    "v_d_change": "the largest difference of v_d [m/s]",
    "contact_change": "the largest difference of the time of the first contact [s]",
}
"""The figures of a confirmation that ``--fail-if`` accepts."""

_OF_THE_LOST = ("confirmed", "lost")
"""Figures that scenarios fail which are not confirmed; those that failed there fail ``not_run``."""


class ConfirmationCriteria(Conditions):
    """The criteria for a confirmation."""

    known = FIGURES

    def judge(self, found: RunConfirmation) -> tuple[Outcome, ...]:
        """Apply the criteria to a confirmation, and write the JUnit XML if requested.

        Without criteria and JUnit XML there are no outcomes. Otherwise the first outcome is
        whether any scenario ran.
        """
        if not self.conditions and self.junit is None:
            return ()
        s = found.summary
        ran = Outcome(
            f"scenarios run in {found.record.simulator}",
            "passed" if s.ran else "unknown",
            f"{s.confirmed} confirmed, {s.lost} not, {s.not_run} not run",
        )
        figures = figures_of(found)
        outcomes = (ran, *(condition.judge(figures) for condition in self.conditions))
        if self.junit is not None:
            write_junit(self.junit, _suites(found, outcomes))
        return outcomes


def figures_of(found: RunConfirmation) -> dict[str, float]:
    """Return FIGURES of a confirmation; NaN is an unknown figure."""
    s, nan = found.summary, float("nan")
    unknown = nan if not s.ran else 0.0  # if all ran and none has it, nothing changed
    return {
        "confirmed": nan if s.share is None else s.share,
        "lost": s.lost if s.ran else nan,
        "not_run": s.not_run,
        "scenarios": s.scenarios,
        "harm_change": unknown if s.harm.max is None else s.harm.max,
        "d_min_change": unknown if s.d_min.max is None else s.d_min.max,
        "v_d_change": unknown if s.v_d.max is None else s.v_d.max,
        "contact_change": unknown if s.contact.max is None else s.contact.max,
    }


def _suites(found: RunConfirmation, outcomes: Sequence[Outcome]) -> list[Suite]:
    """Return the criteria as one suite, and each scenario as a test of another suite."""
    record = found.record
    name = Path(record.scenario).stem
    group = f"bridgegen.{name}.{record.simulator}"
    facts = {
        "run": str(found.folder),
        "scenario": record.scenario,
        "ego": record.ego,
        "simulator": record.label,
    } | {key: f"{value:.6g}" for key, value in figures_of(found).items()}
    broken = {
        figure for outcome in outcomes if outcome.verdict == "failed" for figure in outcome.figures
    }
    cases = [case_of(group, outcome) for outcome in outcomes]
    scenarios = [_case(scenario, group, broken) for scenario in found.scenarios]
    return [
        Suite(f"{name} in {record.simulator} criteria", cases, facts),
        Suite(f"{name} in {record.simulator}", scenarios),
    ]


def _case(scenario: Scenario, group: str, broken: set[str]) -> Case:
    """Return a scenario as a test, failed if it contributes to a failed criterion."""
    name = f"critical {scenario.name or f'evaluation {scenario.evaluation + 1}'}"
    if scenario.there is None:
        contributes = "not_run" in broken
        return Case(group, name, "failure" if contributes else None, "not run", scenario.failure)
    contributes = not scenario.there.critical and any(figure in broken for figure in _OF_THE_LOST)
    message = "confirmed" if scenario.there.critical else "not confirmed"
    return Case(group, name, "failure" if contributes else None, message, scenario.explanation)
