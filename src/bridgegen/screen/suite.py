"""A suite: one bar for all its entries, then its table; the difference of two egos."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from rich.table import Table

from bridgegen.screen.live import Live

if TYPE_CHECKING:
    from bridgegen.suite.difference import Difference
    from bridgegen.suite.results import EntryResult
    from bridgegen.suite.suite import SuiteCallbacks, SuiteRun

MOST_ROWS = 40
"""Entries of the table; those that pass are left out first."""


class SuiteScreen(Live):
    """The live progress of a suite."""

    def __init__(self) -> None:
        super().__init__()
        self._entries = self._done = self._failed = self._lost = 0

    @property
    def callbacks(self) -> "SuiteCallbacks":
        """The callbacks for ``run_suite``."""
        from bridgegen.suite.suite import SuiteCallbacks

        return SuiteCallbacks(begun=self._begin, ended=self._end)

    def _begin(self, entries: int, done: int) -> None:
        self.say_compiling()
        self._entries, self._done = entries, done
        self._show()

    def _end(self, result: "EntryResult") -> None:
        self._done += 1
        self._failed += result.verdict == "failed"
        self._lost += result.verdict == "not run"
        self._show()

    def _show(self) -> None:
        facts = f"{self._failed} failed" + (f", {self._lost} not run" if self._lost else "")
        self.show(what="scenarios", done=self._done, total=self._entries, facts=facts)


def print_suite(suite: "SuiteRun", seconds: float, page: Path, *, as_json: bool = False) -> None:
    """Print the entries that fail or did not run, others if there is room; then the totals."""
    from bridgegen.suite.results import counts

    if as_json:
        print(json.dumps(_facts(suite), indent=2, ensure_ascii=False))
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
        console.width = 160
    console.print(table)
    if len(by_entry) > len(listed):
        print(f"and {len(by_entry) - len(listed)} more")
    print()
    for ego in suite.egos:
        results = suite.of_ego(ego)
        number = counts(results)
        entries = sum(one.verdict == "passed" for one in results)
        print(
            f"{ego or 'the own drivers'}: {entries} of {len(results)} scenarios pass; of their "
            f"variations {number['passed']} pass, {number['failed']} fail, "
            f"{number['not run']} did not run"
        )
        _print_standing(suite, ego)
    if gone := suite.baseline.gone(suite.results):
        print(f"not there any more, set their status to fixed: {', '.join(gone)}")
    print(f"page: {page} ({seconds:.1f} s)")


def _print_standing(suite: "SuiteRun", ego: str) -> None:
    """Print how the failures of an ego stand, where indexes name some."""
    results = suite.of_ego(ego)
    if sentence := suite.baseline.sentence(results):
        print(f"  {sentence}")
    for id in suite.baseline.regressions(results):
        print(f"  regression: {id} was fixed, and fails again")


def print_difference(found: "Difference", page: Path, *, as_json: bool = False) -> None:
    """Print what is broken and fixed from the first ego to the second."""
    counts = found.counts
    if as_json:
        facts: dict[str, Any] = {
            "first": found.first,
            "second": found.second,
            "counts": counts,
            "p_value": found.p_value,
            "rows": [vars(one) for one in found.rows if one.change in ("broken", "fixed")],
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
        console.width = 160
    if changed:
        console.print(table)
        print()
    n = len(found.rows) - counts["not comparable"]
    print(f"{found.second} against {found.first}, {n} variations")
    for change in ("broken", "fixed"):
        low, high = found.interval(change)
        print(f"  {change:<16}{counts[change]} ({low:.2%} to {high:.2%} with 95 % confidence)")
    print(f"  {'both fail':<16}{counts['both fail']}")
    print(f"  {'both pass':<16}{counts['both pass']}")
    if counts["not comparable"]:
        print(f"  {'not comparable':<16}{counts['not comparable']}")
    print(f"  {'by chance':<16}p = {found.p_value:.3g} (McNemar's exact test)")
    print(f"page: {page}")


def _verdict(suite: "SuiteRun", one: "EntryResult") -> str:
    from bridgegen.suite.baseline import words

    said = words(suite.baseline.worst(one), suite.baseline.failures.get(one.entry))
    return f"{_counted(one)} ({said})" if said else _counted(one)


def _counted(one: "EntryResult") -> str:
    if one.problem:
        return "not run"
    n = len(one.rows)
    failed, lost = one.count("failed"), one.count("not run")
    if not failed and not lost:
        return "pass" if n == 1 else f"pass ({n})"
    parts = ([f"{failed} of {n} fail"] if failed else []) + ([f"{lost} not run"] if lost else [])
    return ", ".join(parts)


def _worst(some: Sequence["EntryResult"]) -> str:
    """Return the worst thing that happens in an entry."""
    for one in some:
        if one.worst is not None:
            row = one.rows[one.worst]
            violated = ", ".join(str(one.criteria[i]["id"]) for i in row.violated)
            texts = [f"{row.conflict} with {row.partner}"] if row.critical and row.conflict else []
            texts += [f"MAIS3+ {row.severity:.2%}"] if row.severity else []
            texts += [f"violates {violated}"] if violated else []
            return "; ".join(texts)
    lost = [one.problem or next((r.problem for r in one.rows if r.problem), "") for one in some]
    return next(filter(None, lost), "")


def _facts(suite: "SuiteRun") -> dict[str, Any]:
    from bridgegen.suite.results import counts

    return {
        "folder": str(suite.folder),
        "egos": list(suite.egos),
        "counts": {ego: counts(suite.of_ego(ego)) for ego in suite.egos},
        "entries": [
            {
                "entry": one.entry,
                "ego": one.ego or one.driver,
                "verdict": one.verdict,
                "variations": len(one.rows),
                "failed": one.count("failed"),
                "not_run": one.count("not run"),
                "problem": one.problem or None,
                "status": suite.baseline.status_of(one.entry),
                "standing": suite.baseline.worst(one),
            }
            for one in suite.results
        ],
    }
