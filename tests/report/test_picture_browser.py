"""The picture in a real browser: boxes, folds, links, and red where a constraint is violated."""

import re
from dataclasses import replace
from typing import Any

import pytest
from tests.approval import approve

from bridgegen.pages.page import write_report
from bridgegen.pages.painter import paint
from bridgegen.pages.scenario_page import show_file
from bridgegen.scenario.ontology.files import save

pytestmark = pytest.mark.browser
DESK, PHONE = {"width": 1280, "height": 720}, {"width": 400, "height": 800}
FOG = re.compile(r"(<bg:has_fog_density[^>]*>)[^<]*<")
WIDTH = re.compile(r"<bg:has_width[^>]*>[^<]*</bg:has_width>")


@pytest.fixture(scope="module")
def look(browser, tmp_path_factory, individuals):
    """Show the file, edited or not; a page keeps what it complained about."""

    def open_(edit: Any = str, **context: Any) -> Any:
        owl = tmp_path_factory.mktemp("picture") / "it.owl"
        save(individuals, owl)
        owl.write_text(edit(owl.read_text(encoding="utf-8")), encoding="utf-8")
        page = browser.new_page(**{"viewport": DESK, **context})
        page.complaints = []
        page.on("console", lambda m: page.complaints.append(m.text))
        page.on("pageerror", lambda error: page.complaints.append(str(error)))
        page.on("request", lambda one: page.complaints.append(one.url))
        page.goto(show_file(owl)[0].as_uri())
        assert [one for one in page.complaints if one not in (page.url, "data:,")] == []
        return page

    return open_


@pytest.fixture(scope="module")
def page(look):
    page = look()
    yield page
    page.close()


def text(page: Any, id_: str) -> str:
    shown = page.inner_text(f'[data-id="{id_}"]')
    return " ".join(shown.replace("\N{NARROW NO-BREAK SPACE}", " ").split())


def linked(page: Any) -> set[str]:
    return set(
        page.evaluate(
            "[...document.querySelectorAll('.linked')]"
            ".map((e) => e.dataset.id ?? e.querySelector('.head').innerText)"
        )
    )


def group(page: Any, name: str) -> Any:
    return page.locator(".group", has_text=name).first


def colour(page: Any, name: str) -> str:
    """A colour of the style sheet as the browser computes it."""
    return page.evaluate(
        """(name) => {
             const probe = document.body.appendChild(document.createElement("i"));
             probe.style.color = `var(${name})`;
             const found = getComputedStyle(probe).color;
             probe.remove();
             return found;
           }""",
        name,
    )


def test_five_columns_side_by_side_with_counts(page):
    heads = [one.inner_text().split() for one in page.locator(".columns h3").all()]
    assert [(one[0], one[-1]) for one in heads] == [
        ("1", "34"), ("2", "21"), ("3", "2"), ("4", "7"), ("5", "7"),
    ]  # fmt: skip
    boxes = [one.bounding_box() for one in page.locator(".columns > section").all()]
    lefts = [box["x"] for box in boxes]
    assert lefts == sorted(lefts)
    assert len({round(box["y"]) for box in boxes}) == 1
    assert boxes[-1]["x"] + boxes[-1]["width"] <= DESK["width"]


def test_values_parameters_and_words_are_there(page, values):
    assert f"speed {values['ego_speed']:.4g} m/s" in text(page, "ego")
    assert "ego_speed 4.9 to 8.9 m/s" in text(page, "ego")
    assert "wheelbase" not in text(page, "ego")
    assert "when time ≥" in text(page, "bv_sets_off")
    assert "constraints checked" in page.inner_text(".verdict")
    assert page.locator(".bad").count() == 0


def test_a_group_opens_by_keyboard(page):
    lanes = group(page, "lane × 16")
    assert lanes.locator("[data-id]").count() == 0
    lanes.locator("summary").first.focus()
    page.keyboard.press("Enter")
    page.wait_for_selector("[data-id=leg_D_out_2]")
    assert lanes.locator("[data-id]").count() == 16
    page.keyboard.press("Enter")
    page.wait_for_function("!document.querySelector('[data-id=leg_D_out_2]').checkVisibility()")


def test_links_show_on_focus_and_on_hover(page):
    page.focus("[data-id=ego]")
    assert linked(page) == {"lane × 16", "bv_sets_off", "bv_moves_over"}
    assert page.locator(".links path").count() == 3
    labels = page.locator(".links text").all_text_contents()
    approve(labels, "leg_C_in_1")
    page.hover("[data-id=works] b")
    assert {"lane × 16", "road × 4"} <= linked(page)
    page.mouse.move(2, 2)
    page.evaluate("document.activeElement.blur()")
    assert linked(page) == set()
    assert page.locator(".links path").count() == 0


def test_a_line_ends_at_the_box_that_it_leads_to(page):
    page.focus("[data-id=queue]")
    frame = page.locator(".columns").bounding_box()
    box = page.locator("[data-id=queue_1]").bounding_box()
    tips = page.evaluate(
        "[...document.querySelectorAll('.links circle')]"
        ".map((e) => [Number(e.getAttribute('cx')), Number(e.getAttribute('cy'))])"
    )
    at = [(frame["x"] + x, frame["y"] + y) for x, y in tips]
    assert any(
        abs(x - box["x"]) < 2 and box["y"] < y < box["y"] + box["height"] for x, y in at
    )  # the participants are to the right of the changes
    page.evaluate("document.activeElement.blur()")


def test_all_values_and_links_open_in_words(page):
    page.locator("[data-id=ego] > .more > summary").click()
    page.wait_for_selector("[data-id=ego] .more .fact")
    assert "wheelbase 2.8 m" in text(page, "ego")
    page.locator("[data-id=ego] .jump", has_text="leg_C_in_1").first.click()
    assert page.evaluate("document.activeElement.dataset.id") == "leg_C_in_1"
    assert page.locator("[data-id=leg_C_in_1]").is_visible()
    assert "of ego" not in text(page, "leg_C_in_1")  # closed
    page.locator("[data-id=leg_C_in_1] > .more > summary").click()
    page.wait_for_selector("[data-id=leg_C_in_1] .more .fact")
    assert "starts at of ego" in text(page, "leg_C_in_1").replace("; ", " ")


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_violation_is_red_with_a_mark_and_the_reason(look, scheme):
    page = look(lambda owl: FOG.sub(r"\g<1>140<", owl, count=1), color_scheme=scheme)
    fog = page.locator("[data-id=weather_fog]")
    style = "(e) => [getComputedStyle(e).borderTopColor, getComputedStyle(e).borderLeftStyle]"
    assert fog.evaluate(style) == [colour(page, "--hit"), "double"]
    assert page.locator("[data-id=weather_rain]").evaluate(style)[1] == "solid"
    assert fog.locator(".mark").inner_text().startswith("✗")
    assert "violates a constraint" in fog.get_attribute("aria-label")
    assert "0 <= fog_density <= 100 must hold for fog_density [%], got 140" in text(
        page, "weather_fog"
    )
    wrong = fog.locator(".wrong b").first
    assert wrong.evaluate("(e) => getComputedStyle(e).textDecorationLine") == "underline"
    assert page.locator(".box.bad").count() == 1
    assert "violation" in page.inner_text(".verdict.bad")
    page.locator(".verdict .jump").first.click()
    assert page.evaluate("document.activeElement.dataset.id") == "weather_fog"
    page.close()


def test_a_violated_member_of_a_group_is_not_hidden(look):
    page = look(lambda owl: WIDTH.sub("", owl, count=1))
    assert page.locator(".box.bad").is_visible()
    assert group(page, "lane × 15").is_visible()
    page.close()


def test_on_a_phone_the_columns_scroll_and_the_page_does_not(look):
    page = look(lambda owl: FOG.sub(r"\g<1>140<", owl, count=1), viewport=PHONE)
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
    page.locator(".verdict .jump").first.click()
    box = page.locator("[data-id=weather_fog]").bounding_box()
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= PHONE["width"]
    assert box["width"] > 250
    page.close()


def test_hostile_names_are_text(look):
    evil = "&lt;/script&gt;&lt;img src=x onerror=window.hacked=1&gt;"
    page = look(lambda owl: owl.replace(">ego</bg:has_name>", f">{evil}</bg:has_name>", 1))
    assert "<img src=x" in text(page, "ego")
    assert page.evaluate("window.hacked") is None
    page.close()


def test_in_the_report_it_follows_the_chosen_scenario(browser, tmp_path, report, individuals):
    picture = paint(individuals, (), "7 constraints checked")
    named = [replace(picture, facts=()), replace(picture, boxes=picture.boxes[:3])]
    kept = (
        replace(report.kept[0], picture=named[0]),
        replace(report.kept[1], picture=named[1]),
        *report.kept[2:],
    )
    write_report(tmp_path / "report.html", replace(report, kept=kept))
    page = browser.new_page(viewport=DESK)
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto((tmp_path / "report.html").as_uri())
    assert page.inner_text("#made-of-title") == "What scenario 0001 is made of"
    assert page.locator("#layers [data-id=ego]").count() == 1
    assert "7 constraints checked: all are kept." in page.inner_text("#layers .verdict")
    page.locator("#list-body tr button").nth(1).click()
    assert page.inner_text("#made-of-title") == "What scenario 0002 is made of"
    assert page.locator("#layers [data-id=ego]").count() == 0
    page.evaluate("bridgegen.pause(); bridgegen.select(2)")
    assert not page.is_visible("#made-of")
    assert errors == []
    page.close()
