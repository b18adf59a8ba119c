"""The page in a real browser: it asks nobody for anything, and fits a phone."""

import pytest

from bridgegen_reproduction.document import Document, Folded, Picture, Points, Section, Shown
from bridgegen_reproduction.figures.look import DARK, LIGHT, blank, png
from bridgegen_reproduction.page import html
from bridgegen_reproduction.table import Table

pytestmark = pytest.mark.browser


@pytest.mark.parametrize(("width", "height"), [(1280, 720), (400, 800)])
def test_it_loads_and_nothing_but_tables_and_figures_is_wider_than_the_screen(
    browser, tmp_path, width, height
):
    head = tuple(f"a long name of a column {k}" for k in range(12))
    table = Table("table-6", "Table VI", head, (head,) * 3, ("a note",))
    command = "bridgegen search crossroads-s4 " + "--set population=40 " * 20
    runs = Table("runs", "runs", ("a", "b", "folder", "command"), (("1", "2", "f", command),))
    light, dark = (png(blank(7.16, 3.0, theme)) for theme in (LIGHT, DARK))
    document = Document(
        "The paper’s evaluation", ("a fact",) * 12,
        (Section("One", (Points((("what", "why " * 40),)), Shown(table),
                         Picture("p", "caption", light, dark, b""),
                         Folded("Every run", runs, "runs.csv"))),),
    )  # fmt: skip
    path = tmp_path / "index.html"
    path.write_bytes(html(document))
    page = browser.new_page(viewport={"width": width, "height": height})
    complaints, requests = [], []
    page.on("console", lambda message: complaints.append(message.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("request", lambda request: requests.append(request.url))
    page.goto(path.as_uri())
    page.click("summary >> nth=0")
    assert complaints == []
    assert [url for url in requests if not url.startswith(("file:", "data:"))] == []
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.evaluate("document.querySelector('img').naturalWidth") > 1000
    page.close()
