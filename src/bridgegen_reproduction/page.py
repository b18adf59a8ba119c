"""The document as one page that needs no network and runs no script."""

import base64
import re
from html import escape
from importlib.metadata import version
from importlib.resources import files

from bridgegen.pages.templates import style
from bridgegen_reproduction.document import (
    FIGURES,
    TABLES,
    Block,
    Command,
    Document,
    Folded,
    Picture,
    Points,
    Section,
    Shown,
    Text,
)
from bridgegen_reproduction.table import to_html


def html(document: Document) -> str:
    """Return the page; text is data in it, never markup."""
    fill = {
        "title": escape(document.title),
        "css": style() + _own("page.css"),
        "facts": "".join(f"<li>{escape(fact)}</li>" for fact in document.facts),
        "nav": "".join(
            f'<a href="#{_anchor(section)}">{escape(section.title)}</a>'
            for section in document.sections
        ),
        "sections": "\n".join(_section(section) for section in document.sections),
        "version": escape(version("bridgegen")),
    }
    parts = re.split(r"\{\{(\w+)\}\}", _own("page.html"))
    return "".join(fill[part] if i % 2 else part for i, part in enumerate(parts))


def _anchor(section: Section) -> str:
    return re.sub(r"\W+", "-", section.title.lower()).strip("-")


def _section(section: Section) -> str:
    blocks = "\n".join(_block(block) for block in section.blocks)
    return (
        f'<section><h2 id="{_anchor(section)}">{escape(section.title)}</h2>\n{blocks}\n</section>'
    )


def _block(block: Block) -> str:
    match block:
        case Text(text):
            return f'<div class="card"><p>{escape(text)}</p></div>'
        case Points(points):
            told = "".join(
                f"<dt>{escape(name)}</dt><dd>{escape(text)}</dd>" for name, text in points
            )
            return f'<div class="card"><dl class="points">{told}</dl></div>'
        case Command(command):
            return f'<div class="card"><pre><code>{escape(command)}</code></pre></div>'
        case Shown(table):
            links = ", ".join(
                f'<a href="{TABLES}/{escape(table.name)}.{end}">{end}</a>'
                for end in ("csv", "tex", "md")
            )
            card = to_html(table).removesuffix("</div>")
            return f'{card}<p class="files">Files: {links}</p></div>'
        case Folded():
            return _folded(block)
        case Picture():
            caption, path = escape(block.caption), f"{FIGURES}/{escape(block.name)}"
            return (
                f'<figure class="card" id="{escape(block.name)}">'
                '<div class="shot" tabindex="0"><picture>'
                f'<source media="(prefers-color-scheme: dark)" srcset="{_data(block.dark)}">'
                f'<img alt="{caption}" src="{_data(block.light)}"></picture></div>'
                f'<figcaption>{caption} Files: <a href="{path}.png">png</a>, '
                f'<a href="{path}.pdf">pdf</a></figcaption></figure>'
            )


def _folded(block: Folded) -> str:
    head = "".join(f'<th scope="col">{escape(name)}</th>' for name in block.table.head)
    rows = "".join(
        f'<tr><th scope="row">{escape(row[0])}</th>'
        + "".join(f"<td>{escape(cell)}</td>" for cell in row[1:-2])
        + f'<td><a href="{escape(row[-2])}/">{escape(row[-2])}</a></td>'
        + f"<td><details><summary>command</summary><code>{escape(row[-1])}</code></details></td>"
        "</tr>"
        for row in block.table.rows
    )
    return (
        f'<div class="card"><details><summary>{escape(block.title)}</summary><div class="wide">'
        f'<table class="data runs"><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>'
        f'</div></details><p class="files">All of it: <a href="{escape(block.file)}">'
        f"{escape(block.file)}</a></p></div>"
    )


def _data(png: bytes) -> str:
    return f"data:image/png;base64,{base64.b64encode(png).decode()}"


def _own(name: str) -> str:
    return files("bridgegen_reproduction").joinpath(name).read_text("utf-8")
