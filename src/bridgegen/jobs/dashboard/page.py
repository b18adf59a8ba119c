"""The dashboard's page: failure modes, requirements, trends; one file without scripts."""

from importlib.metadata import version
from urllib.parse import quote

from bridgegen.assess.criteria import margin_in_words
from bridgegen.jobs.dashboard.charts import chart
from bridgegen.jobs.dashboard.dashboard import Dashboard
from bridgegen.jobs.dashboard.markup import (
    base_of,
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
from bridgegen.jobs.dashboard.modes import OpenMode
from bridgegen.jobs.dashboard.page_results import odd_part, problems_part, results_part
from bridgegen.jobs.dashboard.requirements import Cell, Matrix, statements
from bridgegen.jobs.dashboard.results import versions
from bridgegen.jobs.dashboard.sentences import failing_sentence, requirements_sentence
from bridgegen.jobs.dashboard.trends import Point, Series
from bridgegen.pages.page import write_still_page
from bridgegen.pages.sentences import NARROW, share
from bridgegen.results.failures import FILE, Failure

# --- The page's part on failure modes ---


MOST_MODES = 500
"""Failure modes of a table; the others are counted."""

MOST_RESULTS = 5
"""Results of a failure mode that are linked."""

_HEADS = ("failure mode", "status", "scenario", "driver", "evaluations", "MAIS3+", "last seen")


def modes_part(found: Dashboard, base: str) -> str:
    """Return the section: what fails now, what failed before, what no result has any more."""
    now = list(found.failing)
    before = [one for one in found.modes if not one.fails_now]
    lead = (
        "Each is counted once, whatever number of results has it. The status is that of its block "
        f"in {FILE}, of a suite that keeps it or of this folder; without a block it is new."
    )
    parts = [f"<p>{text(one)}</p>" for one in found.notes[:MOST_RESULTS]]
    parts.append(_table("Failure modes of current results", now, base) if now else "<p>None.</p>")
    if before:
        summary = f"{counted(len(before), 'failure mode')} that no current result has"
        parts.append(folded(summary, _table(summary, before, base)))
    if found.unseen:
        summary = f"{counted(len(found.unseen), 'failure mode')} in no result of this project"
        parts.append(folded(summary, _decisions(found.unseen)))
    return section("modes", "Failing now", "".join(parts), lead=lead)


def _table(name: str, modes: list[OpenMode], base: str) -> str:
    return _some(name, _HEADS, [_row(one, base) for one in modes[:MOST_MODES]], len(modes))


def _some(name: str, heads: tuple[str, ...], rows: list[list[str]], total: int) -> str:
    more = total - len(rows)
    return table(name, heads, rows) + (f'<p class="muted">and {more:,} more</p>' if more else "")


def _row(one: OpenMode, base: str) -> list[str]:
    word = "regression" if one.is_regression else one.status
    said = "fixed, but fails again" if one.is_regression else one.status
    note = f"<small>{text(one.comment)}</small>" if one.comment else ""
    decided = f" ({text(one.decided)})" if one.decided else ""
    edge = "<small>knife-edge: small changes make it vanish</small>" if one.knife_edge else ""
    latest = one.results[0]
    links = ", ".join(
        link(base, result.page, result.source, f"{result.source}: {one.title}")
        for result in one.results[:MOST_RESULTS]
    )
    more = len(one.results) - MOST_RESULTS
    links += f" and {more:,} more" if more > 0 else ""
    labels = f"<small>{text(joined(one.versions, 6))}</small>" if one.versions else ""
    return [
        f'{text(one.title)}{edge}{note}<small class="id">{one.key.id}{decided}</small>',
        f'<span class="status {word}">{text(said)}</span>',
        text(one.key.scenario),
        f"{text(one.key.driver)}{labels}",
        f"{one.count:,}",
        text(share(one.severity)) if one.severity else "–",
        f"{when(latest.time)}<small>{links}</small>",
    ]


def _decisions(some: dict[str, Failure]) -> str:
    rows = [
        [text(one.title or id), text(one.status), text(one.scenario), text(one.driver),
         text(one.comment)]
        for id, one in [*some.items()][:MOST_MODES]
    ]  # fmt: skip
    heads = ("failure mode", "status", "scenario", "driver", "comment")
    return _some("Failure modes in no result", heads, rows, len(some))


# --- The page's part on requirements: a matrix for each driver ---


MOST_REQUIREMENTS = 40
"""Columns of a matrix; the gravest."""

MOST_SCENARIOS = 200
"""Rows of a matrix."""

SIZE = 1_000_000
"""Characters of all matrices; the first is always there."""

_OPEN = 40
"""Matrices with more rows together are folded."""


def requirements_part(found: Dashboard, base: str) -> str:
    """Return the section: all requirements, then scenarios × requirements by driver."""
    if not found.criteria:
        names = joined(found.scenarios, 8)
        lead = f"No pass criterion is stated in any result. Scenarios: {names or 'none'}."
        return section("requirements", "Requirements", lead=lead)
    parts = [_list(found)]
    is_open = sum(len(one.scenarios) for one in found.requirements) <= _OPEN
    matrices = (
        folded(f"{_label(one)}: {_in_words(one)}", _matrix(one, base), is_open=is_open)
        for one in found.requirements
    )
    parts.append(within(matrices, SIZE, "driver"))
    lead = "By the current results: those of the version of each driver that was tested last."
    return section("requirements", "Requirements", *parts, lead=lead)


def _label(one: Matrix) -> str:
    names = joined([label for label in one.labels if label != one.driver], 3)
    return one.driver + (f" ({names})" if names else "")


def _in_words(one: Matrix) -> str:
    violated = [each.id for each in one.requirements if one.violated(each.id)]
    words = f"violates {joined(violated)}" if violated else "violates none"
    if one.without:
        words += f"; {counted(len(one.without), 'scenario')} without requirement"
    return words


def _list(found: Dashboard) -> str:
    rows, stated = [], statements(found.project.results)
    for one in found.criteria[:MOST_SCENARIOS]:
        violated = found.violated.get(one.id, [])
        who = "; ".join(f"{matrix.driver} in {joined(names, 3)}" for matrix, names in violated)
        if one.id in found.untested:
            state = '<span class="status untested">tested by no scenario</span>'
        elif violated:
            state = f'<span class="status regression">violated</span><small>{text(who)}</small>'
        else:
            state = '<span class="status fixed">met</span>'
        words = f"{text(one.text)}<code>{text(one.states)}</code>"
        others = [each for each in stated.get(one.id, []) if each != one.states]
        if others:
            words += f"<small>stated otherwise in some results: {text(joined(others, 3))}</small>"
        rows.append([f'<span class="id">{text(one.id)}</span>', words, text(one.severity), state])
    return table("Requirements", ("id", "requirement", "severity", "state"), rows, "list ids")


def _matrix(one: Matrix, base: str) -> str:
    shown = one.requirements[:MOST_REQUIREMENTS]
    rows = []
    for name in one.scenarios[:MOST_SCENARIOS]:
        cells = [_cell(one.cell(name, each.id), base, f"{each.id} in {name}") for each in shown]
        none = name in one.without
        first = text(name) + ("<small>without requirement</small>" if none else "")
        rows.append([first, *cells])
    left = [
        f"{counted(len(all_) - most, noun)} left out"
        for all_, most, noun in (
            (one.requirements, MOST_REQUIREMENTS, "requirement"),
            (one.scenarios, MOST_SCENARIOS, "scenario"),
        )
        if len(all_) > most
    ]
    after = f'<p class="muted">{text("; ".join(left))}</p>' if left else ""
    heads = ("scenario", *(each.id for each in shown))
    return table(f"Requirements of {one.driver} by scenario", heads, rows, "matrix") + after


def _cell(cell: Cell | None, base: str, name: str) -> str:
    if cell is None:
        return '<span class="muted">not tested</span>'
    worst = "" if cell.worst is None else margin_in_words(cell.worst, cell.unit, 3)
    total = cell.met + cell.violated
    if cell.verdict == "violated":
        words = f"{cell.violated:,} of {total:,} violate"
        target = link(base, cell.page, words, f"{name}: {words}")
        return f'<span class="bad">✗ {target}</span><small>worst {text(worst)}</small>'
    if cell.verdict == "met":
        target = link(base, cell.page, "met", f"{name}: met")
        return f'<span class="good">✓ {target}</span><small>least {text(worst)}</small>'
    return '<span class="muted">no result</span>'


# --- The page's part on trends: a chart for each scenario or suite, and driver ---


MOST_CHARTS = 48
"""Charts of the page: those that grew the most, then those with the largest share."""

MOST_ROWS = 300


def trends_part(found: Dashboard, base: str) -> str:
    """Return the section: versions, charts of what was measured again, a table of the rest."""
    again = [one for one in found.trends if len(one.points) > 1]
    once = [one for one in found.trends if len(one.points) == 1]
    links = {
        point.source: f"./{quote(_address(base, point))}"
        for one in again
        for point in one.points
        if point.page
    }
    parts = [_versions(found)]
    if again:
        figures = "".join(_figure(one, links) for one in again[:MOST_CHARTS])
        more = len(again) - MOST_CHARTS
        after = f'<p class="muted">and {counted(more, "chart")} more</p>' if more > 0 else ""
        parts.append(f'<div class="charts">{figures}</div>{after}')
    if once:
        summary = f"Measured once: {counted(len(once), 'scenario and driver', 'pairs')}"
        parts.append(folded(summary, _once(once, base), is_open=not again))
    lead = (
        "Harmful share of the search space, of random rows, with its 95"
        f"{NARROW}% interval; of suites the share of variations that fail. Results are in the "
        "order of time; a version ends the name of a driver behind a hyphen: stack-1.2."
    )
    return section("trends", "Trends over driver versions", *parts, lead=lead)


def _address(base: str, point: Point) -> str:
    return point.page if base == "." else f"{base}/{point.page}"


def _figure(one: Series, links: dict[str, str]) -> str:
    left = f", {counted(one.left_out, 'earlier result')} left out" if one.left_out else ""
    return (
        f"<figure>{chart(one, links)}<figcaption><b>{text(one.title)}</b> {text(one.driver)}"
        f"<small>{text(one.measure)}{left}</small></figcaption></figure>"
    )


def _versions(found: Dashboard) -> str:
    rows = []
    for _, some in sorted(versions(found.project.results).items()):
        for driver in some:
            of_it = [one for one in found.project.results if one.driver == driver]
            keys = {failure.key for one in of_it for failure in one.failures}
            rows.append(
                [
                    text(driver.label),
                    text(driver.version or "not known"),
                    when(min(one.time for one in of_it)),
                    f"{len({one.scenario for one in of_it}):,}",
                    f"{sum(one.evaluations for one in of_it):,}",
                    f"{len(keys):,}",
                ]
            )
    heads = ("driver", "version", "first result (UTC)", "scenarios", "evaluations",
             "failure modes")  # fmt: skip
    shown = rows[-MOST_ROWS:]
    return table("Versions of drivers", heads, shown)


def _once(some: list[Series], base: str) -> str:
    rows = []
    for one in some[:MOST_ROWS]:
        point = one.points[0]
        rows.append(
            [
                text(one.title),
                text(point.driver),
                text(one.measure),
                span(point.share, point.low, point.high),
                f"{point.count:,} of {point.of:,}",
                link(base, point.page, point.source),
            ]
        )
    heads = ("scenario or suite", "driver", "measure", "share", "count", "result")
    more = len(some) - len(rows)
    after = f'<p class="muted">and {more:,} more</p>' if more else ""
    return table("Measured once", heads, rows) + after


_PARTS = (
    ("modes", "Failing now"),
    ("requirements", "Requirements"),
    ("trends", "Trends"),
    ("odd", "Coverage"),
    ("results", "All results"),
    ("problems", "Not read"),
)


def write_page(found: Dashboard) -> None:
    """Write the page, whole or not at all.

    Raises:
        StorageError: it cannot be written.
    """
    base = base_of(found.project.folder, found.page)
    parts = [
        _head(found),
        modes_part(found, base),
        requirements_part(found, base),
        trends_part(found, base),
        odd_part(found),
        results_part(found, base),
        problems_part(found),
        f'<footer class="muted">BridgeGen {text(version("bridgegen"))}. Made of what was in the '
        "folder; the same command makes it again.</footer>",
    ]
    title = f"{found.project.folder.name or 'project'}: dashboard – BridgeGen"
    body = "\n".join(filter(None, parts)).encode("utf-8", "replace")
    write_still_page(found.page, "dashboard.html", title, body)


def _head(found: Dashboard) -> str:
    figures, problems = found.figures, found.project.problems
    nouns = {
        "runs": ("run", ""),
        "suites": ("suite", ""),
        "maps": ("preventability map", ""),
        "comparisons": ("comparison", ""),
        "scenarios": ("scenario", ""),
        "drivers": ("driver", ""),
        "evaluations": ("evaluation", ""),
    }
    facts = [counted(int(figures[name]), *noun) for name, noun in nouns.items() if figures[name]]
    items = "".join(f"<li>{text(one)}</li>" for one in facts)
    if problems:
        items += f'<li class="warn">{text(counted(len(problems), "problem"))}</li>'
    sentences = (failing_sentence(found), requirements_sentence(found))
    lead = "".join(f"<p>{text(one)}</p>" for one in sentences if one)
    links = "".join(
        f'<a href="#{key}">{text(title)}</a>'
        for key, title in _PARTS
        if key != "problems" or problems
    )
    return (
        f"<h1>{text(found.project.folder.name or 'Project')}</h1>"
        f'<ul class="facts" aria-label="What is here">{items}</ul>'
        f'<div class="card lead">{lead}</div><nav aria-label="Sections">{links}</nav>'
    )
