"""Is enough of what a run found so elsewhere? Criteria held against a confirmation."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from bridgegen.campaign.confirm import RunConfirmation
from bridgegen.confirmation.schema import Scenario
from bridgegen.verdict.criteria import Criterion, Outcome, read_criteria
from bridgegen.verdict.junit import Case, Suite, case_of, refuse_junit, write_junit

FIGURES = {
    "confirmed": "those that are critical there, too / those that ran there",
    "lost": "those that ran there and are not critical",
    "not_run": "those that failed there",
    "scenarios": "all that were asked for",
    "harm_change": "the largest difference of harm",
    "d_min_change": "the largest difference of d_min [m]",
    "v_d_change": "the largest difference of v_d [m/s]",
    "contact_change": "the largest difference of the time of the first contact [s]",
}
"""What ``--fail-if`` can name of a confirmation."""

_OF_THE_LOST = ("confirmed", "lost")
"""Scenarios that are not confirmed are to blame for these; for ``not_run`` those that failed."""


@dataclass(frozen=True)
class ConfirmationGate:
    """What a confirmation must keep, read and checked before it begins.

    Attributes:
        criteria: each fails it if it holds.
        junit: where the JUnit XML goes, if it is wanted.
    """

    criteria: tuple[Criterion, ...]
    junit: Path | None

    @classmethod
    def read(cls, texts: Sequence[str], junit: Path | None) -> "ConfirmationGate":
        """Read the criteria.

        Args:
            texts: as `read_criteria` has them, of FIGURES.
            junit: a new file, or an earlier JUnit XML.

        Raises:
            InputError: no criterion, or an unknown figure.
            StorageError: no JUnit XML can be written there.
        """
        gate = cls(read_criteria(texts, FIGURES), junit)
        if junit is not None:
            refuse_junit(junit)
        return gate

    def judge(self, found: RunConfirmation) -> tuple[Outcome, ...]:
        """Hold the criteria against a confirmation, and write the JUnit XML if it is wanted.

        Nothing is judged where nothing is asked for. Otherwise the first outcome is whether
        anything ran: where nothing did, nothing is proved.
        """
        if not self.criteria and self.junit is None:
            return ()
        s = found.summary
        ran = Outcome(
            f"scenarios run in {found.record.simulator}",
            "passed" if s.ran else "unknown",
            f"{s.confirmed} confirmed, {s.lost} not, {s.not_run} not run",
        )
        figures = figures_of(found)
        outcomes = (ran, *(one.judge(figures) for one in self.criteria))
        if self.junit is not None:
            write_junit(self.junit, _suites(found, outcomes))
        return outcomes


def figures_of(found: RunConfirmation) -> dict[str, float]:
    """Return FIGURES of a confirmation; NaN is what nobody knows."""
    s, nan = found.summary, float("nan")
    unknown = nan if not s.ran else 0.0  # where all ran and none has it, nothing changed
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
    """Return the criteria as one suite, and each scenario as a test in another one."""
    record = found.record
    name = Path(record.scenario).stem
    group = f"bridgegen.{name}.{record.simulator}"
    facts = {
        "run": str(found.folder),
        "scenario": record.scenario,
        "ego": record.ego,
        "simulator": record.label,
    } | {key: f"{value:.6g}" for key, value in figures_of(found).items()}
    broken = {figure for one in outcomes if one.verdict == "failed" for figure in one.figures}
    cases = [case_of(group, one) for one in outcomes]
    scenarios = [_case(one, group, broken) for one in found.scenarios]
    return [
        Suite(f"{name} in {record.simulator} criteria", cases, facts),
        Suite(f"{name} in {record.simulator}", scenarios),
    ]


def _case(one: Scenario, group: str, broken: set[str]) -> Case:
    """Return a scenario as a test, failed if it is to blame for a criterion."""
    name = f"critical {one.name or f'evaluation {one.evaluation + 1}'}"
    if one.there is None:
        blamed = "not_run" in broken
        return Case(group, name, "failure" if blamed else None, "not run", one.failure)
    blamed = not one.there.critical and any(figure in broken for figure in _OF_THE_LOST)
    message = "confirmed" if one.there.critical else "not confirmed"
    return Case(group, name, "failure" if blamed else None, message, one.explanation)
