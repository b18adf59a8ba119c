"""What a reader opens first, as blocks of text, tables and figures; written twice.

``README.md`` for those who look at files, ``index.html`` for those who look at a page.
"""

from dataclasses import dataclass

from bridgegen_reproduction.table import Table, to_markdown

TABLES, FIGURES = "tables", "figures"
"""Folders of the files."""


@dataclass(frozen=True)
class Text:
    """A paragraph."""

    text: str


@dataclass(frozen=True)
class Points:
    """A list; each has a few words, then what there is to say."""

    points: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Command:
    """A command line."""

    command: str


@dataclass(frozen=True)
class Shown:
    """A table; one whose numbers are of seconds is on the page only."""

    table: Table
    timed: bool = False


@dataclass(frozen=True)
class Picture:
    """A figure.

    Attributes:
        name: of its files.
        caption: below it.
        light: PNG.
        dark: PNG for dark pages.
        pdf: for papers.
    """

    name: str
    caption: str
    light: bytes
    dark: bytes
    pdf: bytes


@dataclass(frozen=True)
class Folded:
    """A long table that is opened on demand, on the page only; its last column is a command."""

    title: str
    table: Table
    file: str


Block = Text | Points | Command | Shown | Picture | Folded


@dataclass(frozen=True)
class Section:
    """A heading, and what is below it."""

    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True)
class Document:
    """All of it.

    Attributes:
        title: on top.
        facts: a few words each, below the title.
        sections: in order.
    """

    title: str
    facts: tuple[str, ...]
    sections: tuple[Section, ...]

    def tables(self) -> tuple[Shown, ...]:
        """Return every table."""
        return tuple(b for s in self.sections for b in s.blocks if isinstance(b, Shown))

    def pictures(self) -> tuple[Picture, ...]:
        """Return every figure."""
        return tuple(b for s in self.sections for b in s.blocks if isinstance(b, Picture))


def markdown(document: Document) -> str:
    """Return the document as Markdown, its figures beside it; without what is made of seconds."""
    parts = [f"# {document.title}", " · ".join(document.facts)]
    for section in document.sections:
        parts.append(f"## {section.title}")
        parts += [_block(block) for block in section.blocks]
    return "\n\n".join(part.rstrip() for part in parts) + "\n"


def _block(block: Block) -> str:
    match block:
        case Text(text):
            return text
        case Points(points):
            return "\n".join(f"- **{name}.** {text}" for name, text in points)
        case Command(command):
            return f"```sh\n{command}\n```"
        case Shown(table, timed):
            files = ", ".join(
                f"[{ending}]({TABLES}/{table.name}.{ending})" for ending in ("csv", "tex", "md")
            )
            shown = "" if timed else f"{to_markdown(table)}\n"
            return f"### {table.title}\n\n{shown}Files: {files}."
        case Picture():
            path = f"{FIGURES}/{block.name}"
            return f"![{block.caption}]({path}.png)\n\n*{block.caption}* [PDF]({path}.pdf)"
        case Folded(title, _, file):
            return f"{title}: [{file}]({file})."
