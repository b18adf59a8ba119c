"""The document as one page that needs no network and runs no script."""

import base64
import re

from markupsafe import Markup

from bridgegen.pages import templates
from bridgegen_reproduction.document import FIGURES, TABLES, Block, Document, Section


def html(document: Document) -> bytes:
    """Return the page; text is data in it, never markup."""
    return templates.page(
        "page.html",
        package="bridgegen_reproduction",
        title=document.title,
        facts=document.facts,
        sections=document.sections,
        tables=TABLES,
        figures=FIGURES,
        anchor=_anchor,
        kind_of=_kind,
        below=_below,
        data=_data,
    )


def _anchor(section: Section) -> str:
    return re.sub(r"\W+", "-", section.title.lower()).strip("-")


def _kind(block: Block) -> str:
    return type(block).__name__


def _below(cell: str) -> str | Markup:
    """Return a cell; what is in brackets after a number goes below it."""
    number, bracket, rest = cell.partition(" (")
    if bracket and " to " in rest and rest.endswith(")"):
        return Markup("{} <small>({}</small>").format(number, rest)
    return cell


def _data(png: bytes) -> str:
    return f"data:image/png;base64,{base64.b64encode(png).decode()}"
