"""A suite: one bar for all its entries, then its table; the difference of two egos."""

import json
import sys
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table

from bridgegen.cli.terminal.live import Live
from bridgegen.cli.terminal.tables import WHOLE

if TYPE_CHECKING:
    from bridgegen.jobs.preventability.result import PreventabilityMap
    from bridgegen.jobs.suite.difference import Difference, WorseCallbacks, WorseThan
    from bridgegen.jobs.suite.results import EntryResult
    from bridgegen.jobs.suite.suite import SuiteCallbacks, SuiteRun

MOST_MODES = 3
"""Failure modes of a search that are named."""

MOST_ROWS = 40
"""Entries of the table; those that pass are left out first."""


class SuiteScreen(Live):
    """The live progress of a suite."""

    def __init__(self) -> None:
        super().__init__()
        self._entries = self._done = self._failed = self._unjudged = self._lost = 0

    @property
    def callbacks(self) -> "SuiteCallbacks":
        """The callbacks for ``run_suite``."""
        from bridgegen.jobs.suite.suite import SuiteCallbacks

        return SuiteCallbacks(begun=self._begin, ended=self._end)

    def of_searches(self, budget: int) -> "WorseCallbacks":
        """Return the callbacks for ``search_worse``.

        Args:
            budget: evaluations of each search.
        """
        from bridgegen.jobs.suite.difference import WorseCallbacks

        def begin(entry: str, number: int, count: int) -> None:
            facts = f"{number + 1} of {count}: {entry}"
            self.show(what="searching", done=0, total=budget, facts=facts)

        return WorseCallbacks(begun=begin, batch=lambda evaluations: self.show(done=evaluations))

    def _begin(self, entries: int, done: int) -> None:
        self.say_compiling()
        self._entries, self._done = entries, done
        self._show()

    def _end(self, result: "EntryResult") -> None:
        self._done += 1
        self._failed += result.verdict == "failed"
        self._unjudged += result.verdict == "not judged"
        self._lost += result.verdict == "not run"
        self._show()

    def show_cells(self, done: int, total: int) -> None:
        """Show how far a preventability map is."""
        self.show(what="cells of a map", done=done, total=total, facts="")

    def _show(self) -> None:
        facts = f"{self._failed} failed"
        facts += f", {self._unjudged} not judged" if self._unjudged else ""
        facts += f", {self._lost} not run" if self._lost else ""
        self.show(what="scenarios", done=self._done, total=self._entries, facts=facts)


def print_suite(
    suite: "SuiteRun",
    seconds: float,
    page: Path,
    maps: "Sequence[PreventabilityMap]" = (),
    *,
    as_json: bool = False,
) -> None:
    """Print the entries that do not pass, others if there is room; then the totals."""
    from bridgegen.jobs.suite.results import counts
    from bridgegen.jobs.suite.sentences import outcomes, points

    if as_json:
        found = [
            {"scenario": one.scenario.name, "drivers": [one.figures(name) for name in one.drivers]}
            for one in maps
        ]
        print(json.dumps(_facts(suite) | {"maps": found}, indent=2, ensure_ascii=False))
        return
    by_entry: dict[str, list[EntryResult]] = {}
    for one in suite.results:
        by_entry.setdefault(one.entry, []).append(one)
    passed = [name for name, some in by_entry.items() if {o.verdict for o in some} == {"passed"}]
    shown = [name for name in by_entry if name not in passed]
    left = max(0, MOST_ROWS - len(shown))
    listed = {*shown[:MOST_ROWS], *passed[:left]}
    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("scenario", overflow="fold")
    for ego in suite.egos:
        table.add_column(ego or "ego's own driver", overflow="fold")
    table.add_column("worst", overflow="fold")
    for name, some in by_entry.items():
        if name in listed:
            table.add_row(name, *(_verdict(suite, one) for one in some), _worst(some))
    console = Console(markup=False, emoji=False, highlight=False)
    if not sys.stdout.isatty():
        console.width = WHOLE
    console.print(table)
    if len(by_entry) > len(listed):
        print(f"and {len(by_entry) - len(listed)} more")
    _print_clauses(suite, console)
    print()
    for ego in suite.egos:
        results = suite.of_ego(ego)
        number = counts(results)
        entries = sum(one.verdict == "passed" for one in results)
        unjudged = sum(one.verdict == "not judged" for one in results)
        print(
            f"{ego or 'the own drivers'}: {entries} of {len(results)} scenarios pass"
            + (f", {unjudged} {'is' if unjudged == 1 else 'are'} not judged" if unjudged else "")
            + f"; of their variations {number['passed']} pass, {number['failed']} fail, "
            + (f"{number['not judged']} not judged, " if number["not judged"] else "")
            + f"{number['not run']} did not run"
        )
        for text in filter(None, (outcomes(results), points(results))):
            print(f"  {text}")
        _print_standing(suite, ego)
    if gone := suite.known_failures.gone(suite.results):
        print(f"no longer fail, set their status to fixed: {', '.join(gone)}")
    for made in maps:
        print(f"map: {made.page}")
    print(f"page: {page} ({seconds:.1f} s)")


def _print_clauses(suite: "SuiteRun", console: Console) -> None:
    """Print what each ego makes of each clause, if entries state any."""
    from bridgegen.jobs.suite.clauses import clause_results
    from bridgegen.jobs.suite.sentences import clause_in_words

    by_ego = [clause_results(suite.results, ego) for ego in suite.egos]
    if not any(by_ego):
        return
    table = Table(box=None, pad_edge=False, header_style="bold")
    for head in ("clause", *(ego or "ego's own driver" for ego in suite.egos), "requirement"):
        table.add_column(head, overflow="fold")
    for of_it in zip(*by_ego, strict=True):
        table.add_row(of_it[0].id, *map(clause_in_words, of_it), of_it[0].text)
    print()
    console.print(table)


def _print_standing(suite: "SuiteRun", ego: str) -> None:
    """Print how the failures of an ego stand, where indexes name some."""
    results = suite.of_ego(ego)
    if sentence := suite.known_failures.sentence(results):
        print(f"  {sentence}")
    for id in suite.known_failures.regressions(results):
        print(f"  regression: {id} was fixed, and fails again")


def print_difference(
    found: "Difference", searches: Sequence["WorseThan"], page: Path, *, as_json: bool = False
) -> None:
    """Print what is broken and fixed from the first ego to the second, then what searches found."""
    counts = found.counts
    if as_json:
        facts: dict[str, Any] = {
            "first": found.first,
            "second": found.second,
            "counts": counts,
            "p_value": found.p_value,
            "unjudged": found.unjudged,
            "rows": [vars(one) for one in found.rows if one.change in ("broken", "fixed")],
            "searches": [{**vars(one), "folder": str(one.folder)} for one in searches],
        }
        print(json.dumps(facts, indent=2, ensure_ascii=False))
        return
    by_entry: dict[str, dict[str, int]] = {}
    for one in found.rows:
        of_it = by_entry.setdefault(one.entry, dict.fromkeys(counts, 0))
        of_it[one.change] += 1
    table = Table(box=None, pad_edge=False, header_style="bold")
    for name in ("scenario", *counts):
        table.add_column(name, overflow="fold")
    changed = {
        name: of_it
        for name, of_it in by_entry.items()
        if of_it["broken"] or of_it["fixed"] or of_it["not comparable"]
    }
    for name, of_it in list(changed.items())[:MOST_ROWS]:
        table.add_row(name, *(str(count) for count in of_it.values()))
    console = Console(markup=False, emoji=False, highlight=False)
    if not sys.stdout.isatty():
        console.width = WHOLE
    if changed:
        console.print(table)
        print()
    n = len(found.rows) - counts["not comparable"]
    print(f"{found.second} against {found.first}, {n} variations")
    for change in ("broken", "fixed"):
        low, high = found.interval(change)
        sure = f" ({low:.2%} to {high:.2%} with 95 % confidence)" if found.sampled else ""
        print(f"  {change:<16}{counts[change]}{sure}")
    print(f"  {'both fail':<16}{counts['both fail']}")
    print(f"  {'both pass':<16}{counts['both pass']}")
    if counts["not comparable"]:
        print(f"  {'not comparable':<16}{counts['not comparable']}")
    compared = [one.severity for one in found.rows if one.change != "not comparable"]
    worse, better = (sum(sign * one > 0.0 for one in compared) for sign in (1.0, -1.0))
    print(f"  {'severity':<16}higher in {worse}, lower in {better}")
    if found.sampled:
        print(f"  {'by chance':<16}p = {found.p_value:.3g} (McNemar's exact test)")
    _print_searches(searches, found)
    print(f"page: {page}")


def _print_searches(searches: Sequence["WorseThan"], found: "Difference") -> None:
    """Print where searches found the second ego worse; then how many found nothing."""
    if not searches:
        return
    print(f"\nsearches for scenarios that {found.second} fails and {found.first} passes")
    for one in searches:
        if one.problem:
            print(f"  {one.entry}: no result: {one.problem}")
        elif one.worse:
            print(f"  {one.entry}: {one.sentence}")
            for title in one.modes[:MOST_MODES]:
                print(f"    {title}")
            print(f"    {one.folder / 'report.html'}")
    if none := [one for one in searches if not one.worse and not one.problem]:
        evaluations = sum(one.evaluations for one in none)
        print(f"  none in {len(none)} others ({evaluations} evaluations)")
    print()


def _verdict(suite: "SuiteRun", one: "EntryResult") -> str:
    from bridgegen.jobs.suite.known_failures import words

    said = words(suite.known_failures.worst(one), suite.known_failures.failures.get(one.entry))
    return f"{_counted(one)} ({said})" if said else _counted(one)


def _counted(one: "EntryResult") -> str:
    if one.problem:
        return "not run"
    n = len(one.rows)
    failed, unjudged, lost = (one.count(v) for v in ("failed", "not judged", "not run"))
    if not failed and not unjudged and not lost:
        return "pass" if n == 1 else f"pass ({n})"
    parts = [f"{failed} of {n} fail"] if failed else []
    if one.verdict == "not judged":
        parts.append("NOT JUDGED")
    elif unjudged:
        parts += [] if failed or lost else [f"pass ({n - unjudged})"]
        parts.append(f"{unjudged} not judged")
    parts += [f"{lost} not run"] if lost else []
    _, slowed, unslowed = one.outcomes().values()
    if slowed + unslowed:
        parts.append(f"{slowed + unslowed} collide, {slowed} after slowing down")
    return ", ".join(parts)


def _worst(some: Sequence["EntryResult"]) -> str:
    """Return the worst thing that happens in an entry."""
    from bridgegen.assess.conflict.findings import with_whom

    for one in some:
        if one.worst is not None:
            row = one.rows[one.worst]
            violated = ", ".join(str(one.criteria[i]["id"]) for i in row.violated)
            happened = row.critical and row.conflict
            texts = [with_whom(row.conflict, row.partner)] if happened else []
            texts += [f"impact at {row.impact_speed:.1f} m/s"] if row.impact_speed else []
            texts += [f"MAIS3+ {row.severity:.2%}"] if row.severity else []
            texts += [f"violates {violated}"] if violated else []
            return "; ".join(texts)
    lost = [one.problem or next((r.problem for r in one.rows if r.problem), "") for one in some]
    return next(filter(None, [*lost, *(o.unjudged for o in some if o.verdict == "not judged")]), "")


def _facts(suite: "SuiteRun") -> dict[str, Any]:
    from bridgegen.jobs.suite.clauses import clause_results
    from bridgegen.jobs.suite.results import counts
    from bridgegen.jobs.suite.sentences import points_of

    return {
        "folder": str(suite.folder),
        "egos": list(suite.egos),
        "counts": {ego: counts(suite.of_ego(ego)) for ego in suite.egos},
        "points": {
            ego: {one.edition: [one.reached, one.most] for one in points_of(suite.of_ego(ego))}
            for ego in suite.egos
        },
        "clauses": [
            {"verdict": one.verdict, **asdict(one)}
            for ego in suite.egos
            for one in clause_results(suite.results, ego)
        ],
        "entries": [
            {
                "entry": one.entry,
                "ego": one.ego or one.driver,
                "verdict": one.verdict,
                "variations": len(one.rows),
                "failed": one.count("failed"),
                "not_judged": one.count("not judged"),
                "not_run": one.count("not run"),
                "unjudged": one.unjudged if one.verdict == "not judged" else None,
                "outcomes": one.outcomes(),
                "problem": one.problem or None,
                "status": suite.known_failures.status_of(one.entry),
                "standing": suite.known_failures.worst(one),
            }
            for one in suite.results
        ],
    }
