"""Tables in four languages: what is in a cell is what is read back."""

import csv
import io
import re
from html.parser import HTMLParser

from hypothesis import given
from hypothesis import strategies as st
from tests.approval import approve
from tests.pages import without_theme

from bridgegen_reproduction.document import Command, Document, Folded, Points, Section, Shown, Text
from bridgegen_reproduction.numbers import number, spread
from bridgegen_reproduction.page import html
from bridgegen_reproduction.table import Table, latex, to_csv, to_latex, to_markdown

texts = st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs", "Zl", "Zp")))
cells = texts.map(lambda text: " ".join(text.split()))


@st.composite
def tables(draw) -> Table:
    width = draw(st.integers(2, 4))
    row = st.tuples(*[cells] * width)
    return Table("name", draw(cells), draw(row), tuple(draw(st.lists(row, max_size=4))),
                 tuple(draw(st.lists(cells, max_size=2))))  # fmt: skip


@given(tables())
def test_csv_gives_back_every_cell(table):
    read = list(csv.reader(io.StringIO(to_csv(table))))
    assert [tuple(row) for row in read] == [table.head, *table.rows]


@given(tables())
def test_markdown_has_a_column_for_every_cell(table):
    lines = to_markdown(table).splitlines()[: 2 + len(table.rows)]
    for line in lines:
        bars = re.findall(r"(?<!\\)(?:\\\\)*\|", line)
        assert len(bars) == len(table.head) + 1


class Cells(HTMLParser):
    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.cells: list[str] = []
        self.tags: set[str] = set()
        self._open = False

    def handle_starttag(self, tag, attributes):
        self.tags.add(tag)
        if tag in ("td", "th"):
            self.cells.append("")
            self._open = True

    def handle_endtag(self, tag):
        if tag in ("td", "th"):
            self._open = False

    def handle_data(self, data):
        if self._open:
            self.cells[-1] += data


@given(tables())
def test_html_gives_back_every_cell_and_nothing_is_markup(table):
    page = Cells()
    whole = html(Document("t", (), (Section("s", (Shown(table),)),))).decode()
    page.feed(whole[whole.index('<div class="card"') : whole.index('<p class="files">')])
    assert page.cells == [cell for row in (table.head, *table.rows) for cell in row]
    allowed = {"div", "h3", "table", "thead", "tbody", "tr", "th", "td", "ul", "li"}
    assert page.tags <= allowed


@given(st.text(st.characters(codec="ascii", exclude_categories=("Cc",))))
def test_latex_has_no_special_character_of_the_user_s(text):
    made = latex(text)
    plain = re.sub(r"\\(textbackslash|textasciitilde|textasciicircum)\{\}|\$[<>]\$|\\[{}%&#_$]",
                   "", made)  # fmt: skip
    assert not set(plain) & set("\\{}%&#_$~^<>")


@given(tables())
def test_latex_has_a_column_for_every_cell(table):
    lines = to_latex(table).splitlines()
    start, end = lines.index(r"\toprule"), lines.index(r"\bottomrule")
    for line in lines[start + 1 : end]:
        if line != r"\midrule":
            assert len(re.findall(r"(?<!\\)&", line)) == len(table.head) - 1


def test_latex_in_full():
    table = Table("t", "R_critic & more", ("", "ours [%]"), (("S4", "−0.58 (1 to 2)"),), ("≥ 1",))
    made = to_latex(table)
    approve(made, "caption", "0.58")
    assert made.isascii()


@given(cells)
def test_hostile_text_is_data_on_the_page(text):
    hostile = f"<script>alert(1)</script>{{{{css}}}}{text}\"'"
    table = Table(
        "t", hostile, (hostile, "b", "c", "d"), ((hostile, "1", hostile, hostile),), (hostile,)
    )
    page = html(
        Document(
            hostile, (hostile,),
            (Section(hostile, (Text(hostile), Points(((hostile, hostile),)), Command(hostile),
                               Shown(table), Folded(hostile, table, hostile))),),
        )
    ).decode()  # fmt: skip
    assert "<script" not in without_theme(page)
    assert page.count("Content-Security-Policy") == 1


def test_numbers_as_people_read_them():
    from math import inf, nan

    from bridgegen.base.statistics import Quartiles

    assert [number(v, 2) for v in (1234.5, -0.58, -0.001, nan, inf)] == [
        "1,234.50", "−0.58", "0.00", "–", "never"]  # fmt: skip
    assert spread(Quartiles(1.0, 2.0, inf), 1, several=True) == "2.0 (1.0 to never)"
    assert spread(Quartiles(1.0, 2.0, 3.0), 1, several=False) == "2.0"
    assert spread(Quartiles(inf, inf, inf), 1, several=True) == "never"
