"""The page's part on requirements: a matrix for each driver."""

from bridgegen.assess.criteria import margin_in_words
from bridgegen.jobs.dashboard.dashboard import Dashboard
from bridgegen.jobs.dashboard.markup import (
    counted,
    folded,
    joined,
    link,
    section,
    table,
    text,
    within,
)
from bridgegen.jobs.dashboard.requirements import Cell, Matrix, statements

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
