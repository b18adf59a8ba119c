"""The dashboard's page: failure modes, requirements, trends; one file without scripts."""

import os
from collections.abc import Iterable, Iterator, Sequence
from itertools import accumulate, groupby
from typing import Any
from urllib.parse import quote

from bridgegen.assess.criteria import margin_in_words
from bridgegen.jobs.dashboard.dashboard import GENERATOR, Dashboard
from bridgegen.jobs.dashboard.modes import OpenMode
from bridgegen.jobs.dashboard.odd import Coverage, Covered
from bridgegen.jobs.dashboard.requirements import Matrix, statements
from bridgegen.jobs.dashboard.results import Result, versions
from bridgegen.jobs.dashboard.results_of import SuiteLine
from bridgegen.jobs.dashboard.sentences import failing_sentence, requirements_sentence
from bridgegen.jobs.dashboard.taxonomy import SOURCE
from bridgegen.jobs.dashboard.trends import Series
from bridgegen.pages import charts, templates
from bridgegen.pages.sentences import share
from bridgegen.pages.templates import Cell, counted, joined, when
from bridgegen.results.failures import FILE

MOST_MODES = 500
"""Largest number of failure modes of a table; the others are counted."""
MOST_RESULTS = 5
"""Largest number of results of a failure mode that are linked."""
MOST_REQUIREMENTS, MOST_SCENARIOS = 40, 200
"""Largest numbers of columns and rows of a matrix; the gravest requirements."""
MOST_CELLS = 10_000
"""Largest number of cells of all matrices; the first matrix is always shown."""
MOST_CHARTS = 48
"""Largest number of charts: those that grew the most, then those with the largest share."""
MOST_ROWS = 2000
"""Largest number of rows of a table."""
MOST_PARAMETERS, MOST_BIN_ROWS = 60, 1000
"""Largest numbers of parameters of a scenario, and of all scenarios."""
OPEN_MATRICES, OPEN = 40, 12
"""Numbers of rows beyond which matrices, and other tables, are folded."""

Row = Sequence[object]
Table = dict[str, Any]
"""A table as the template shows it: its name, heads, rows, and how many rows are left out."""


def write_page(found: Dashboard) -> None:
    """Write the page, whole or not at all.

    Raises:
        StorageError: it cannot be written.
    """
    name = found.project.folder.name
    base = os.path.relpath(found.project.folder, found.page.resolve().parent).replace(os.sep, "/")
    again = [one for one in found.trends if len(one.points) > 1]
    partly = {one.partly for one in found.coverage.sceneries.values() if one.partly}
    templates.write_page(
        found.page, "jobs/dashboard/page.html",
        title=f"{name or 'project'}: dashboard", heading=name or "Project", generator=GENERATOR,
        facts=[*_facts(found)], problems=found.project.problems,
        lead=[one for one in (failing_sentence(found), requirements_sentence(found)) if one],
        file=FILE, notes=found.notes[:MOST_RESULTS],
        modes=_modes("Failure modes of current results", found.failing, base),
        before=_modes(
            "Failure modes of earlier results",
            [one for one in found.modes if not one.fails_now], base,
        ),
        unseen=_table(
            "Failure modes in no result", ("failure mode", "status", "scenario", "driver",
                                           "comment"),
            [[one.title or id, one.status, one.scenario, one.driver, one.comment]
             for id, one in found.unseen.items()], MOST_MODES,
        ),
        scenarios=joined(found.scenarios, 8) or "none",
        requirements=_requirements(found) if found.criteria else None,
        matrices=_matrices(found, base),
        versions=_versions(found),
        figures=[(one, chart(one, base)) for one in again[:MOST_CHARTS]],
        more_figures=len(again) - MOST_CHARTS,
        once=_once([one for one in found.trends if len(one.points) == 1], base),
        source=SOURCE, counts=found.coverage.counts,
        attributes=[*_attributes(found.coverage.attributes)], partly=sorted(partly),
        parameters=_parameters(found.coverage),
        results=[one for one in _results(found, base) if one["rows"]],
        unread=_table("What cannot be read", ("folder or scenario", "why"),
                      [[one.place, one.why] for one in found.project.problems]),
        open=OPEN,
    )  # fmt: skip


def _facts(found: Dashboard) -> Iterator[str]:
    for name, noun in (
        ("runs", "run"), ("suites", "suite"), ("maps", "preventability map"),
        ("comparisons", "comparison"), ("scenarios", "scenario"), ("drivers", "driver"),
        ("evaluations", "evaluation"),
    ):  # fmt: skip
        if found.figures[name]:
            yield counted(int(found.figures[name]), noun)


def _address(base: str, page: str) -> str:
    """Return the relative link to a page of the project's folder; "" where there is no page."""
    path = page if base == "." else f"{base}/{page}"
    return f"./{quote(path, errors='replace')}" if page else ""


def _table(
    name: str, heads: Sequence[str], rows: Sequence[Row], most: int = MOST_ROWS,
    kind: str = "list", title: str = "",
) -> Table:  # fmt: skip
    return {"name": name, "title": title or name, "heads": heads, "rows": rows[:most],
            "more": max(0, len(rows) - most), "kind": kind}  # fmt: skip


def _span(value: float, low: float, high: float) -> str | tuple[str, str]:
    """Return a share with its interval."""
    return share(value) if low == high else (share(value), f"{share(low)} to {share(high)}")


def within(sizes: Iterable[int], most: int) -> int:
    """Return how many parts fit, by their sizes; the first always does."""
    return max(1, sum(one <= most for one in accumulate(sizes)))


# --- Failure modes: what fails now, what failed before ---


def _modes(name: str, some: Sequence[OpenMode], base: str) -> Table:
    heads = ("failure mode", "status", "scenario", "driver", "evaluations", "MAIS3+", "last seen")
    return _table(name, heads, [_mode(one, base) for one in some], MOST_MODES)


def _mode(one: OpenMode, base: str) -> Row:
    notes = ["knife-edge: small changes make it vanish"] if one.knife_edge else []
    notes += [one.comment] if one.comment else []
    notes.append(one.key.id + (f" ({one.decided})" if one.decided else ""))
    more = len(one.results) - MOST_RESULTS
    return [
        Cell(one.title, notes),
        Cell("fixed, but fails again", kind="status regression")
        if one.is_regression
        else Cell(one.status, kind=f"status {one.status}"),
        one.key.scenario,
        (one.key.driver, joined(one.versions, 6)),
        one.count,
        share(one.severity) if one.severity else "–",
        Cell(
            when(one.results[0].time),
            links=[
                (_address(base, each.page), each.source, f"{each.source}: {one.title}")
                for each in one.results[:MOST_RESULTS]
            ],
            more=f" and {more:,} more" if more > 0 else "",
        ),
    ]


# --- Requirements: all of them, then a matrix of scenarios × requirements for each driver ---


def _requirements(found: Dashboard) -> Table:
    rows: list[Row] = []
    stated = statements(found.project.results)
    for one in found.criteria:
        violated = found.violated.get(one.id, [])
        who = "; ".join(f"{matrix.driver} in {joined(names, 3)}" for matrix, names in violated)
        state = Cell("met", kind="status fixed")
        if one.id in found.untested:
            state = Cell("tested by no scenario", kind="status untested")
        elif violated:
            state = Cell("violated", [who], kind="status regression")
        others = [each for each in stated.get(one.id, []) if each != one.states]
        notes = [f"stated otherwise in some results: {joined(others, 3)}"] if others else []
        words = Cell(one.text, notes, code=one.states)
        rows.append([Cell(one.id, kind="id"), words, one.severity, state])
    heads = ("id", "requirement", "severity", "state")
    return _table("Requirements", heads, rows, MOST_SCENARIOS, "list ids")


def _matrices(found: Dashboard, base: str) -> dict[str, Any]:
    some = found.requirements
    cells = (
        min(len(one.scenarios), MOST_SCENARIOS) * min(len(one.requirements), MOST_REQUIREMENTS)
        for one in some
    )
    fit = within(cells, MOST_CELLS)
    return {
        "tables": [_matrix(one, base) for one in some[:fit]],
        "more": max(0, len(some) - fit),
        "is_open": sum(len(one.scenarios) for one in some) <= OPEN_MATRICES,
    }


def _matrix(one: Matrix, base: str) -> Table:
    labels = joined([label for label in one.labels if label != one.driver], 3)
    violated = [each.id for each in one.requirements if one.violated(each.id)]
    words = one.driver + (f" ({labels})" if labels else "")
    words += f": violates {joined(violated)}" if violated else ": violates none"
    if one.without:
        words += f"; {counted(len(one.without), 'scenario')} without requirement"
    shown = one.requirements[:MOST_REQUIREMENTS]
    left = [
        f"{counted(len(all_) - most, noun)} left out"
        for all_, most, noun in (
            (one.requirements, MOST_REQUIREMENTS, "requirement"),
            (one.scenarios, MOST_SCENARIOS, "scenario"),
        )
        if len(all_) > most
    ]
    rows = [
        [
            (name, "without requirement" if name in one.without else ""),
            *(_verdict(one, name, each.id, base) for each in shown),
        ]
        for name in one.scenarios[:MOST_SCENARIOS]
    ]
    name, heads = f"Requirements of {one.driver} by scenario", [each.id for each in shown]
    return {**_table(name, ("scenario", *heads), rows, kind="matrix", title=words),
            "left": "; ".join(left)}  # fmt: skip


def _verdict(matrix: Matrix, scenario: str, requirement: str, base: str) -> Cell:
    cell = matrix.cell(scenario, requirement)
    if cell is None or cell.verdict == "unknown":
        return Cell("no result" if cell else "not tested", kind="muted")
    is_met, words = cell.verdict == "met", "met"
    if not is_met:
        words = f"{cell.violated:,} of {cell.met + cell.violated:,} violate"
    worst = "" if cell.worst is None else margin_in_words(cell.worst, cell.unit, 3)
    return Cell(
        words, [f"{'least' if is_met else 'worst'} {worst}"],
        kind="good" if is_met else "bad", before="✓ " if is_met else "✗ ",
        href=_address(base, cell.page), label=f"{requirement} in {scenario}: {words}",
    )  # fmt: skip


# --- Trends: versions, a chart for each series, and what was measured once ---


def chart(one: Series, base: str) -> str:
    """Return a series as a chart; a dot leads to its result's page."""
    points = [
        charts.Point(
            point.share, point.low, point.high, share(point.share), bool(point.count),
            f"{point.driver}, {when(point.time)} UTC: {share(point.share)} ({point.count:,} of "
            f"{point.of:,}); {point.source}",
            (point.version, point.driver), _address(base, point.page),
        )
        for point in one.points
    ]  # fmt: skip
    latest = ", ".join(f"{point.driver} {share(point.share)}" for point in one.points[-5:])
    return charts.trend(points, f"{one.measure} of {one.driver} in {one.title}: {latest}")


def _versions(found: Dashboard) -> Table:
    rows = []
    for _, some in sorted(versions(found.project.results).items()):
        for driver in some:
            of_it = [one for one in found.project.results if one.driver == driver]
            rows.append([
                driver.label, driver.version or "not known", when(min(one.time for one in of_it)),
                len({one.scenario for one in of_it}), sum(one.evaluations for one in of_it),
                len({failure.key for one in of_it for failure in one.failures}),
            ])  # fmt: skip
    heads = ("driver", "version", "first result (UTC)", "scenarios", "evaluations",
             "failure modes")  # fmt: skip
    return _table("Versions of drivers", heads, rows[-MOST_ROWS:])


def _once(some: list[Series], base: str) -> Table:
    rows = [
        [
            one.title, point.driver, one.measure, _span(point.share, point.low, point.high),
            f"{point.count:,} of {point.of:,}",
            Cell(point.source, href=_address(base, point.page)),
        ]
        for one in some
        for point in one.points
    ]  # fmt: skip
    title = f"Measured once: {counted(len(some), 'scenario and driver', 'pairs')}"
    heads = ("scenario or suite", "driver", "measure", "share", "count", "result")
    return _table("Measured once", heads, rows, title=title)


# --- The operational design domain: the taxonomy, then parameters ---


def _attributes(some: Iterable[Covered]) -> Iterator[tuple[str, list[tuple[str, Table, str]]]]:
    """Yield each part of the taxonomy in words, with its groups: name, table, what is left out."""
    for top, part in groupby(some, lambda one: one.attribute.path[0]):
        members = list(part)
        states = [_state(one) for one in members]
        covered, cannot = states.count("covered"), states.count("not expressible")
        words = f"{top}: {covered} of {len(members) - cannot} covered"
        words += f", {cannot} not expressible" if cannot else ""
        groups = groupby(members, lambda one: one.attribute.path[1:-1])
        yield words, [_group(" / ".join(path), list(each)) for path, each in groups]


def _state(one: Covered) -> str:
    if not one.attribute.expressible:
        return "not expressible"
    return "covered" if one.scenarios else "not covered"


def _group(name: str, some: list[Covered]) -> tuple[str, Table, str]:
    rows = [_attribute(one) for one in some if one.attribute.expressible]
    cannot = [
        one.attribute.path[-1] + (f" ({one.attribute.note})" if one.attribute.note else "")
        for one in some
        if not one.attribute.expressible
    ]
    table = _table(name, ("attribute", "evaluations", "covered by"), rows, kind="list odd")
    return name, table, "; ".join(cannot)


def _attribute(one: Covered) -> Row:
    state, note = _state(one), one.attribute.note
    kind, names = state.replace(" ", "-"), [f"{name} ({n:,})" for name, n in one.scenarios.items()]
    by = Cell(state, kind=kind)
    if names:
        by = Cell(joined(names, 2))
    elif one.unread:
        by = Cell(state, [f"not read of {counted(one.unread, 'scenario')}"], kind=kind)
    mark = "✓ " if state == "covered" else "○ "
    name = Cell(one.attribute.path[-1], [note] if note else [], mark=(mark, kind))
    return [name, one.evaluations, by]


def _parameters(of: Coverage) -> dict[str, Any]:
    sizes = (min(len(of.sceneries[name].parameters), MOST_PARAMETERS) for name in of.seen)
    fit = within(sizes, MOST_BIN_ROWS)
    names = [*of.seen]
    return {"tables": [_bins(of, name) for name in names[:fit]], "more": max(0, len(names) - fit)}


def _bins(of: Coverage, name: str) -> Table:
    """Return the bins of a scenario's parameters."""
    seen, rows = of.seen[name], []
    for one in of.sceneries[name].parameters:
        counts = seen.bins.get(one.name, [])
        unit = "" if one.unit in ("1", "count") else f" {one.unit}"
        outside = seen.outside.get(one.name, 0)
        rows.append([
            one.name, one.kind.span_text(one.low, one.high, "{:.4g}".format, unit),
            f"{sum(count > 0 for count in counts)} of {len(counts)}",
            (charts.strip(counts), f"{outside:,} outside" if outside else ""),
        ])  # fmt: skip
    bins = [count for counts in seen.bins.values() for count in counts]
    words = f"{name}: {counted(seen.evaluations, 'evaluation')}"
    if bins:
        words += f", {sum(n > 0 for n in bins):,} of {counted(len(bins), 'bin')}"
    heads = ("parameter", "declared", "bins met", "evaluations by bin")
    return _table(f"Parameters of {name}", heads, rows, MOST_PARAMETERS, title=words)


# --- All results, the latest first ---


def _results(found: Dashboard, base: str) -> Iterator[Table]:
    project = found.project
    runs = sorted(project.runs, key=lambda one: (-one.time, one.source))
    suites = sorted(project.suites, key=lambda one: (-one.time, one.source))
    compared = [one for one in suites if one.difference]
    for title, heads, rows in (
        (
            counted(len(runs), "run"),
            ("run", "scenario", "driver", "evaluations", "harmful", "of the space",
             "changed (UTC)"),
            [_run(one, base) for one in runs],
        ),
        (
            counted(len(suites), "suite"),
            ("suite", "drivers", "scenarios", "not judged", "variations", "fail", "not run",
             "changed (UTC)"),
            [_suite(one, base) for one in suites],
        ),
        (
            counted(len(compared), "difference of two drivers", "differences of two drivers"),
            ("suite", "first driver", "second driver", "only the first fails",
             "only the second fails", "both fail", "both pass", "by chance"),
            [_difference(one, base) for one in compared],
        ),
        (
            counted(len(project.maps), "preventability map"),
            ("map", "scenario", "driver", "cells", "avoided", "not avoided though preventable",
             "not preventable"),
            [*_maps(found, base)],
        ),
        (
            counted(len(project.comparisons), "comparison of algorithms",
                    "comparisons of algorithms"),
            ("comparison", "scenarios", "algorithms", "runs"),
            [
                [Cell(one.source, href=_address(base, one.page)), joined(one.scenarios),
                 joined(one.algorithms), one.runs]
                for one in project.comparisons
            ],
        ),
    ):  # fmt: skip
        yield _table(title, heads, rows)


def _run(one: Result, base: str) -> Row:
    space = one.space
    is_known = space is not None and space.share is not None and not one.unjudged
    return [
        Cell(one.source, [] if one.finished else ["not finished"], href=_address(base, one.page)),
        one.scenario,
        (one.driver.label, f"worse than {one.worse_than}" if one.worse_than else ""),
        one.evaluations,
        "not judged" if one.unjudged else one.failed if space or one.worse_than else "–",
        _span(space.share or 0.0, space.low, space.high) if space and is_known else "–",
        when(one.time),
    ]


def _suite(one: SuiteLine, base: str) -> Row:
    return [
        Cell(one.source, href=_address(base, one.page)),
        joined(one.egos),
        len({each.entry for each in one.results}),
        len({each.entry for each in one.results if each.unjudged}),
        *(sum(getattr(each, name) for each in one.results)
          for name in ("evaluations", "failed", "lost")),
        when(one.time),
    ]  # fmt: skip


def _difference(one: SuiteLine, base: str) -> Row:
    found = one.difference
    assert found is not None
    return [
        Cell(one.source, href=_address(base, one.page)), found.first, found.second,
        *(found.counts[name] for name in ("fixed", "broken", "both fail", "both pass")),
        f"p = {found.p_value:.2g}",
    ]  # fmt: skip


def _maps(found: Dashboard, base: str) -> Iterator[Row]:
    for one in found.project.maps:
        href = _address(base, one.page)
        if not one.scenario:
            yield [Cell(one.source, ["not finished"], href=href), *[""] * 6]
            continue
        for each in one.drivers:
            numbers = (each.avoided, each.preventable, each.unpreventable)
            yield [
                Cell(one.source, href=href), one.scenario, each.driver, one.cells,
                *((n, share(n / each.judged)) if each.judged else "–" for n in numbers),
            ]  # fmt: skip
