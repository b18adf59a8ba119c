"""The page and its drawing: all that the case says, in the shapes of the notation, offline."""

import re
from html.parser import HTMLParser
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.pages import without_theme

from bridgegen.jobs.safety_case.drawing import MOST_LINES, drawing, layout, wrapped
from bridgegen.jobs.safety_case.numbers import written

RUNS = ["fails", "unlucky", "clean", "judged", "all"]


class Text(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.text, self.ids, self.links, self.tags = "", [], [], set()

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.tags.add(tag)
        self.ids += [found["id"]] if "id" in found else []
        self.links += [found["href"]] if tag == "a" else []

    def handle_data(self, data):
        self.text += data


@pytest.mark.parametrize("name", RUNS)
def test_the_page_has_all_of_the_case(cases, name):
    found, page = cases[name], Text()
    page.feed(without_theme(found.page.read_text("utf-8")))
    for one in found.case.elements:
        assert page.ids.count(one.id) == 1
        assert one.statement.text in page.text
        assert f"#{one.id}" in page.links
        assert all(line.text in page.text for line in one.details)
    for one in found.case.evidence:
        assert one.sha256 in page.text
        assert one.file in page.links
    assert not page.tags & {"script", "img", "iframe"}
    assert {link.partition("#")[0] for link in page.links} - {
        "", *(one.file for one in found.case.evidence)
    } == set()  # fmt: skip
    assert not re.findall(r"(?:src|href)=\"(?:https?:)?//", found.page.read_text("utf-8"))


@pytest.mark.parametrize("name", ["fails", "clean", "judged"])
def test_shapes_are_those_of_the_notation(cases, name):
    case = cases[name].case
    made = drawing(layout(case, "G1"), "an argument")
    root = ElementTree.fromstring(made)
    shape = {
        "Goal": "rect", "CounterGoal": "rect", "Strategy": "polygon", "Context": "rect",
        "Solution": "circle", "CounterSolution": "circle", "Assumption": "ellipse",
        "Justification": "ellipse",
    }  # fmt: skip
    drawn = {one.get("href")[1:]: one for one in root.iter("a")}
    assert drawn.keys() == {one.id for one in case.elements}
    for one in case.elements:
        parts = drawn[one.id]
        (own,) = (part for part in parts if part.get("class") == "shape")
        assert own.tag == shape[one.kind]
        assert (own.get("rx") is not None) == (
            one.kind in ("Context", "Assumption", "Justification")
        )
        marks = [part.get("class") for part in parts]
        assert ("diamond" in marks) == one.undeveloped
        assert ("cross" in marks) == one.defeated
        assert parts.find("title").text.startswith(f"{one.id}: {one.statement.text}")
    kinds = [one.get("class") for one in root.iter("polyline")]
    assert sorted(kinds) == sorted(one.kind.lower() for one in case.relations)


@pytest.mark.parametrize("name", ["fails", "clean", "judged"])
def test_nothing_overlaps_and_all_is_inside(cases, name):
    found = layout(cases[name].case, "G1")
    assert found.width <= 1400.0
    for one in found.boxes:
        assert 0.0 <= one.x <= one.x + one.width <= found.width + 1e-6
        assert 0.0 <= one.y <= one.bottom <= found.height
    for i, a in enumerate(found.boxes):
        for b in found.boxes[:i]:
            across = min(a.x + a.width, b.x + b.width) - max(a.x, b.x)
            assert across <= 1e-6 or min(a.bottom, b.bottom) - max(a.y, b.y) <= 1e-6, (
                a.element.id, b.element.id,
            )  # fmt: skip


def test_text_of_a_user_is_escaped(made, tmp_path, run, edited):
    import bridgegen as bg

    folder = run("fails")

    def hostile(data):
        data["ego"] = '<img src=x onerror=alert(1)>"'
        data["modes"][0]["title"] = "<script>alert(1)</script> {R1.harmful} {0}"

    edited(folder / "triage.json", hostile)
    found = bg.export_safety_case([folder])
    text = found.page.read_text("utf-8")
    assert "<script" not in without_theme(text)
    assert "<img" not in text
    assert "&lt;script&gt;alert(1)&lt;/script&gt; {R1.harmful} {0}" in text


@given(st.text(max_size=120), st.floats(20.0, 120.0))
def test_lines_fit(text, width):
    lines = wrapped(text, width)
    assert 1 <= len(lines) <= MOST_LINES
    assert all(len(line) <= max(8, int(width / 6.1)) for line in lines)


@given(st.floats(0.0, 1.0))
def test_bounds_are_rounded_outwards(share):
    low, high = (
        float(written(share, form).removesuffix(" %")) for form in ("percent_down", "percent_up")
    )
    assert low <= 100.0 * share * (1 + 1e-15)
    assert high >= 100.0 * share * (1 - 1e-15)
    assert high - low <= 0.0101 * 100.0 * share + 1e-300
