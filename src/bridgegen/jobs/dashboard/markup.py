"""HTML of the dashboard's parts: every text is escaped, every link is relative."""

import os
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from html import escape
from pathlib import Path
from urllib.parse import quote

from bridgegen.pages.sentences import share


def text(value: object) -> str:
    """Return a text as HTML."""
    return escape(str(value))


def base_of(project: Path, page: Path) -> str:
    """Return the way from the page's folder to the project's, for links."""
    return os.path.relpath(project, page.resolve().parent).replace(os.sep, "/")


def link(base: str, target: str, words: str, name: str = "") -> str:
    """Return a link to a page of a result; the words alone where it has none.

    Args:
        base: see `base_of`.
        target: as seen from the project's folder, or "".
        words: plain text.
        name: of the link for screen readers, where the words are short.
    """
    if not target:
        return text(words)
    label = f' aria-label="{text(name)}"' if name else ""
    path = target if base == "." else f"{base}/{target}"
    return f'<a href="./{quote(path, errors="replace")}"{label}>{text(words)}</a>'


def table(
    name: str, heads: Sequence[str], rows: Iterable[Sequence[str]], kind: str = "list"
) -> str:
    """Return a table; its cells are HTML, the first of a row is its heading.

    Below 760 px width each row becomes a block, in which the heads name the cells.

    Args:
        name: of the table, for screen readers.
        heads: plain texts.
        rows: of cells.
        kind: its class.
    """
    head = "".join(f'<th scope="col">{text(one)}</th>' for one in heads)
    lines = []
    for first, *cells in rows:
        rest = "".join(
            f'<td data-title="{text(title)}">{cell}</td>'
            for title, cell in zip(heads[1:], cells, strict=True)
        )
        lines.append(f'<tr><th scope="row">{first}</th>{rest}</tr>')
    return (
        f'<table class="{kind}"><caption class="hidden">{text(name)}</caption>'
        f"<thead><tr>{head}</tr></thead><tbody>{''.join(lines)}</tbody></table>"
    )


def folded(summary: str, body: str, *, is_open: bool = False) -> str:
    """Return what opens at a click; the summary is plain text."""
    state = " open" if is_open else ""
    return f"<details{state}><summary>{text(summary)}</summary>{body}</details>"


def section(key: str, title: str, *parts: str, lead: str = "") -> str:
    """Return a section of the page; ``lead`` is plain text, parts are HTML."""
    muted = f'<p class="muted">{text(lead)}</p>' if lead else ""
    body = "".join(f'<div class="card wide">{one}</div>' for one in parts if one)
    return f'<section id="{key}"><h2>{text(title)}</h2>{muted}{body}</section>'


def counted(number: int, noun: str, many: str = "") -> str:
    """Return a number with its noun: "1 run", "2,000 runs"."""
    return f"{number:,} {noun if number == 1 else many or f'{noun}s'}"


def when(seconds: float) -> str:
    """Return a time [s since 1970] as a date and time in UTC."""
    try:
        return datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%d %H:%M")
    except (OverflowError, ValueError, OSError):
        return "–"


def span(value: float, low: float, high: float) -> str:
    """Return a share with its interval, as HTML."""
    if low == high:
        return text(share(value))
    return f"{text(share(value))} <small>{text(share(low))} to {text(share(high))}</small>"


def within(parts: Iterable[str], most: int, noun: str) -> str:
    """Return parts as long as they fit, and how many do not; the first is always there.

    Args:
        parts: HTML.
        most: characters of all of them.
        noun: what one of them is.
    """
    found, left = list[str](), 0
    for one in parts:
        most -= len(one)
        if found and most < 0:
            left += 1
        else:
            found.append(one)
    after = f'<p class="muted">and {counted(left, noun)} more</p>' if left else ""
    return "".join(found) + after


def joined(names: Sequence[str], most: int = 4) -> str:
    """Return names in words: "a, b and 3 others"."""
    if len(names) > most + 1:
        return f"{', '.join(names[:most])} and {len(names) - most:,} others"
    return " and ".join(filter(None, [", ".join(names[:-1]), names[-1] if names else ""]))
