"""The page's part on failure modes."""

from bridgegen.jobs.dashboard.dashboard import Dashboard
from bridgegen.jobs.dashboard.markup import (
    counted,
    folded,
    joined,
    link,
    section,
    table,
    text,
    when,
)
from bridgegen.jobs.dashboard.modes import OpenMode
from bridgegen.jobs.dashboard.status_file import Decision
from bridgegen.pages.sentences import share

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
        "Each is counted once, whatever number of results has it. The status is that of "
        f"{found.status_path.name}; what is not named there is new."
    )
    parts = [_table("Failure modes of current results", now, base)]
    if not now:
        parts = ["<p>None.</p>"]
    if before:
        summary = f"{counted(len(before), 'failure mode')} that no current result has"
        parts.append(folded(summary, _table(summary, before, base)))
    if found.unseen:
        summary = f"{counted(len(found.unseen), 'failure mode')} in no result of this project"
        parts.append(folded(summary, _decisions(found.unseen)))
    return section("modes", "Failing now", "".join(parts), lead=lead)


def _table(name: str, modes: list[OpenMode], base: str) -> str:
    rows = [_row(one, base) for one in modes[:MOST_MODES]]
    more = len(modes) - len(rows)
    after = f'<p class="muted">and {more:,} more</p>' if more else ""
    return table(name, _HEADS, rows) + after


def _row(one: OpenMode, base: str) -> list[str]:
    word = "regression" if one.is_regression else one.status
    said = "fixed, but fails again" if one.is_regression else one.status
    note = f"<small>{text(one.note)}</small>" if one.note else ""
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
        f'{text(one.title)}{edge}{note}<small class="id">{one.key.id}</small>',
        f'<span class="status {word}">{text(said)}</span>',
        text(one.key.scenario),
        f"{text(one.key.driver)}{labels}",
        f"{one.count:,}",
        text(share(one.severity)) if one.severity else "–",
        f"{when(latest.time)}<small>{links}</small>",
    ]


def _decisions(some: list[Decision]) -> str:
    rows = [
        [text(one.title or one.id), text(one.status), text(one.scenario), text(one.driver),
         text(one.note)]
        for one in some[:MOST_MODES]
    ]  # fmt: skip
    more = len(some) - len(rows)
    after = f'<p class="muted">and {more:,} more</p>' if more else ""
    return (
        table(
            "Failure modes in no result",
            ("failure mode", "status", "scenario", "driver", "note"),
            rows,
        )
        + after
    )
