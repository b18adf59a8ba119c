"""Pieces of HTML; everything that is not called markup is escaped."""

import html
from collections.abc import Iterable


def escaped(what: object) -> str:
    """Return what is safe as text and within the quotes of an attribute."""
    return html.escape(str(what), quote=True)


def link(name: str, shown: str | None = None) -> str:
    """Return a link to an anchor of the page."""
    return f'<a href="#{escaped(name)}">{escaped(shown or name)}</a>'


def links(names: Iterable[str]) -> str:
    """Return links to anchors, with commas."""
    return ", ".join(map(link, names))


def definitions(pairs: Iterable[tuple[str, str]]) -> str:
    """Return pairs (what, markup) as a list; those without markup are left out."""
    rows = "".join(f"<dt>{what}</dt><dd>{said}</dd>\n" for what, said in pairs if said)
    return f'<dl class="says">\n{rows}</dl>\n'


def table_of(cls: str, heads: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Return a table of markup; on a narrow screen, each row is a block with the heads in it."""
    heads = list(heads)
    head = "".join(f'<th scope="col">{one}</th>' for one in heads)
    body = "".join(
        "<tr>"
        + "".join(
            f'<td data-is="{what}">{cell}</td>' if number and cell else f"<td>{cell}</td>"
            for number, (what, cell) in enumerate(zip(heads, row, strict=True))
        )
        + "</tr>\n"
        for row in rows
    )
    top = f'<table class="{cls}">\n<thead><tr>{head}</tr></thead>\n'
    return f"{top}<tbody>\n{body}</tbody>\n</table>\n"
