"""Pass/fail criteria for the difference of two egos in a suite."""

from collections.abc import Iterator, Sequence

from bridgegen.cli.verdict.conditions import Conditions
from bridgegen.cli.verdict.fail_if import Outcome, Verdict, unless_judged
from bridgegen.cli.verdict.junit import Case, Suite, case_of, write_junit
from bridgegen.cli.verdict.of_suite import case_of_rows, named
from bridgegen.jobs.suite.difference import Difference, DriverDifference, WorseThan
from bridgegen.jobs.suite.options import DIFF
from bridgegen.jobs.suite.results import EntryResult
from bridgegen.jobs.suite.suite import SuiteRun


class DifferenceCriteria(Conditions):
    """The criteria for a difference of two egos.

    With a JUnit XML and without conditions, a variation that is broken fails the difference, and so
    does a search that finds where the second ego is worse. An entry of which too few variations
    could be compared leaves no condition passed, unless one of them states how many may be so.
    """

    known = tuple(DIFF.figures)

    def judge(self, result: DriverDifference) -> tuple[Outcome, ...]:
        """Apply the criteria, and write the JUnit XML if requested."""
        suite, found, searches = result.suite, result.difference, result.searches
        figures = figures_of(found, searches)
        outcomes = tuple(condition.judge(figures) for condition in self.conditions)
        why = named([f"{entry}: {text}" for entry, text in _unjudged(suite, found).items()])
        if not {"not_comparable", "not_judged_entries"} & {f for o in outcomes for f in o.figures}:
            outcomes = unless_judged(outcomes, why)
        if self.junit is not None:
            conditions = outcomes
            if not outcomes:
                breaks = _none(f"{found.second} breaks nothing", figures, "broken", "not_run")
                worse = f"no search finds {found.second} worse"
                outcomes = (
                    *unless_judged([breaks], why),
                    _none(worse, figures, "worse", "not_searched"),
                )
            write_junit(self.junit, _suites(suite, found, searches, conditions))
        if not outcomes and why:
            outcomes = (Outcome("the drivers can be compared", "unknown", why),)
        return outcomes


def figures_of(found: Difference, searches: Sequence[WorseThan]) -> dict[str, float]:
    """Return the figures of a difference and of its searches."""
    compared = [row for row in found.rows if row.change != "not comparable"]
    return {
        **{change.replace(" ", "_"): count for change, count in found.counts.items()},
        "more_severe": sum(row_change.severity > 0.0 for row_change in compared),
        "less_severe": sum(row_change.severity < 0.0 for row_change in compared),
        "not_run": sum(not row.run for row in found.rows),
        "not_judged_entries": len(found.unjudged),
        "p_value": found.p_value,
        "worse": sum(search.worse for search in searches),
        "worse_modes": sum(len(search.modes) for search in searches),
        "worse_scenarios": sum(bool(search.worse) for search in searches),
        "not_searched": sum(bool(search.problem) for search in searches),
    }


def _none(test: str, figures: dict[str, float], wrong: str, unknown: str) -> Outcome:
    """Return the outcome of a test that passes if two figures are 0."""
    verdict: Verdict = "failed" if figures[wrong] else "unknown" if figures[unknown] else "passed"
    details = ", ".join(f"{name} {figures[name]:g}" for name in (wrong, unknown))
    return Outcome(test, verdict, details, (wrong, unknown))


def _unjudged(suite: SuiteRun, found: Difference) -> dict[str, str]:
    """Return by entry why it cannot be compared, of those of which too few variations can be."""
    whys: dict[str, list[str]] = {}
    for result in suite.results:
        if result.verdict == "not judged":
            whys.setdefault(result.entry, []).append(f"{result.ego}: {result.unjudged}")
    return {entry: "; ".join([why, *whys.get(entry, [])]) for entry, why in found.unjudged.items()}


def _suites(
    suite: SuiteRun,
    found: Difference,
    searches: Sequence[WorseThan],
    outcomes: Sequence[Outcome],
) -> Iterator[Suite]:
    """Yield a suite for each entry; before them, one of the conditions, if there are any."""
    if outcomes:
        yield Suite("conditions", [case_of("bridgegen.diff", outcome) for outcome in outcomes])
    by_entry, unjudged = {than.entry: than for than in searches}, _unjudged(suite, found)
    broken: dict[str, list[int]] = {}
    lost = {row.entry for row in found.rows if not row.run}
    for row in found.rows:
        if row.change == "broken":
            broken.setdefault(row.entry, []).append(row.row)
    for second in suite.of_ego(found.second):
        group = f"bridgegen.{second.entry.replace('/', '.')}.{found.second}"
        name, rows = f"passes what {found.first} passes", broken.get(second.entry, [])
        passes = case_of_rows(
            group, name, second, rows, f"fail, and pass with {found.first}", "failure"
        )
        if not rows and (why := unjudged.get(second.entry)):
            passes = Case(group, name, "error", why)
        cases = [_runs(group, second, second.entry in lost), passes]
        if search := by_entry.get(second.entry):
            cases.append(_searched(group, search, found.first))
        facts = {"scenario": second.scenario, "ego": found.second, "compared with": found.first}
        yield Suite(second.entry, cases, facts)


def _runs(group: str, entry_result: EntryResult, lost: bool) -> Case:
    why = entry_result.problem or "a variation did not run with one of the drivers"
    return Case(group, "runs with both", "error" if lost else None, why if lost else "")


def _searched(group: str, search: WorseThan, first: str) -> Case:
    name = f"no search finds it worse than {first}"
    if search.problem:
        return Case(group, name, "error", search.problem)
    if not search.worse:
        return Case(group, name, None, search.sentence)
    return Case(group, name, "failure", search.sentence, "\n".join(search.modes))
