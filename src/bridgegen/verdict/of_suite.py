"""Pass/fail criteria for a suite, and for the difference of two egos in it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from bridgegen.odd.clauses import read_clause
from bridgegen.odd.criteria import read_criterion
from bridgegen.suite.clauses import clause_results
from bridgegen.suite.difference import Difference
from bridgegen.suite.results import FAILED, EntryResult, RowResult, counts
from bridgegen.suite.sentences import clause_in_words
from bridgegen.suite.suite import SuiteRun
from bridgegen.verdict.fail_if import (
    FailCondition,
    Outcome,
    Verdict,
    read_conditions,
    words_of,
)
from bridgegen.verdict.junit import Case, Suite, case_of, refuse_junit, write_junit

FIGURES = {
    "entries": "scenarios with their variations, of all egos",
    "variations": "variations, of all egos",
    "passed": "variations that pass",
    "failed": "variations that fail: critical, or a pass criterion or clause is violated",
    "not_run": "variations that did not run; an entry that cannot run is one",
    "failed_entries": "entries in which a variation fails",
    "failed_clauses": "clauses of a regulation that an ego fails",
    "critical": "variations that are critical",
    "collisions": "variations in which the ego collides",
    "worst_severity": "the worst probability of MAIS3+",
}
"""The figures of a suite that ``--fail-if`` accepts."""

OF_A_DIFFERENCE = {
    "broken": "variations that the first ego passes and the second fails",
    "fixed": "variations that the first ego fails and the second passes",
    "both_fail": "variations that both fail",
    "both_pass": "variations that both pass",
    "not_comparable": "variations that one of them did not run",
    "more_severe": "variations in which the second's severity is larger",
    "p_value": "of McNemar's exact test",
}
"""The figures of the difference of two egos."""

MOST_NAMED = 20
"""Variations that a test's text names."""


@dataclass(frozen=True)
class SuiteCriteria:
    """The criteria for a suite, checked before it starts.

    Attributes:
        conditions: each fails the suite if it holds; none: a variation that fails or did not run
            does.
        junit: path of the JUnit XML, or None.
    """

    conditions: tuple[FailCondition, ...]
    junit: Path | None

    @classmethod
    def read(cls, texts: Sequence[str], junit: Path | None, criteria: Sequence[str] = ()) -> Self:
        """Read the criteria.

        Args:
            texts: see `read_conditions`; their figures are FIGURES.
            junit: a new file, or an earlier JUnit XML.
            criteria: the margins of pass criteria that are given for all scenarios: figures too,
                each the number of variations that violate it.

        Raises:
            InputError: a text is not a condition, or a figure is unknown.
            StorageError: the JUnit XML cannot be written.
        """
        found = cls(read_conditions(texts, (*FIGURES, *criteria)), junit)
        if junit is not None:
            refuse_junit(junit)
        return found

    def judge(self, suite: SuiteRun) -> tuple[Outcome, ...]:
        """Apply the criteria to a suite, and write the JUnit XML if requested."""
        figures = figures_of(suite.results)
        outcomes = [one.judge(figures) for one in self.conditions]
        if not outcomes:
            outcomes = [_all_pass(suite, ego) for ego in suite.egos]
        if self.junit is not None:
            write_junit(self.junit, _suites(suite, outcomes if self.conditions else ()))
        return tuple(outcomes)


def figures_of(results: Sequence[EntryResult]) -> dict[str, float]:
    """Return FIGURES of results, and of each criterion the variations that violate it."""
    rows = [row for one in results for row in one.rows]
    number = counts(results)
    figures: dict[str, float] = {
        "entries": len(results),
        "variations": len(rows),
        "passed": number["passed"],
        "failed": number["failed"],
        "not_run": number["not run"],
        "failed_entries": sum(one.verdict == "failed" for one in results),
        "failed_clauses": sum(
            one.verdict == "failed"
            for ego in dict.fromkeys(each.ego for each in results)
            for one in clause_results(results, ego)
        ),
        "critical": sum(row.critical for row in rows),
        "collisions": sum(row.collisions > 0 for row in rows),
        "worst_severity": max((row.severity for row in rows), default=0.0),
    }
    for one in results:
        for number_of, given in enumerate(one.criteria):
            name = read_criterion(given).quantity
            violated = sum(number_of in row.violated for row in one.rows)
            figures[name] = figures.get(name, 0.0) + violated
    return figures


def figures_of_difference(found: Difference) -> dict[str, float]:
    """Return OF_A_DIFFERENCE."""
    figures: dict[str, float] = {
        change.replace(" ", "_"): count for change, count in found.counts.items()
    }
    more = sum(one.severity > 0.0 for one in found.rows if one.change != "not comparable")
    return figures | {"more_severe": more, "p_value": found.p_value}


@dataclass(frozen=True)
class DifferenceCriteria:
    """The criteria for a difference, checked before it is made.

    Attributes:
        conditions: each fails it if it holds; none: nothing does.
    """

    conditions: tuple[FailCondition, ...]

    @classmethod
    def read(cls, texts: Sequence[str]) -> Self:
        """Read the criteria; their figures are OF_A_DIFFERENCE.

        Raises:
            InputError: a text is not a condition, or a figure is unknown.
        """
        return cls(read_conditions(texts, OF_A_DIFFERENCE))

    def judge(self, found: Difference) -> tuple[Outcome, ...]:
        """Apply the criteria to a difference."""
        figures = figures_of_difference(found)
        return tuple(one.judge(figures) for one in self.conditions)


def _all_pass(suite: SuiteRun, ego: str) -> Outcome:
    number = counts(suite.of_ego(ego))
    details = ", ".join(f"{count} {name}" for name, count in number.items())
    verdict: Verdict = "passed"
    if number["failed"]:
        verdict = "failed"
    elif number["not run"] or not number["passed"]:
        verdict = "unknown"
    return Outcome(f"all variations pass{f' with {ego}' if ego else ''}", verdict, details)


def _suites(suite: SuiteRun, outcomes: Sequence[Outcome]) -> list[Suite]:
    """Return each entry of each ego as a suite; the conditions, if any, as one more."""
    found = []
    if outcomes:
        found.append(Suite("conditions", [case_of("bridgegen.suite", one) for one in outcomes]))
    for one in suite.results:
        group = f"bridgegen.{one.entry.replace('/', '.')}.{(one.ego or one.driver or 'ego')}"
        facts = {
            "scenario": one.scenario,
            "distribution": one.distribution,
            "ego": one.driver or one.ego,
            "variations": str(len(one.rows)),
        }
        facts |= {
            f"clause {clause.id}": clause_in_words(clause)
            for clause in clause_results([one], one.ego)
        }
        found.append(Suite(one.entry, _cases(one, group), facts))
    return found


def _cases(one: EntryResult, group: str) -> list[Case]:
    """Return the tests of an entry: that it runs, that no variation is critical, its criteria."""
    if one.problem:
        return [Case(group, "runs", "error", one.problem)]
    lost = [i for i, row in enumerate(one.rows) if row.problem]
    cases = [_case(group, "runs", one, lost, "did not run", "error")]
    critical = [i for i, row in enumerate(one.rows) if row.critical]
    cases.append(_case(group, "no critical scenario", one, critical, "critical", "failure"))
    for number, given in enumerate(one.criteria):
        violating = [i for i, row in enumerate(one.rows) if number in row.violated]
        words = words_of(read_criterion(given))
        cases.append(_case(group, words, one, violating, "violate it", "failure"))
    for number, given in enumerate(one.clauses):
        clause = read_clause(given)
        failing = [i for i, letter in enumerate(one.letters(number)) if letter == FAILED]
        name = f"clause {clause.id}: {clause.text}"
        cases.append(_case(group, name, one, failing, "fail it", "failure"))
    return cases


def _case(
    group: str, name: str, one: EntryResult, rows: Sequence[int], what: str, problem: str
) -> Case:
    message = f"{len(rows)} of {len(one.rows)} variations {what}"
    lines = [_row_in_words(one, i, one.rows[i]) for i in rows[:MOST_NAMED]]
    if len(rows) > MOST_NAMED:
        lines.append(f"and {len(rows) - MOST_NAMED} more")
    kind = problem if rows else None
    return Case(group, name, kind, message, "\n".join(lines))  # type: ignore[arg-type]


def _row_in_words(one: EntryResult, i: int, row: RowResult) -> str:
    """Return a variation in a line: its values, and what happened."""
    values = zip(one.parameters, row.x, one.units, strict=True)
    named = ", ".join(
        f"{name} = {value if isinstance(value, str) else f'{value:.6g}'}"
        + (f" {unit}" if unit not in ("1", "count", "?") else "")
        for name, value, unit in values
    )
    happened = row.problem or (
        f"{row.conflict} with {row.partner} ({row.conflict_type}), severity {row.severity:.2g}"
        if row.conflict
        else "no conflict"
    )
    return f"variation {i + 1}{f' ({named})' if named else ''}: {happened}"
