"""Pass/fail criteria for a run, reported as JUnit XML and as an exit status.

The XML contains a failed test if and only if the exit status is a failure.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from bridgegen.assess.cause import CAUSES
from bridgegen.assess.criteria import CriterionSummary
from bridgegen.base.errors import InputError, StorageError
from bridgegen.cli.verdict.fail_if import (
    FailCondition,
    Outcome,
    Verdict,
    read_conditions,
    unless_judged,
    words_of,
)
from bridgegen.cli.verdict.junit import Case, Suite, case_of, refuse_junit, writable, write_junit
from bridgegen.cli.verdict.needs import MARK, write_needs
from bridgegen.drivers import STORYBOARD
from bridgegen.jobs.search.exported import Facts, ParameterValue, Quantity, read_facts
from bridgegen.jobs.search.run import Run
from bridgegen.scenario.language.criteria import PREFIX, read_criterion
from bridgegen.search.triage.record import NOT_JUDGED
from bridgegen.search.triage.words import covered_in_words, mode_in_words

_CAUSES = {cause.label.replace(" ", "_"): cause.label for cause in CAUSES}
"""Labels of root causes by the figure's name."""

_TRIAGE = {
    "modes": "failure modes",
    "robust": "failure modes that persist in at least half of the neighbours",
    "worst_severity": "the worst probability of MAIS3+ in a failure mode; 0 if there is none",
    "harmful.upper": "upper end of the 95 % interval of the harmful share of the space",
}

FIGURES = {
    "r_critic": "critical evaluations / all evaluations",
    "critical": "critical evaluations",
    "evaluations": "evaluations, failed ones included",
    "failed": "evaluations without a result",
    "first": "evaluations until the first critical one; infinite if there is none",
    "fiftieth": "evaluations until the 50th critical one; infinite if there is none",
    "d_min_best": "the smallest d_min [m]",
    "d_min_median": "the median of d_min [m]",
    "v_d_best": "the largest v_d [m/s]",
    "v_d_median": "the median of v_d [m/s]",
    "stuck": "evaluations whose ego stands for no reason before the end of its route",
    "seconds": "duration of the search without compilation [s]",
    **dict.fromkeys(_CAUSES, "critical scenarios of this cause (quick: one replay)"),
    **_TRIAGE,
}
"""The figures of a run that ``--fail-if`` accepts."""

_OF_THE_RUN = ("evaluations", "failed", "stuck", "seconds", "harmful.upper")
"""Figures to which no single critical scenario contributes."""


_NOT_OF_THE_EGO = ("evaluations", "failed", "seconds")


@dataclass(frozen=True)
class PassFailCriteria:
    """The criteria for a run, checked before it starts.

    Attributes:
        conditions: each fails the run if it holds.
        junit: path of the JUnit XML, or None.
        needs: path of the needs.json of the pass criteria, or None.
    """

    conditions: tuple[FailCondition, ...]
    junit: Path | None
    needs: Path | None = None

    @classmethod
    def read(
        cls,
        texts: Sequence[str],
        junit: Path | None,
        *,
        causes: bool = True,
        criteria: Sequence[str] = (),
        needs: Path | None = None,
    ) -> Self:
        """Read the criteria.

        Args:
            texts: see `read_conditions`; their figures are FIGURES.
            junit: a new file, or an earlier JUnit XML.
            causes: whether the run determines causes.
            criteria: the names of the margins of its pass criteria, figures too: each is the
                number of evaluations that violate it.
            needs: a new file, or an earlier needs.json.

        Raises:
            InputError: a text is not a condition; a figure is unknown, or is a cause although the
                run determines none.
            StorageError: the JUnit XML, or the needs.json, cannot be written.
        """
        found = cls(read_conditions(texts, (*FIGURES, *criteria)), junit, needs)
        if not causes and (named := sorted(found.figures & _CAUSES.keys())):
            raise InputError(
                f"--fail-if names {', '.join(named)}, but this run does not determine causes"
            )
        if junit is not None:
            refuse_junit(junit)
        if needs is not None:
            writable(needs, MARK, "needs.json")
        return found

    @classmethod
    def of_run(
        cls, texts: Sequence[str], junit: Path | None, folder: Path, needs: Path | None = None
    ) -> Self:
        """Read the criteria for an existing run; see ``read``."""
        if not texts and junit is None and needs is None:
            return cls((), None)
        settings = Run(folder).settings
        # The run's own settings decide which figures exist, not the options of this call.
        names = [read_criterion(criterion).quantity for criterion in settings.criteria]
        return cls.read(texts, junit, causes=settings.causes, criteria=names, needs=needs)

    @property
    def figures(self) -> set[str]:
        """The names of all figures in the criteria."""
        return {name for condition in self.conditions for name in condition.figures}

    def judge(self, run: Run) -> tuple[Outcome, ...]:
        """Apply the criteria to a run, and write the JUnit XML if requested.

        The first outcome is whether the run supports a verdict; without criteria and JUnit XML
        there is none but that, and it only where the run was not judged.
        """
        # A run that says nothing of its driver never passes, whatever was asked.
        if not self.conditions and self.junit is None and self.needs is None:
            return () if run.verdict != NOT_JUDGED else (_searched(run),)
        figures = figures_of(run)
        stated = (
            *(condition.judge(figures) for condition in self.conditions),
            *(_outcome_of(criterion) for criterion in run.criteria),
        )
        # What is critical is the product of a search, so it fails nothing by itself: tests fail in
        # the XML exactly where the exit status is 3.
        outcomes = (_searched(run), *unless_judged(stated, _why_not(run), _NOT_OF_THE_EGO))
        if self.junit is not None:
            write_junit(self.junit, _suites(run, outcomes))
        if self.needs is not None:
            write_needs(self.needs, run, outcomes[len(outcomes) - len(run.criteria) :])
        return outcomes


def figures_of(run: Run) -> dict[str, float]:
    """Return FIGURES of a run; NaN is an unknown figure."""
    s, nan = run.summary, float("nan")
    sought = run.settings.causes and run.settings.ego != STORYBOARD.name
    figures: dict[str, float] = {
        "r_critic": s.r_critic,
        "critical": s.critical,
        "first": float("inf") if s.first is None else s.first,
        "fiftieth": float("inf") if s.fiftieth is None else s.fiftieth,
        "d_min_best": s.d_min_best,
        "d_min_median": s.d_min_median,
        "v_d_best": s.v_d_best,
        "v_d_median": s.v_d_median,
        "stuck": float("nan") if (stuck := run.happening.stuck) is None else stuck,
        **{n: s.causes.get(cause, 0) if sought else nan for n, cause in _CAUSES.items()},
        **_of_triage(run),
    }
    figures |= {criterion.criterion.quantity: criterion.violated for criterion in run.criteria}
    # Nothing was measured: each figure is unknown, an error and not a pass.
    if s.failed == s.evaluations:
        figures = dict.fromkeys(figures, nan)
    return figures | {"evaluations": s.evaluations, "failed": s.failed, "seconds": s.seconds}


def _outcome_of(criterion_summary: CriterionSummary) -> Outcome:
    """Return whether all evaluations of a run meet a pass criterion, as an outcome."""
    known = criterion_summary.met + criterion_summary.violated
    verdict: Verdict = (
        "unknown" if not known else "failed" if criterion_summary.violated else "passed"
    )
    figures = (criterion_summary.criterion.quantity,)
    return Outcome(
        words_of(criterion_summary.criterion), verdict, criterion_summary.sentence, figures
    )


def _of_triage(run: Run) -> dict[str, float]:
    """Return the figures of a run's triage; NaN if there is none, or no estimate."""
    found, nan = run.triage, float("nan")
    if found is None:
        return dict.fromkeys(_TRIAGE, nan)
    space = found.bound.space
    return {
        "modes": len(found.modes) + found.unrecorded_modes or min(found.bound.failures, 1),
        "robust": found.robust + found.unrecorded_modes if found.neighbours else nan,
        "worst_severity": max((mode.severity for mode in found.modes), default=0.0),
        "harmful.upper": space.high if space.drawn and space.rows else nan,
    }


def _searched(run: Run) -> Outcome:
    s = run.summary
    details = f"{s.evaluations} evaluations, {s.critical} critical, {s.failed} failed"
    if reasons := run.failures.most_common(3):
        details += "; " + "; ".join(f"{count} x {reason}" for reason, count in reasons)
    found = run.triage
    if found is not None and found.bound.not_counted:
        details += f"; {found.bound.not_counted}"
    if why := _why_not(run):
        return Outcome("the search has results", "unknown", f"{why}; {details}")
    return Outcome("the search has results", "passed", details)


def _why_not(run: Run) -> str:
    """Return why a run is not judged; "" if it is."""
    if run.verdict != NOT_JUDGED:
        return ""
    if run.triage is None:
        return "the run has not ended"
    return run.triage.bound.sentence.removeprefix("Not judged: ").rstrip(".")


def _suites(run: Run, outcomes: Sequence[Outcome]) -> list[Suite]:
    """Return the criteria as one suite, and each exported scenario as a suite."""
    settings = run.settings
    name = Path(settings.scenario).stem
    group = f"bridgegen.{name}.{settings.ego.replace('.', '_')}"
    facts = {
        "scenario": settings.scenario,
        "ego": settings.ego,
        "algorithm": settings.algorithm,
        "budget": str(settings.budget),
        "seed": str(settings.seed),
        "command": settings.command(run.folder),
        "report": str(run.report),
    } | {key: f"{value:.6g}" for key, value in figures_of(run).items()}
    if run.triage is not None:
        facts |= {"found": run.triage.bound.sentence}
        facts |= {"rate": run.triage.rate.sentence} if run.triage.rate else {}
        facts |= {"covered": text} if (text := covered_in_words(run.triage)) else {}
        facts |= {f"mode {mode.number}": mode_in_words(mode, run.triage) for mode in run.modes}
    cases = [case_of(group, outcome) for outcome in outcomes]
    broken = [outcome for outcome in outcomes if outcome.verdict == "failed"]
    # Jenkins' schema (junit-10.xsd) allows properties of a suite and not of a test: each scenario
    # is a suite of its own.
    scenarios = [_scenario(run, path, name, group, broken) for path in run.scenarios]
    return [Suite(f"{name} criteria", cases, facts, run.summary.seconds), *scenarios]


def _scenario(run: Run, path: Path, name: str, group: str, broken: Sequence[Outcome]) -> Suite:
    """Return an exported scenario as a test, failed if it contributes to a failed criterion."""
    facts = read_facts(path.with_suffix(".json"))
    # Files of a folder can be edited: what the message needs is checked.
    if missing := {"d_min", "v_d", "n_collision"} - facts.metrics.keys():
        raise StorageError(
            f"{path.with_suffix('.json')}: is not what was exported: it has no "
            f"{', '.join(sorted(missing))}"
        )
    failed = [outcome.test for outcome in broken if _contributes(facts, outcome.figures)]
    values = {key: _text_of(metric) for key, metric in facts.metrics.items()}
    cause = f", cause: {facts.cause}" if facts.cause else ""
    what = "collision" if facts.metrics["n_collision"].value else "failure without a collision"
    message = f"{what}: d_min {values['d_min']} at v_d {values['v_d']}{cause}"
    files = sorted(path.parent.glob(f"{path.stem}.*"))
    text = "\n".join(
        [
            *(f"against: {item}" for item in failed),
            f"again: bridgegen simulate {path}",
            f"playback: {run.report}",
            f"files: {' '.join(str(file) for file in files)}",
            "parameters:",
            *(f"  {key} = {_text_of(parameter)}" for key, parameter in facts.parameters.items()),
            "metrics:",
            *(f"  {key} = {value}" for key, value in values.items()),
        ]
    )
    case = Case(group, f"critical {path.stem}", "failure" if failed else None, message, text)
    properties = values | {key: _text_of(parameter) for key, parameter in facts.parameters.items()}
    properties |= {"cause": facts.cause or "", "evaluation": str(facts.evaluation)}
    if facts.robustness is not None:
        properties |= {"mode": str(facts.mode), "robustness": f"{facts.robustness:.6g}"}
    return Suite(f"{name} {path.stem}", [case], properties)


def _contributes(facts: Facts, figures: Sequence[str]) -> bool:
    """Return whether a critical scenario contributes to a failed criterion, by its quick cause."""
    # The figures of a run count quick causes; a file may state the tested one.
    cause = facts.quick_cause if "quick_cause" in facts.model_fields_set else facts.cause
    for name in figures:
        if name.startswith(PREFIX):
            margin = facts.metrics[name].value if name in facts.metrics else None
            if margin is not None and margin < 0.0:
                return True
        elif _CAUSES[name] == cause if name in _CAUSES else name not in _OF_THE_RUN:
            return True
    return False


def _text_of(parameter_value: ParameterValue | Quantity) -> str:
    """Return a value with its unit; null is infinite, since exported values are never NaN."""
    if parameter_value.value is None:
        return "inf"
    if isinstance(parameter_value.value, str):
        return parameter_value.value
    unit = "" if parameter_value.unit in ("1", "count") else f" {parameter_value.unit}"
    return f"{parameter_value.value:.6g}{unit}"
