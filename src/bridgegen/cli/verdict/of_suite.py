"""Pass/fail criteria for a suite."""

from collections.abc import Sequence
from dataclasses import replace

from bridgegen.assess.conflict.findings import with_whom
from bridgegen.cli.verdict.conditions import Conditions
from bridgegen.cli.verdict.fail_if import Outcome, Verdict, unless_judged, words_of
from bridgegen.cli.verdict.junit import Case, Problem, Suite, case_of, write_junit
from bridgegen.jobs.suite.clauses import clause_results
from bridgegen.jobs.suite.known_failures import EXCUSED
from bridgegen.jobs.suite.options import SUITE
from bridgegen.jobs.suite.replay import replay_command
from bridgegen.jobs.suite.results import FAILED, EntryResult, RowResult, counts
from bridgegen.jobs.suite.sentences import clause_in_words
from bridgegen.jobs.suite.suite import SuiteRun
from bridgegen.scenario.language.criteria import read_criterion
from bridgegen.scenario.language.protocols import read_clause

MOST_NAMED = 20
"""Variations that a test's text names."""

MOST_ENTRIES = 3
"""Entries that an outcome names."""


class SuiteCriteria(Conditions):
    """The criteria for a suite.

    Without conditions, a variation that fails or did not run fails it. An entry that could not be
    judged leaves no condition passed, unless one of them states how many may be so.
    """

    known = tuple(SUITE.figures)

    def judge(self, suite: SuiteRun) -> tuple[Outcome, ...]:
        """Apply the criteria to a suite, and write the JUnit XML if requested."""
        figures = figures_of(suite)
        outcomes = tuple(condition.judge(figures) for condition in self.conditions)
        if not {"not_judged", "not_judged_entries"} & {
            f for outcome in outcomes for f in outcome.figures
        }:
            outcomes = unless_judged(outcomes, unjudged_entries(suite.results))
        if "flaky" not in {f for outcome in outcomes for f in outcome.figures}:
            outcomes = unless_judged(outcomes, flaky_entries(suite, suite.results))
        if not outcomes:
            outcomes = tuple(_all_pass(suite, ego) for ego in suite.egos)
        if self.junit is not None:
            write_junit(self.junit, _suites(suite, outcomes if self.conditions else ()))
        return outcomes


def figures_of(suite: SuiteRun) -> dict[str, float]:
    """Return the figures of a suite, and of each criterion the variations that violate it."""
    results = suite.results
    standing = suite.known_failures.counts(results)
    rows = [row for result in results for row in result.rows]
    number = counts(results)
    figures: dict[str, float] = {
        "entries": len(results),
        "variations": len(rows),
        "passed": number["passed"],
        "failed": number["failed"],
        "known": sum(standing[item] for item in EXCUSED),
        "regressions": standing["regression"],
        "new_failures": standing["new"],
        "not_judged": number["not judged"],
        "not_judged_entries": sum(result.verdict == "not judged" for result in results),
        "not_run": number["not run"],
        "flaky": number["flaky"],
        "failed_entries": sum(result.verdict == "failed" for result in results),
        "failed_clauses": sum(
            result.verdict == "failed"
            for ego in dict.fromkeys(each.ego for each in results)
            for result in clause_results(results, ego)
        ),
        "critical": sum(row.critical for row in rows),
        "collisions": sum(row.collisions > 0 for row in rows),
        "mitigated": sum(row.outcome == "mitigated" for row in rows),
        "not_avoided": sum(row.outcome == "not avoided" for row in rows),
        "worst_impact": max((row.impact_speed for row in rows), default=0.0),
        "worst_severity": max((row.severity for row in rows), default=0.0),
    }
    for result in results:
        for number_of, given in enumerate(result.criteria):
            name = read_criterion(given).quantity
            violated = sum(number_of in row.violated for row in result.rows)
            figures[name] = figures.get(name, 0.0) + violated
    return figures


def unjudged_entries(results: Sequence[EntryResult]) -> str:
    """Return which entries could not be judged, and why, in words; "" without any."""
    return named([f"{o.entry}: {o.unjudged}" for o in results if o.verdict == "not judged"])


def flaky_entries(suite: SuiteRun, results: Sequence[EntryResult]) -> str:
    """Return which entries have flaky variations, in words; "" without any that is not known."""
    by_entry = [(o, _flaky(suite, o)) for o in results]
    return named([f"{o.entry}: {len(at)} {o.rows[at[0]].flaky}" for o, at in by_entry if at])


def _flaky(suite: SuiteRun, of: EntryResult) -> list[int]:
    """Return the numbers of the variations whose repeats disagree, but for known failures."""
    rows = ((i, row) for i, row in enumerate(of.rows) if row.flaky)
    return [i for i, row in rows if suite.known_failures.standing(of, row) not in EXCUSED]


def named(entries: Sequence[str]) -> str:
    """Return texts on entries as one, of at most `MOST_ENTRIES` of them."""
    more = len(entries) - MOST_ENTRIES
    some = [*entries[:MOST_ENTRIES], *([f"and {more} more entries"] if more > 0 else [])]
    return "; ".join(some)


def _all_pass(suite: SuiteRun, ego: str) -> Outcome:
    results = suite.of_ego(ego)
    number = counts(results)
    total = sum(number.values())
    details = f"{number['failed']} of {total} fail, {number['passed']} pass"
    details += f", {number['not judged']} not judged" if number["not judged"] else ""
    details += f", {number['not run']} not run" if number["not run"] else ""
    details += f", {number['flaky']} flaky" if number["flaky"] else ""
    standing = suite.known_failures.counts(results)
    known = sum(standing[name] for name in EXCUSED)
    if known:
        details += f"; {known} of the failed {'is' if known == 1 else 'are'} known"
    if again := suite.known_failures.regressions(results):
        details += f"; regression: {', '.join(again)} {'was' if len(again) == 1 else 'were'} fixed"
        details += f", and {'fails' if len(again) == 1 else 'fail'} again"
    verdict: Verdict = "passed"
    # A failure comes before what could not be judged: it stays one, however much else is missing.
    why = "; ".join(filter(None, (unjudged_entries(results), flaky_entries(suite, results))))
    if standing["new"] + standing["regression"]:
        verdict = "failed"
    elif why or number["not run"] or not number["passed"] + known:
        verdict = "unknown"
        details += f"; {why}" if why else ""
    test = "variations" + (" but known failures" if suite.known_failures.failures else "")
    return Outcome(test + (f" with {ego}" if ego else ""), verdict, details)


def _suites(suite: SuiteRun, outcomes: Sequence[Outcome]) -> list[Suite]:
    """Return each entry of each ego as a suite; the conditions, if any, as one more."""
    found = []
    if outcomes:
        found.append(
            Suite("conditions", [case_of("bridgegen.suite", outcome) for outcome in outcomes])
        )
    for result in suite.results:
        group = (
            f"bridgegen.{result.entry.replace('/', '.')}.{(result.ego or result.driver or 'ego')}"
        )
        facts = {
            "scenario": result.scenario,
            "distribution": result.distribution,
            "ego": result.driver or result.ego,
            "variations": str(len(result.rows)),
            **{name.replace(" ", "_"): str(n) for name, n in result.outcomes().items()},
        }
        facts |= {
            f"clause {clause.id}": clause_in_words(clause)
            for clause in clause_results([result], result.ego)
        }
        failure = suite.known_failures.failures.get(result.entry)
        if failure is not None:
            facts |= {"failure": failure[0], "status": failure[1].status}
        found.append(Suite(result.entry, _cases(suite, result, group), facts))
    if suite.unanswered:
        cases = [
            Case("bridgegen.unanswered", f"clause {id}: {text}", "skipped", why)
            for id, text, why in suite.unanswered
        ]
        found.append(Suite("not answered", cases))
    return found


def _cases(suite: SuiteRun, entry_result: EntryResult, group: str) -> list[Case]:
    """Return the tests of an entry: that it runs, that no variation is critical, its criteria.

    What fails as it is known to is skipped. Where the entry is not judged, none passes.
    """
    if entry_result.problem:
        return [Case(group, "runs", "error", entry_result.problem)]
    stated = suite.known_failures
    failure = stated.failures.get(entry_result.entry)
    again = failure is not None and failure[1].status == "fixed"

    def case(name: str, rows: Sequence[int], what: str, known: bool) -> Case:
        if rows and known and failure is not None:
            return case_of_rows(
                group, name, entry_result, rows, f"{what}: {failure[1].status} failure", "skipped"
            )
        what += ": regression, this failure was fixed" if again and rows else ""
        return case_of_rows(group, name, entry_result, rows, what, "failure", suite)

    lost = [i for i, row in enumerate(entry_result.rows) if row.problem]
    cases = [case_of_rows(group, "runs", entry_result, lost, "did not run", "error")]
    odd = [i for i, verdict in enumerate(entry_result.verdicts) if verdict == "not judged"]
    flaky, agree = _flaky(suite, entry_result), "repeats agree"
    if any(row.repeats > 1 for row in entry_result.rows):
        cases.append(case_of_rows(group, agree, entry_result, flaky, "are flaky", "error", suite))
    sure = [(i, row) for i, row in enumerate(entry_result.rows) if not row.flaky]
    critical = [i for i, row in sure if row.critical]
    excused = all(stated.is_excused(entry_result, entry_result.rows[i]) for i in critical)
    cases.append(case("no critical scenario", critical, "critical", excused))
    for number, given in enumerate(entry_result.criteria):
        violating = [i for i, row in sure if number in row.violated]
        words = words_of(read_criterion(given))
        cases.append(
            case(words, violating, "violate it", stated.is_criterion_excused(entry_result, number))
        )
    for number, given in enumerate(entry_result.clauses):
        clause = read_clause(given)
        failing = [i for i, letter in enumerate(entry_result.letters(number)) if letter == FAILED]
        name = f"clause {clause.id}: {clause.text}"
        cases.append(case(name, failing, "fail it", known=False))
    what = f"not judged: {entry_result.unjudged}"
    if flaky:
        odd, what = flaky, f"not judged: {entry_result.rows[flaky[0]].flaky}"
    elif entry_result.verdict != "not judged":
        return cases
    why = case_of_rows(group, "", entry_result, odd, what, "error")
    return [
        each
        # What failed stays failed, and that it ran is known; only passes are taken back.
        if each.problem or each.name == "runs"
        else replace(why, name=each.name, message=what)
        for each in cases
    ]


def case_of_rows(
    group: str,
    name: str,
    entry_result: EntryResult,
    rows: Sequence[int],
    what: str,
    problem: Problem,
    suite: SuiteRun | None = None,
) -> Case:
    """Return a test that has a problem if there are such variations, and names them.

    Args:
        group: of tests.
        name: of the test.
        entry_result: the entry's results.
        rows: the numbers of these variations.
        what: what is wrong with them, in words.
        problem: that the test has.
        suite: to say how to see the first again; not said without.
    """
    message = f"{len(rows)} of {len(entry_result.rows)} variations {what}"
    lines = [row_in_words(entry_result, i, entry_result.rows[i]) for i in rows[:MOST_NAMED]]
    if len(rows) > MOST_NAMED:
        lines.append(f"and {len(rows) - MOST_NAMED} more")
    if rows and suite is not None:
        lines.append(f"the first again: {replay_command(suite.folder, entry_result, rows[0])}")
    return Case(group, name, problem if rows else None, message, "\n".join(lines))


def row_in_words(entry_result: EntryResult, i: int, row: RowResult) -> str:
    """Return a variation in a line: its values, and what happened."""
    values = zip(entry_result.parameters, row.x, entry_result.units, strict=True)
    named = ", ".join(
        f"{name} = {value if isinstance(value, str) else f'{value:.6g}'}"
        + (f" {unit}" if unit not in ("1", "count", "?") else "")
        for name, value, unit in values
    )
    happened = row.problem or (
        f"{with_whom(row.conflict, row.partner)} ({row.conflict_type}), severity {row.severity:.2g}"
        if row.conflict
        else "no conflict"
    )
    happened += f"; {row.flaky}" if row.flaky else ""
    if row.outcome not in (None, "avoided"):
        happened += f"; {row.outcome}, impact at {row.impact_speed:.3g} m/s"
    return f"variation {i + 1}{f' ({named})' if named else ''}: {happened}"
