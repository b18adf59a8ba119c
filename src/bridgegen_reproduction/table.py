"""A table, and how it is written: Markdown, CSV, LaTeX; the page has its own."""

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Table:
    """Text in rows and columns.

    Attributes:
        name: of its files.
        title: above it; begins with the paper's number, where it has one.
        head: names of the columns.
        rows: as many texts each.
        notes: below it, a sentence or more each.
        data: what its CSV says instead of the rows, with every digit; its head first. None: the
            rows.
        texts: how many columns hold words, from the left; the others hold numbers.
    """

    name: str
    title: str
    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()
    data: tuple[tuple[object, ...], ...] | None = None
    texts: int = 1

    def __post_init__(self) -> None:
        for row in self.rows:
            assert len(row) == len(self.head), f"{self.name}: {row}"


def to_csv(table: Table) -> str:
    """Return a table for programs; a number with all its digits, nothing for what is not known."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    for row in table.data or (table.head, *table.rows):
        writer.writerow([_cell(value) for value in row])
    return text.getvalue()


def _cell(value: object) -> str:
    if isinstance(value, float):
        return "" if value != value else repr(value)
    return "" if value is None else str(value)


def to_markdown(table: Table) -> str:
    """Return a table and its notes as Markdown; the title is the caller's."""

    def line(cells: Sequence[str]) -> str:
        return f"| {' | '.join(_markdown(cell) for cell in cells)} |"

    numbers = len(table.head) - table.texts
    rule = f"|{'|'.join(['---'] * table.texts + ['---:'] * numbers)}|"
    lines = [line(table.head), rule, *map(line, table.rows)]
    if table.notes:
        lines += ["", *(f"- {_markdown(note)}" for note in table.notes)]
    return "\n".join(lines) + "\n"


def _markdown(text: str) -> str:
    return re.sub(r"([\\|*_<`\[])", r"\\\1", text).replace("\n", " ")


_LATEX = {
    "\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "%": r"\%", "&": r"\&", "#": r"\#",
    "_": r"\_", "$": r"\$", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}",
    "−": "$-$", "–": "--", "²": "$^2$", "≥": r"$\geq$", "≤": r"$\leq$", "<": "$<$", ">": "$>$",
    "±": r"$\pm$", "×": r"$\times$", "→": r"$\rightarrow$", "…": r"\ldots{}", "°": r"$^\circ$",
    "·": r"$\cdot$", "Δ": r"$\Delta$", "’": "'", "“": "``", "”": "''", "\u202f": r"\,",
    "✓": "yes", "✗": "no",
}  # fmt: skip


def latex(text: str) -> str:
    """Return plain text as LaTeX shows it, in any of its engines."""
    return "".join(_LATEX.get(name, name) for name in text)


def to_latex(table: Table) -> str:
    """Return a table as a LaTeX ``table*``, in the manner of the package booktabs."""
    columns = "l" * table.texts + "r" * (len(table.head) - table.texts)

    def line(cells: Sequence[str]) -> str:
        return f"{' & '.join(latex(cell) for cell in cells)} \\\\"

    parts = [
        "% needs \\usepackage{booktabs,graphicx}",
        "\\begin{table*}",
        "\\centering",
        f"\\caption{{{latex(table.title)}}}",
        f"\\label{{tab:{table.name}}}",
        "\\small",
        "\\resizebox{\\ifdim\\width>\\linewidth\\linewidth\\else\\width\\fi}{!}{%",
        f"\\begin{{tabular}}{{{columns}}}",
        "\\toprule",
        line(table.head),
        "\\midrule",
        *map(line, table.rows),
        "\\bottomrule",
        "\\end{tabular}}",
    ]
    if table.notes:
        parts += ["", "\\medskip", "\\begin{minipage}{\\linewidth}\\footnotesize"]
        parts += [f"{latex(note)}\\par" for note in table.notes]
        parts += ["\\end{minipage}"]
    return "\n".join([*parts, "\\end{table*}"]) + "\n"
