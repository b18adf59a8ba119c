"""The dashboard's page: failure modes, requirements, trends; one file without scripts."""

import os
import shlex
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import accumulate, groupby
from typing import Any
from urllib.parse import quote

from bridgegen.assess.criteria import margin_in_words
from bridgegen.base.disk import write_whole
from bridgegen.base.statistics import clopper_pearson
from bridgegen.jobs.dashboard.crash_types import TypeStanding
from bridgegen.jobs.dashboard.dashboard import GENERATOR, Dashboard
from bridgegen.jobs.dashboard.modes import OpenMode
from bridgegen.jobs.dashboard.odd import SOURCE, Coverage, Covered
from bridgegen.jobs.dashboard.of_odd import ProjectOdd
from bridgegen.jobs.dashboard.requirements import Matrix, statements
from bridgegen.jobs.dashboard.results import Result, versions
from bridgegen.jobs.dashboard.results_of import SuiteLine
from bridgegen.jobs.dashboard.sentences import failing_sentence, requirements_sentence
from bridgegen.jobs.dashboard.trends import Series
from bridgegen.jobs.dashboard.verdicts import Standing, Step, Verdict, history, is_rare, standings
from bridgegen.pages import charts, templates
from bridgegen.pages.sentences import share
from bridgegen.pages.templates import Banner, Cell, counted, joined, when
from bridgegen.pages.thumbnails import Thumbnail, drawn, read_thumbnails
from bridgegen.results.failures import FILE
from bridgegen.scenario.odd.coverage import OddAttribute
from bridgegen.scenario.typology import CrashType, most_harmful, named, shares

MOST_MODES = 300
"""Largest number of failure modes of a table; the others are counted."""
MOST_RESULTS = 3
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
MOST_TRIED, MOST_DRIVERS = 100, 20
"""Largest numbers of scenarios and drivers of the matrix of verdicts; what fails comes first."""
MOST_PICTURES, FEW = 60, 8
"""Largest number of its pictures, and number of scenarios from which on they are smaller."""
LARGE, SMALL = (150, 92), (96, 59)
"""Sizes of them [pixels]."""
MOST_STEPS, MOST_HISTORIES = 12, 24
"""Largest numbers of versions of a driver, the latest, and of drivers that charts show."""
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
    write_whole(found.page, [page_of(found)])


def page_of(found: Dashboard, **served: Any) -> bytes:
    """Return the page.

    Args:
        found: what it shows.
        served: further values of the template where ``bridgegen open`` serves it.
    """
    name = found.project.folder.name
    base = os.path.relpath(found.project.folder, found.page.resolve().parent).replace(os.sep, "/")
    again = [trend for trend in found.trends if len(trend.points) > 1]
    partly = {scenery.partly for scenery in found.coverage.sceneries.values() if scenery.partly}
    return templates.page(
        "jobs/dashboard/page.html",
        title=f"{name or 'project'}: dashboard",
        heading=name or "Project",
        generator=GENERATOR,
        facts=[*_facts(found)],
        problems=found.project.problems,
        verdict=banner(found) if served else replace(banner(found), command=_next(found)),
        file=FILE,
        verdicts=verdicts_table(found, base),
        types=_types(found, base),
        histories=_histories(found),
        notes=found.notes[:MOST_RESULTS],
        modes=modes_table("Failure modes of current results", found.failing, base),
        before=modes_table(
            "Failure modes of earlier results",
            [mode for mode in found.modes if not mode.fails_now],
            base,
        ),
        unseen=_table(
            "Failure modes in no result",
            ("failure mode", "status", "scenario", "driver", "comment"),
            [
                [
                    failure.title or id,
                    failure.status,
                    failure.scenario,
                    failure.driver,
                    failure.comment,
                ]
                for id, failure in found.unseen.items()
            ],
            MOST_MODES,
        ),
        scenarios=joined(found.scenarios, 8) or "none",
        requirements=_requirements(found) if found.criteria else None,
        matrices=_matrices(found, base),
        versions=_versions(found),
        figures=[(series, chart(series, base)) for series in again[:MOST_CHARTS]],
        more_figures=len(again) - MOST_CHARTS,
        once=_once([trend for trend in found.trends if len(trend.points) == 1], base),
        source=SOURCE,
        counts=found.coverage.counts,
        covered="Taxonomy: {} covered, {} not covered, {} not expressible".format(
            *found.coverage.counts
        ),
        of_odd=_of_odd(found.project.odd),
        attributes=[*_attributes(found.coverage.attributes)],
        partly=sorted(partly),
        parameters=_parameters(found.coverage),
        results=[result for result in _results(found, base) if result["rows"]],
        unread=_table(
            "What cannot be read",
            ("folder or scenario", "why"),
            [[problem.place, problem.why] for problem in found.project.problems],
        ),
        open=OPEN,
        **served,
    )


def _next(found: Dashboard) -> str:
    """Return the command that plays what fails, and sets its status."""
    return shlex.join(["bridgegen", "open", str(found.project.folder)]) if found.failing else ""


def banner(found: Dashboard) -> Banner:
    """Return the verdict on the project."""
    types = found.crash_types
    # Of several drivers, the section has a sentence each.
    weighed = types.sentence(types.drivers[0]) if types and len(types.drivers) == 1 else ""
    sentences = (failing_sentence(found), weighed, requirements_sentence(found))
    text = " ".join(filter(None, sentences))
    if found.failing or found.violated or found.rare:
        return Banner(text, "fails", "FAILS")
    unsure = found.project.problems or any(
        result.unjudged or not result.finished for result in found.project.results
    )
    if unsure or not found.project.results:
        return Banner(text, "open", "NOT JUDGED" if found.project.results else "")
    return Banner(text, "passes", "NO FAILURE FOUND")


def _facts(found: Dashboard) -> Iterator[str]:
    for name, noun in (
        ("runs", "run"),
        ("suites", "suite"),
        ("maps", "preventability map"),
        ("comparisons", "comparison"),
        ("scenarios", "scenario"),
        ("drivers", "driver"),
        ("evaluations", "evaluation"),
    ):
        if found.figures[name]:
            yield counted(int(found.figures[name]), noun)


def _address(base: str, page: str) -> str:
    """Return the relative link to a page of the project's folder; "" where there is no page."""
    path = page if base == "." else f"{base}/{page}"
    return f"./{quote(path, errors='replace')}" if page else ""


def _table(
    name: str,
    heads: Sequence[str],
    rows: Sequence[Row],
    most: int = MOST_ROWS,
    kind: str = "list",
    title: str = "",
) -> Table:
    return {
        "name": name,
        "title": title or name,
        "heads": heads,
        "rows": rows[:most],
        "more": max(0, len(rows) - most),
        "kind": kind,
    }


def _span(value: float, low: float, high: float) -> str | tuple[str, str]:
    """Return a share with its interval."""
    return share(value) if low == high else (share(value), f"{share(low)} to {share(high)}")


def within(sizes: Iterable[int], most: int) -> int:
    """Return how many parts fit, by their sizes; the first always does."""
    return max(1, sum(number <= most for number in accumulate(sizes)))


# --- The first screen: a verdict for each scenario and driver ---

_MARKS: dict[Verdict, tuple[str, str]] = {
    "fails": ("✕ ", "bad"),
    "no failure found": ("✓ ", "good"),
    "not judged": ("? ", "open"),
    "never tried": ("○ ", "muted"),
}


def verdicts_table(found: Dashboard, base: str) -> dict[str, Any]:
    """Return the matrix of scenarios and drivers, with pictures of the gravest failures.

    Its links begin with ``base``.
    """
    stands = standings(found.project.results, found.failing)
    failures = {
        key: len(standing.modes) or int(standing.verdict == "fails")
        for key, standing in stands.items()
    }

    def ordered(axis: int) -> list[str]:
        names = {key[axis] for key in stands}
        fails = {name: sum(n for key, n in failures.items() if key[axis] == name) for name in names}
        return sorted(names, key=lambda name: (-fails[name], name))

    scenarios, drivers = ordered(0), ordered(1)
    rows, heads = scenarios[:MOST_TRIED], drivers[:MOST_DRIVERS]
    has_modes = {key for key, standing in stands.items() if standing.modes}
    shown = [(row, head) for row in rows for head in heads if (row, head) in has_modes]
    shown.sort(key=lambda key: -stands[key].modes[0].severity)
    kept = {key: _picture_of(found, stands[key]) for key in shown[:MOST_PICTURES]}
    is_small = len(rows) > FEW
    size = SMALL if is_small else LARGE
    pictures = {
        key: drawn(picture, f"t{i}", size)
        for i, (key, picture) in enumerate(kept.items())
        if picture is not None
    }
    cells: list[Row] = []
    for scenario in rows:
        row: list[object] = [scenario]
        for driver in heads:
            standing = stands.get((scenario, driver), Standing("never tried"))
            picture = pictures.get((scenario, driver), "")
            # A small picture has its words where the pointer is: more scenarios are on one screen.
            is_brief = is_small and bool(picture)
            cell = _standing(standing, f"{driver} in {scenario}", base, is_brief=is_brief)
            row.append(replace(cell, picture=picture))
        cells.append(row)
    left = [
        f"{counted(number, noun)} left out"
        for number, noun in (
            (len(scenarios) - len(rows), "scenario"),
            (len(drivers) - len(heads), "driver"),
            (len(shown) - MOST_PICTURES, "picture"),
        )
        if number > 0
    ]
    table = _table("Verdicts by scenario and driver", ("scenario", *heads), cells, kind="verdicts")
    return {**table, "left": ", ".join(left), "pictures": len(pictures)}


def _standing(standing: Standing, where: str, base: str, *, is_brief: bool) -> Cell:
    words, text, note = standing.verdict, str(standing.verdict), ""
    if standing.modes:
        text = f"FAILS, {counted(len(standing.modes), 'mode')}"
        severity = standing.modes[0].severity
        # In short: who is responsible, and why, is in the table of failure modes.
        title = "" if is_brief else standing.modes[0].title.partition(" (")[0]
        note = " · ".join(filter(None, (title, f"MAIS3+ {share(severity)}" if severity else "")))
    elif words == "fails":
        space = next(result.space for result in standing.results if is_rare(result))
        text, note = (
            "FAILS rarely",
            f"{space.harmful} of {space.rows} random draws" if space else "",
        )
    worst = standing.worst
    href = _address(base, worst.page) if worst is not None else ""
    mark = _MARKS[words]
    label, notes = f"{where}: {text}", [note] if note else []
    return Cell(text, notes, kind=mark[1], href=href, label=label, mark=mark)


def _picture_of(found: Dashboard, standing: Standing) -> Thumbnail | None:
    """Return what is kept with the results of the gravest mode, the latest first."""
    folder = found.project.folder
    for result in standing.modes[0].results[:MOST_RESULTS]:
        for picture in read_thumbnails(folder / result.source):
            if (picture.entry, picture.ego) == (result.entry, result.ego):
                return picture
    return None


def _types(found: Dashboard, base: str) -> dict[str, Any] | None:
    """Return the matrix of types of crashes and drivers; None where few scenarios were tried."""
    types = found.crash_types
    if types is None:
        return None
    drivers = types.drivers[:MOST_DRIVERS]
    rows = [
        [
            (kind.name, shares([kind]).removeprefix(", with ")),
            *(_of_type(kind, each[driver], driver, base) for driver in drivers),
        ]
        for kind, each in types.lines
    ]
    heads = ("type of crash", *drivers)
    return {
        "table": _table("Verdicts by type of crash and driver", heads, rows, kind="verdicts"),
        "said": [types.sentence(driver) for driver in drivers],
        "limits": types.limits,
        "typology": types.typology,
        "untried": [*map(named, most_harmful(types.untried))],
    }


def _of_type(kind: CrashType, standing: TypeStanding, driver: str, base: str) -> Cell:
    text, worst = str(standing.verdict), standing.worst
    notes = [joined(standing.scenarios, 3)] if standing.scenarios else []
    if standing.modes:
        fails = {mode.key.scenario for mode in standing.modes}
        passes = [name for name in standing.scenarios if name not in (*fails, *standing.otherwise)]
        text = f"FAILS in {len(fails)} of {counted(len(standing.scenarios), 'scenario')}"
        severity = standing.modes[0].severity
        notes = [joined(sorted(fails), 3) + (f", not in {joined(passes, 2)}" if passes else "")]
        notes += [f"worst MAIS3+ {share(severity)}"] if severity else []
    elif standing.otherwise:
        notes = [f"other or rare failures alone in {joined(standing.otherwise, 3)}"]
    mark = _MARKS[standing.verdict]
    label = f"{driver}, {kind.name}: {text}"
    href = _address(base, worst.page) if worst is not None else ""
    return Cell(text, notes, kind=mark[1], href=href, label=label, mark=mark)


# --- Failure modes: what fails now, what failed before ---


def modes_table(name: str, some: Sequence[OpenMode], base: str) -> Table:
    """Return failure modes as a table; its links begin with ``base``."""
    heads = ("failure mode", "status", "scenario", "driver", "evaluations", "MAIS3+", "last seen")
    return _table(name, heads, [_mode(mode, base) for mode in some], MOST_MODES)


def _mode(open_mode: OpenMode, base: str) -> Row:
    notes = ["knife-edge: small changes make it vanish"] if open_mode.knife_edge else []
    notes += [open_mode.comment] if open_mode.comment else []
    notes.append(open_mode.key.id + (f" ({open_mode.decided})" if open_mode.decided else ""))
    more = len(open_mode.results) - MOST_RESULTS
    return [
        Cell(open_mode.title, notes),
        Cell("fixed, but fails again", kind="status regression", mode=open_mode.key.id)
        if open_mode.is_regression
        else Cell(open_mode.status, kind=f"status {open_mode.status}", mode=open_mode.key.id),
        open_mode.key.scenario,
        (open_mode.key.driver, joined(open_mode.versions, 6)),
        open_mode.count,
        share(open_mode.severity) if open_mode.severity else "–",
        Cell(
            when(open_mode.results[0].time),
            links=[
                (_address(base, each.page), each.source, f"{each.source}: {open_mode.title}")
                for each in open_mode.results[:MOST_RESULTS]
            ],
            more=f" and {more:,} more" if more > 0 else "",
        ),
    ]


# --- Requirements: all of them, then a matrix of scenarios × requirements for each driver ---


def _requirements(found: Dashboard) -> Table:
    rows: list[Row] = []
    stated = statements(found.project.results)
    for criterion in found.criteria:
        violated = found.violated.get(criterion.id, [])
        who = "; ".join(f"{matrix.driver} in {joined(names, 3)}" for matrix, names in violated)
        state = Cell("met", kind="status fixed")
        if criterion.id in found.untested:
            state = Cell("tested by no scenario", kind="status untested")
        elif violated:
            state = Cell("violated", [who], kind="status regression")
        others = [each for each in stated.get(criterion.id, []) if each != criterion.states]
        notes = [f"stated otherwise in some results: {joined(others, 3)}"] if others else []
        words = Cell(criterion.text, notes, code=criterion.states)
        rows.append([Cell(criterion.id, kind="id"), words, criterion.severity, state])
    heads = ("id", "requirement", "severity", "state")
    return _table("Requirements", heads, rows, MOST_SCENARIOS, "list ids")


def _matrices(found: Dashboard, base: str) -> dict[str, Any]:
    some = found.requirements
    cells = (
        min(len(matrix.scenarios), MOST_SCENARIOS)
        * min(len(matrix.requirements), MOST_REQUIREMENTS)
        for matrix in some
    )
    fit = within(cells, MOST_CELLS)
    return {
        "tables": [_matrix(matrix, base) for matrix in some[:fit]],
        "more": max(0, len(some) - fit),
        "is_open": sum(len(matrix.scenarios) for matrix in some) <= OPEN_MATRICES,
    }


def _matrix(matrix: Matrix, base: str) -> Table:
    labels = joined([label for label in matrix.labels if label != matrix.driver], 3)
    violated = [each.id for each in matrix.requirements if matrix.violated(each.id)]
    words = matrix.driver + (f" ({labels})" if labels else "")
    words += f": violates {joined(violated)}" if violated else ": violates none"
    if matrix.without:
        words += f"; {counted(len(matrix.without), 'scenario')} without requirement"
    shown = matrix.requirements[:MOST_REQUIREMENTS]
    left = [
        f"{counted(len(all_) - most, noun)} left out"
        for all_, most, noun in (
            (matrix.requirements, MOST_REQUIREMENTS, "requirement"),
            (matrix.scenarios, MOST_SCENARIOS, "scenario"),
        )
        if len(all_) > most
    ]
    rows = [
        [
            (name, "without requirement" if name in matrix.without else ""),
            *(_verdict(matrix, name, each.id, base) for each in shown),
        ]
        for name in matrix.scenarios[:MOST_SCENARIOS]
    ]
    name, heads = f"Requirements of {matrix.driver} by scenario", [each.id for each in shown]
    return {
        **_table(name, ("scenario", *heads), rows, kind="matrix", title=words),
        "left": "; ".join(left),
    }


def _verdict(matrix: Matrix, scenario: str, requirement: str, base: str) -> Cell:
    cell = matrix.cell(scenario, requirement)
    if cell is None or cell.verdict == "unknown":
        return Cell("no result" if cell else "not tested", kind="muted")
    is_met, words = cell.verdict == "met", "met"
    if not is_met:
        words = f"{cell.violated:,} of {cell.met + cell.violated:,} violate"
    worst = "" if cell.worst is None else margin_in_words(cell.worst, cell.unit, 3)
    return Cell(
        words,
        [f"{'least' if is_met else 'worst'} {worst}"],
        kind="good" if is_met else "bad",
        before="✓ " if is_met else "✗ ",
        href=_address(base, cell.page),
        label=f"{requirement} in {scenario}: {words}",
    )


# --- Trends: versions, a chart for each series, and what was measured once ---


def chart(series: Series, base: str) -> str:
    """Return a series as a chart; a dot leads to its result's page."""
    points = [
        charts.Point(
            point.share,
            point.low,
            point.high,
            share(point.share),
            bool(point.count),
            f"{point.driver}, {when(point.time)} UTC: {share(point.share)} ({point.count:,} of "
            f"{point.of:,}); {point.source}",
            (point.version, point.driver),
            _address(base, point.page),
        )
        for point in series.points
    ]
    latest = ", ".join(f"{point.driver} {share(point.share)}" for point in series.points[-5:])
    return charts.trend(points, f"{series.measure} of {series.driver} in {series.title}: {latest}")


def _histories(found: Dashboard) -> list[tuple[str, str]]:
    """Return a chart of failure modes for each driver that has several versions."""
    some = {name: steps for name, steps in history(found.project.results).items() if steps[1:]}
    most = sorted(some, key=lambda name: (-len(some[name]), name))[:MOST_HISTORIES]
    return [(name, _history(name, some[name][-MOST_STEPS:])) for name in most]


def _history(name: str, steps: Sequence[Step]) -> str:
    columns = [
        (
            step.modes,
            (step.name, when(step.time)[:10], f"{step.failing} of {step.scenarios} fail"),
        )
        for step in steps
    ]
    words = "; ".join(f"{step.name} {counted(step.modes, 'failure mode')}" for step in steps)
    return charts.columns(columns, f"Failure modes of {name} by version: {words}")


def _versions(found: Dashboard) -> Table:
    rows = []
    for _, some in sorted(versions(found.project.results).items()):
        for driver in some:
            of_it = [result for result in found.project.results if result.driver == driver]
            rows.append(
                [
                    driver.label,
                    driver.version or "not known",
                    when(min(result.time for result in of_it)),
                    len({result.scenario for result in of_it}),
                    sum(result.evaluations for result in of_it),
                    len({failure.key for result in of_it for failure in result.failures}),
                ]
            )
    heads = ("driver", "version", "first result (UTC)", "scenarios", "evaluations", "failure modes")
    return _table("Versions of drivers", heads, rows[-MOST_ROWS:])


def _once(some: list[Series], base: str) -> Table:
    rows = [
        [
            series.title,
            point.driver,
            series.measure,
            _span(point.share, point.low, point.high),
            f"{point.count:,} of {point.of:,}",
            Cell(point.source, href=_address(base, point.page)),
        ]
        for series in some
        for point in series.points
    ]
    title = f"Measured once: {counted(len(some), 'scenario and driver', 'pairs')}"
    heads = ("scenario or suite", "driver", "measure", "share", "count", "result")
    return _table("Measured once", heads, rows, title=title)


# --- The operational design domain: its file, the taxonomy, then parameters ---


def _of_odd(odd: ProjectOdd) -> dict[str, Any] | None:
    """Return the project's ODD: its name, a sentence, and its attributes; None without one."""
    found = odd.coverage
    if found is None:
        return None
    entries = counted(odd.entries, "entry of suites", "entries of suites")
    words = [
        f"{counted(odd.runs, 'run')}{f' and {entries}' if odd.entries else ''}: "
        f"{counted(found.evaluations, 'evaluation')} inside, of which "
        f"{found.failures:,} fail; {odd.outside:,} outside",
        found.pairs_in_words,
    ]
    words += [f"not read of {counted(odd.unread, 'result')}"] if odd.unread else []
    words += [f"other ODDs bound results, too: {joined(sorted(odd.others))}"] if odd.others else []
    rows = [
        [
            each.name,
            _asks(each),
            _span_of(each.low, each.high) if each.low <= each.high else "–",
            (charts.strip(each.evaluations), _worst(each)) if any(each.evaluations) else "–",
            f"{each.tested} of {len(each.limits)}" if each.limits else "–",
            Cell(joined(each.untried, 6) or "–", [each.problem] if each.problem else []),
        ]
        for each in found.attributes
    ]
    heads = "attribute, inside, searched, evaluations by value, limits tried, never tried"
    title = f"{found.odd.title} ({found.odd.name})"
    table = _table(title, heads.split(", "), rows)
    return {"title": title, "words": "; ".join(words) + ".", "table": table}


def _asks(each: OddAttribute) -> str:
    if each.edges and each.unit != "count":
        return f"{_span_of(each.edges[0], each.edges[-1])} {each.unit}"
    return ", ".join(each.labels) or "–"


def _span_of(low: float, high: float) -> str:
    ends = dict.fromkeys(f"{x:,.0f}" if abs(x) >= 1000 else f"{x:.4g}" for x in (low, high))
    return " to ".join(ends)


def _worst(each: OddAttribute) -> str:
    """Return where the largest part of evaluations fails."""
    tried = [k for k, n in enumerate(each.evaluations) if n]
    k = max(tried, key=lambda k: each.failures[k] / each.evaluations[k])
    n, failed = each.evaluations[k], each.failures[k]
    return f"{each.labels[k]}: {failed:,} of {n:,} fail" if failed else "none fails"


def _attributes(some: Iterable[Covered]) -> Iterator[tuple[str, list[tuple[str, Table, str]]]]:
    """Yield each part of the taxonomy in words, with its groups: name, table, what is left out."""
    for top, part in groupby(some, lambda item: item.attribute.path[0]):
        members = list(part)
        states = [_state(member) for member in members]
        covered, cannot = states.count("covered"), states.count("not expressible")
        words = f"{top}: {covered} of {len(members) - cannot} covered"
        words += f", {cannot} not expressible" if cannot else ""
        groups = groupby(members, lambda item: item.attribute.path[1:-1])
        yield words, [_group(" / ".join(path), list(each)) for path, each in groups]


def _state(covered: Covered) -> str:
    if not covered.attribute.expressible:
        return "not expressible"
    return "covered" if covered.scenarios else "not covered"


def _group(name: str, some: list[Covered]) -> tuple[str, Table, str]:
    rows = [_attribute(covered) for covered in some if covered.attribute.expressible]
    cannot = [
        covered.attribute.path[-1]
        + (f" ({covered.attribute.note})" if covered.attribute.note else "")
        for covered in some
        if not covered.attribute.expressible
    ]
    table = _table(name, ("attribute", "evaluations", "covered by"), rows, kind="list odd")
    return name, table, "; ".join(cannot)


def _attribute(covered: Covered) -> Row:
    state, note = _state(covered), covered.attribute.note
    kind, names = (
        state.replace(" ", "-"),
        [f"{name} ({n:,})" for name, n in covered.scenarios.items()],
    )
    by = Cell(state, kind=kind)
    if names:
        by = Cell(joined(names, 2))
    elif covered.unread:
        by = Cell(state, [f"not read of {counted(covered.unread, 'scenario')}"], kind=kind)
    mark = "✓ " if state == "covered" else "○ "
    name = Cell(covered.attribute.path[-1], [note] if note else [], mark=(mark, kind))
    return [name, covered.evaluations, by]


def _parameters(of: Coverage) -> dict[str, Any]:
    sizes = (min(len(of.sceneries[name].parameters), MOST_PARAMETERS) for name in of.seen)
    fit = within(sizes, MOST_BIN_ROWS)
    names = [*of.seen]
    return {"tables": [_bins(of, name) for name in names[:fit]], "more": max(0, len(names) - fit)}


def _bins(of: Coverage, name: str) -> Table:
    """Return the bins of a scenario's parameters."""
    seen, rows = of.seen[name], []
    for parameter in of.sceneries[name].parameters:
        counts = seen.bins.get(parameter.name, [])
        unit = "" if parameter.unit in ("1", "count") else f" {parameter.unit}"
        outside = seen.outside.get(parameter.name, 0)
        rows.append(
            [
                parameter.name,
                parameter.kind.span_text(parameter.low, parameter.high, "{:.4g}".format, unit),
                f"{sum(count > 0 for count in counts)} of {len(counts)}",
                (charts.strip(counts), f"{outside:,} outside" if outside else ""),
            ]
        )
    bins = [count for counts in seen.bins.values() for count in counts]
    words = f"{name}: {counted(seen.evaluations, 'evaluation')}"
    if bins:
        words += f", {sum(n > 0 for n in bins):,} of {counted(len(bins), 'bin')}"
    heads = ("parameter", "declared", "bins met", "evaluations by bin")
    return _table(f"Parameters of {name}", heads, rows, MOST_PARAMETERS, title=words)


# --- All results, the latest first ---


def _results(found: Dashboard, base: str) -> Iterator[Table]:
    project = found.project
    runs = sorted(project.runs, key=lambda run: (-run.time, run.source))
    suites = sorted(project.suites, key=lambda suite: (-suite.time, suite.source))
    compared = [suite for suite in suites if suite.difference]
    heads = "run, scenario, driver, evaluations, harmful, of the space, found of it, changed (UTC)"
    yield _of(runs, ("run",), heads, (_run(run, base) for run in runs))
    heads = "suite, drivers, scenarios, not judged, variations, fail, not run, changed (UTC)"
    yield _of(suites, ("suite",), heads, (_suite(suite, base) for suite in suites))
    heads = (
        "suite, first driver, second driver, only the first fails, only the second fails, "
        "both fail, both pass, by chance"
    )
    names = ("difference of two drivers", "differences of two drivers")
    yield _of(compared, names, heads, (_difference(line, base) for line in compared))
    heads = "map, scenario, driver, cells, avoided, not avoided though preventable, not preventable"
    yield _of(project.maps, ("preventability map",), heads, _maps(found, base))
    names = ("comparison of algorithms", "comparisons of algorithms")
    lines: Iterator[Row] = (
        [
            Cell(comparison.source, href=_address(base, comparison.page)),
            joined(comparison.scenarios),
            joined(comparison.algorithms),
            comparison.runs,
        ]
        for comparison in project.comparisons
    )
    yield _of(project.comparisons, names, "comparison, scenarios, algorithms, runs", lines)


def _of(some: Sequence[object], noun: Sequence[str], heads: str, rows: Iterable[Row]) -> Table:
    return _table(counted(len(some), *noun), heads.split(", "), [*rows])


def _run(result: Result, base: str) -> Row:
    space = result.space
    is_known = space is not None and space.share is not None and not result.unjudged
    return [
        Cell(
            result.source,
            [] if result.finished else ["not finished"],
            href=_address(base, result.page),
        ),
        result.scenario,
        (result.driver.label, f"worse than {result.worse_than}" if result.worse_than else ""),
        result.evaluations,
        "not judged" if result.unjudged else result.failed if space or result.worse_than else "–",
        _span(space.share or 0.0, space.low, space.high) if space and is_known else "–",
        (
            "–"
            if result.covered is None
            else _span(result.covered[0] / result.covered[1], *clopper_pearson(*result.covered))
        ),
        when(result.time),
    ]


def _suite(suite_line: SuiteLine, base: str) -> Row:
    return [
        Cell(suite_line.source, href=_address(base, suite_line.page)),
        joined(suite_line.egos),
        len({each.entry for each in suite_line.results}),
        len({each.entry for each in suite_line.results if each.unjudged}),
        *(
            sum(getattr(each, name) for each in suite_line.results)
            for name in ("evaluations", "failed", "lost")
        ),
        when(suite_line.time),
    ]


def _difference(suite_line: SuiteLine, base: str) -> Row:
    found = suite_line.difference
    assert found is not None
    return [
        Cell(suite_line.source, href=_address(base, suite_line.page)),
        found.first,
        found.second,
        *(found.counts[name] for name in ("fixed", "broken", "both fail", "both pass")),
        f"p = {found.p_value:.2g}",
    ]


def _maps(found: Dashboard, base: str) -> Iterator[Row]:
    for line in found.project.maps:
        href = _address(base, line.page)
        if not line.scenario:
            yield [Cell(line.source, ["not finished"], href=href), *[""] * 6]
            continue
        for each in line.drivers:
            numbers = (each.avoided, each.preventable, each.unpreventable)
            yield [
                Cell(line.source, href=href),
                line.scenario,
                each.driver,
                line.cells,
                *((n, share(n / each.judged)) if each.judged else "–" for n in numbers),
            ]
