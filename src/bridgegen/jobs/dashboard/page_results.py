"""The page's part that lists all results: runs, suites, maps, comparisons; and what is damaged."""

from collections.abc import Sequence

from bridgegen.jobs.dashboard.dashboard import Dashboard
from bridgegen.jobs.dashboard.markup import (
    counted,
    folded,
    joined,
    link,
    section,
    span,
    table,
    text,
    when,
)
from bridgegen.jobs.dashboard.of_suites import SuiteLine
from bridgegen.jobs.dashboard.results import Result
from bridgegen.pages.sentences import share

MOST_ROWS = 2000
"""Rows of a table."""

_OPEN = 12
"""Tables with more rows are folded."""


def results_part(found: Dashboard, base: str) -> str:
    """Return the section that lists all results, the latest first."""
    project = found.project
    runs = sorted(project.runs, key=lambda one: (-one.time, one.source))
    suites = sorted(project.suites, key=lambda one: (-one.time, one.source))
    parts = [
        _folded(
            "run", ("run", "scenario", "driver", "evaluations", "harmful", "of the space",
                    "changed (UTC)"),
            [_run(one, base) for one in runs],
        ),
        _folded(
            "suite", ("suite", "drivers", "scenarios", "not judged", "variations", "fail",
                      "not run", "changed (UTC)"),
            [_suite(one, base) for one in suites],
        ),
        _folded(
            "difference of two drivers", ("suite", "first driver", "second driver",
                                          "only the first fails", "only the second fails",
                                          "both fail", "both pass", "by chance"),
            [_difference(one, base) for one in suites if one.difference],
            "differences of two drivers",
        ),
        _folded(
            "preventability map", ("map", "scenario", "driver", "cells", "avoided",
                                   "not avoided though preventable", "not preventable"),
            [row for one in project.maps for row in _maps(found, one.source, base)],
            rows_are=len(project.maps),
        ),
        _folded(
            "comparison of algorithms", ("comparison", "scenarios", "algorithms", "runs"),
            [
                [link(base, one.page, one.source), text(joined(one.scenarios)),
                 text(joined(one.algorithms)), f"{one.runs:,}"]
                for one in project.comparisons
            ],
            "comparisons of algorithms",
        ),
    ]  # fmt: skip
    return section("results", "All results", *parts)


def problems_part(found: Dashboard) -> str:
    """Return the section on what cannot be read; nothing where there is nothing."""
    problems = found.project.problems
    if not problems:
        return ""
    rows = [[text(one.place), text(one.why)] for one in problems[:MOST_ROWS]]
    body = table("What cannot be read", ("folder or scenario", "why"), rows)
    return section("problems", "Not read", body)


def _folded(
    noun: str,
    heads: Sequence[str],
    rows: list[list[str]],
    many: str = "",
    rows_are: int | None = None,
) -> str:
    if not rows:
        return ""
    name = counted(len(rows) if rows_are is None else rows_are, noun, many)
    more = len(rows) - MOST_ROWS
    after = f'<p class="muted">and {more:,} more</p>' if more > 0 else ""
    body = table(name, heads, rows[:MOST_ROWS]) + after
    return folded(name, body, is_open=len(rows) <= _OPEN)


def _run(one: Result, base: str) -> list[str]:
    space = one.space
    known = space is not None and space.share is not None
    return [
        link(base, one.page, one.source) + ("" if one.finished else "<small>not finished</small>"),
        text(one.scenario),
        text(one.driver.label)
        + (f"<small>worse than {text(one.worse_than)}</small>" if one.worse_than else ""),
        f"{one.evaluations:,}",
        "not judged" if one.unjudged else f"{one.failed:,}" if space or one.worse_than else "–",
        span(space.share or 0.0, space.low, space.high)
        if space and known and not one.unjudged
        else "–",
        when(one.time),
    ]


def _suite(one: SuiteLine, base: str) -> list[str]:
    entries = {each.entry for each in one.results}
    sums = [sum(getattr(each, name) for each in one.results)
            for name in ("evaluations", "failed", "lost")]  # fmt: skip
    return [
        link(base, one.page, one.source),
        text(joined(one.egos)),
        f"{len(entries):,}",
        f"{len({each.entry for each in one.results if each.unjudged}):,}",
        *(f"{number:,}" for number in sums),
        when(one.time),
    ]


def _difference(one: SuiteLine, base: str) -> list[str]:
    found = one.difference
    assert found is not None
    counts = found.counts
    return [
        link(base, one.page, one.source),
        text(found.first),
        text(found.second),
        *(f"{counts[name]:,}" for name in ("fixed", "broken", "both fail", "both pass")),
        f"p = {found.p_value:.2g}",
    ]


def _maps(found: Dashboard, source: str, base: str) -> list[list[str]]:
    one = next(each for each in found.project.maps if each.source == source)
    target = link(base, one.page, one.source)
    if not one.scenario:
        return [[f"{target}<small>not finished</small>", "", "", "", "", "", ""]]
    return [
        [
            target,
            text(one.scenario),
            text(each.driver),
            f"{one.cells:,}",
            *(
                f"{number:,} <small>{text(share(number / each.judged))}</small>"
                if each.judged
                else "–"
                for number in (each.avoided, each.preventable, each.unpreventable)
            ),
        ]
        for each in one.drivers
    ]
