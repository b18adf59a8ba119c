"""The dashboard's lists of results, and its part on the operational design domain."""

from collections.abc import Sequence
from itertools import groupby

from bridgegen.jobs.dashboard.charts import strip
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
    within,
)
from bridgegen.jobs.dashboard.odd import Coverage, Covered
from bridgegen.jobs.dashboard.results import Result
from bridgegen.jobs.dashboard.results_of import SuiteLine
from bridgegen.jobs.dashboard.taxonomy import SOURCE
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


# --- The page's part on the operational design domain: the taxonomy, then parameters ---


SIZE = 1_000_000
"""Characters of the parameters of all scenarios."""

MOST_PARAMETERS = 60

_MARK = {"covered": "✓", "not covered": "○"}


def odd_part(found: Dashboard) -> str:
    """Return the section."""
    of = found.coverage
    covered, open_, cannot = of.counts
    lead = (
        f"Attributes of {SOURCE}: {covered} are covered by a scenario, {open_} are not covered, "
        f"{cannot} are not expressible in BridgeGen. Evaluations of runs and variations of suites "
        "count, with whatever driver; the cells of preventability maps do not. A covered attribute "
        "occurs; nothing says that it occurs often enough."
    )
    tree = "".join(
        folded(_summary(top, some), _groups(some), is_open=True)
        for top, some in _by(list(of.attributes), 0)
    )
    partly = sorted({one.partly for name, one in of.sceneries.items() if one.partly})
    notes = "".join(f'<p class="muted">Not read of some scenarios: {text(one)}.</p>'
                    for one in partly)  # fmt: skip
    parts = [tree + notes]
    if of.seen:
        parts.append(_parameters(of))
    return section("odd", "Coverage of the operational design domain", *parts, lead=lead)


def _by(some: list[Covered], level: int) -> list[tuple[str, list[Covered]]]:
    return [(key, list(each)) for key, each in groupby(some, lambda one: one.attribute.path[level])]


def _state(one: Covered) -> str:
    if not one.attribute.expressible:
        return "not expressible"
    return "covered" if one.scenarios else "not covered"


def _summary(name: str, some: list[Covered]) -> str:
    states = [_state(one) for one in some]
    covered, cannot = states.count("covered"), states.count("not expressible")
    words = f"{name}: {covered} of {len(some) - cannot} covered"
    return words + (f", {cannot} not expressible" if cannot else "")


def _groups(some: list[Covered]) -> str:
    body = []
    for path, each in groupby(some, lambda one: one.attribute.path[1:-1]):
        members = list(each)
        rows = [_row(one) for one in members if one.attribute.expressible]
        name = " / ".join(path)
        heads = ("attribute", "evaluations", "covered by")
        lines = table(name, heads, rows, "list odd") if rows else ""
        body.append(f'<div class="group"><h3>{text(name)}</h3>{lines}{_cannot(members)}</div>')
    return f'<div class="groups">{"".join(body)}</div>'


def _cannot(some: list[Covered]) -> str:
    """Return the attributes of a group that are not expressible, in a line."""
    names = [
        one.attribute.path[-1] + (f" ({one.attribute.note})" if one.attribute.note else "")
        for one in some
        if not one.attribute.expressible
    ]
    words = f"Not expressible: {'; '.join(names)}."
    return f'<p class="not-expressible">{text(words)}</p>' if names else ""


def _row(one: Covered) -> list[str]:
    state, attribute = _state(one), one.attribute
    note = f"<small>{text(attribute.note)}</small>" if attribute.note else ""
    names = [f"{name} ({count:,})" for name, count in one.scenarios.items()]
    kind = state.replace(" ", "-")
    mark = f'<span class="{kind}" aria-hidden="true">{_MARK[state]}</span>'
    by = text(joined(names, 2)) if names else f'<span class="{kind}">{state}</span>'
    if one.unread and not names:
        by += f"<small>not read of {counted(one.unread, 'scenario')}</small>"
    return [f"{mark} {text(attribute.path[-1])}{note}", f"{one.evaluations:,}", by]


def _parameters(of: Coverage) -> str:
    scenarios = (
        folded(f"{name}: {_in_words(of, name)}", _of_scenario(of, name)) for name in of.seen
    )
    lead = (
        '<h3>By parameter</h3><p class="muted">The declared range of each parameter in bins, the '
        "darker the more evaluations; an outlined bin has none. A bin may be empty because the "
        "scenario's constraints leave nothing there.</p>"
    )
    return lead + within(scenarios, SIZE, "scenario")


def _in_words(of: Coverage, name: str) -> str:
    seen = of.seen[name]
    bins = [count for counts in seen.bins.values() for count in counts]
    met = sum(count > 0 for count in bins)
    words = counted(seen.evaluations, "evaluation")
    return f"{words}, {met:,} of {counted(len(bins), 'bin')}" if bins else words


def _of_scenario(of: Coverage, name: str) -> str:
    seen, scenery = of.seen[name], of.sceneries[name]
    rows = []
    for one in scenery.parameters[:MOST_PARAMETERS]:
        counts = seen.bins.get(one.name, [])
        unit = "" if one.unit in ("1", "count") else f" {one.unit}"
        declared = one.kind.span_text(one.low, one.high, "{:.4g}".format, unit)
        outside = seen.outside.get(one.name, 0)
        more = f"<small>{outside:,} outside</small>" if outside else ""
        met = sum(count > 0 for count in counts)
        rows.append(
            [text(one.name), text(declared), f"{met} of {len(counts)}", strip(counts) + more]
        )
    heads = ("parameter", "declared", "bins met", "evaluations by bin")
    left = len(scenery.parameters) - len(rows)
    after = f'<p class="muted">and {counted(left, "parameter")} more</p>' if left > 0 else ""
    return table(f"Parameters of {name}", heads, rows) + after
