"""The picture of the coverage in a real browser: its counts, its keys, both readings."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bridgegen.pages.page import write_report
from bridgegen.scenario.language.coverage import CoverageMap, coverage_map
from bridgegen.scenario.language.kinds import INTEGER
from bridgegen.scenario.language.reader import load

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def show(browser, tmp_path_factory):
    """Write a report and open it; the page keeps what it complained about."""

    def open_(data, **context: Any):
        path = tmp_path_factory.mktemp("coverage") / "report.html"
        write_report(path, data)
        context.setdefault("viewport", {"width": 1280, "height": 720})
        page = browser.new_page(**context)
        page.complaints = []
        page.on("console", lambda m: m.type == "error" and page.complaints.append(m.text))
        page.on("pageerror", lambda error: page.complaints.append(str(error)))
        page.goto(path.as_uri())
        return page

    return open_


@pytest.fixture(scope="module")
def page(show, report):
    page = show(report)
    yield page
    assert page.complaints == []
    page.close()


def label(page) -> str:
    return page.evaluate("document.activeElement.getAttribute('aria-label')")


def test_every_parameter_has_a_strip_with_its_counts(page, report):
    found = report.coverage.total
    strips = page.locator("#strips .strip")
    assert strips.count() == len(found.parameters)
    by_name = {one.name: one for one in found.parameters}
    for k in range(strips.count()):
        name = strips.nth(k).locator(".strip-name").inner_text().split()[0]
        one = by_name.pop(name)
        texts = (
            strips.nth(k)
            .locator(".bin")
            .evaluate_all(
                "cells => cells.map((cell) => [...cell.children].map((part) => part.innerText))"
            )
        )
        assert [int(text[0]) for text in texts] == one.evaluated.tolist()
        hits = [
            int(text[1].lstrip("◆\N{NARROW NO-BREAK SPACE}")) if text[1:] else 0 for text in texts
        ]
        assert hits == one.critical.tolist()
    assert by_name == {}
    axes = page.locator("#strips h4").all_inner_texts()
    assert axes == list(dict.fromkeys(one.axis for one in found.parameters))


def test_the_edges_of_the_bins_stand_below_them(page):
    strips = page.locator("#strips .strip")
    for k in range(strips.count()):
        bins = strips.nth(k).locator(".bins").bounding_box()
        ticks = strips.nth(k).locator(".ticks").bounding_box()
        assert bins["y"] + bins["height"] <= ticks["y"] < bins["y"] + bins["height"] + 10
        assert (ticks["x"], ticks["width"]) == (bins["x"], bins["width"])


def test_the_figures_say_what_feasible_means(page, report):
    texts = page.locator("#ways li").all_inner_texts()
    for text, way in zip(texts, report.coverage.total.ways, strict=True):
        assert f"{way.evaluated:,} of {way.feasible:,} feasible" in text
    assert "estimate" in page.inner_text("#ways-note")
    assert "5,000 random scenarios" in page.inner_text("#ways-note")


def test_a_bin_tells_its_counts_when_pointed_at_and_in_focus(page):
    cell = page.locator("#strips .bin").first
    cell.hover()
    assert page.inner_text("#tip") == cell.get_attribute("aria-label")
    page.mouse.move(1, 1)
    page.locator("#title").scroll_into_view_if_needed()
    page.wait_for_function("document.getElementById('tip').hidden")
    cell.focus()
    assert page.inner_text("#tip") == cell.get_attribute("aria-label")
    page.keyboard.press("ArrowRight")
    assert page.inner_text("#tip") == label(page) != cell.get_attribute("aria-label")
    page.keyboard.press("Escape")
    assert not page.is_visible("#tip")


def test_arrow_keys_reach_every_bin_and_one_stop_is_in_the_tab_order(page, report):
    first = page.locator("#strips [tabindex='0']")
    assert first.count() == 1
    first.focus()
    page.keyboard.press("Home")
    seen = set()
    for _ in range(len(report.coverage.total.parameters)):
        page.keyboard.press("Home")
        for _ in range(5):
            seen.add(label(page))
            page.keyboard.press("ArrowRight")
        page.keyboard.press("ArrowDown")
    assert len(seen) == page.locator("#strips .bin").count()
    assert page.locator("#strips [tabindex='0']").count() == 1


def chosen(page) -> tuple[str, str]:
    first, second = page.inner_text("#pair h4").split(" × ")
    return first, second


def pair_of(coverage: CoverageMap, page):
    return next(p for p in coverage.pairs if {p.first, p.second} == set(chosen(page)))


def test_the_triangle_has_every_pair_with_its_share(page, report):
    cells = page.locator("#matrix .pair")
    assert cells.count() == len(report.coverage.pairs)
    labels = cells.evaluate_all(
        "cells => cells.map((c) => [c.getAttribute('aria-label'), c.innerText])"
    )
    by_title = {text.split(":")[0]: (text, shown) for text, shown in labels}
    for pair in report.coverage.pairs:
        text, shown = by_title[f"{pair.first} × {pair.second}"]
        ways = pair.ways
        assert f"{ways.evaluated} of {ways.feasible} feasible" in text
        assert int(shown) == pytest.approx(100 * ways.share, abs=1.0)
        assert (shown == "100") == (ways.evaluated == ways.feasible)


@pytest.mark.parametrize("which", [0, 7, 30])
def test_a_chosen_pair_shows_its_bins(page, report, which):
    page.locator("#matrix .pair").nth(which).click()
    pair = pair_of(report.coverage, page)
    across, up = chosen(page)
    evaluated, critical = pair.evaluated, pair.critical
    feasible = pair.feasible
    if across != pair.first:
        evaluated, critical, feasible = evaluated.T, critical.T, feasible.T
    cells = page.locator("#pair .bin").evaluate_all(
        "cells => cells.map((c) => [c.className, ...[...c.children].map((part) => part.innerText)])"
    )
    assert len(cells) == evaluated.size
    for k, (state, *texts) in enumerate(cells):
        row, column = divmod(k, evaluated.shape[0])
        at = column, evaluated.shape[1] - 1 - row  # the second parameter goes up
        if not feasible[at]:
            assert (state, texts) == ("bin out", [])
            continue
        assert int(texts[0]) == evaluated[at]
        assert state == f"bin {'hit' if critical[at] else 'seen' if evaluated[at] else 'none'}"
        assert len(texts) == (2 if critical[at] else 1)
    assert page.inner_text("#pair .x-name").startswith(across)
    assert page.inner_text("#pair .y-name").startswith(up)


def test_arrow_keys_choose_in_the_triangle(page):
    page.locator("#matrix .pair").nth(0).click()
    before = chosen(page)
    page.keyboard.press("ArrowDown")
    assert chosen(page)[0] == before[0]
    assert chosen(page)[1] != before[1]
    page.keyboard.press("ArrowRight")
    assert label(page).startswith(" × ".join(chosen(page)))
    assert page.locator("#matrix [aria-current]").count() == 1


def test_the_second_reading_is_of_critical_ones(page, report):
    page.click("#read-critical")
    assert page.get_attribute("#read-critical", "aria-pressed") == "true"
    assert page.get_attribute("#read-evaluated", "aria-pressed") == "false"
    page.locator("#matrix .pair").nth(12).click()
    ways = pair_of(report.coverage, page).ways
    shown = page.locator("#matrix [aria-current]").inner_text()
    assert int(shown) == pytest.approx(100 * ways.critical / ways.feasible, abs=1.0)
    assert "critical" in page.inner_text("#pairs-note")
    page.click("#read-evaluated")


def test_states_differ_by_more_than_colour(page):
    looks = page.evaluate(
        """[...document.querySelectorAll('.bin-legend .bin')].map((cell) => {
             const style = getComputedStyle(cell);
             const hatched = style.backgroundImage !== 'none';
             return [style.borderStyle, hatched, cell.innerText.includes('◆')].join();
           })"""
    )
    assert len(set(looks)) == 4


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_a_phone_scrolls_only_downwards(show, report, scheme):
    page = show(report, viewport={"width": 390, "height": 844}, color_scheme=scheme)
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    page.locator("#pair .bin").last.focus()
    box = page.locator("#tip").bounding_box()
    assert box["x"] >= 0
    assert box["x"] + box["width"] <= 390
    assert page.complaints == []
    page.close()


def test_whole_numbers_many_bins_and_a_pair_too_large(show, report):
    space = load("crossroads-s4").space(["static", "participants", "weather"])
    assert any(space.parameters[name].kind == INTEGER for name in space.variables)
    X = space.decode(np.random.default_rng(0).random((300, space.n_var)))
    found = coverage_map(space, X, X[:, 0] > 1e9, bins=20, strength=1, sample=1000)
    pair = replace(found.pairs[0], evaluated=None, critical=None, feasible=None)
    page = show(replace(report, coverage=replace(found, pairs=(pair, *found.pairs[1:]))))
    page.locator("#matrix .pair").nth(0).click()
    assert "too many to draw" in page.inner_text("#pair")
    page.locator("#matrix .pair").nth(1).click()
    assert page.locator("#pair .bin").count() == found.pairs[1].ways.total
    assert page.evaluate("document.documentElement.scrollWidth") <= 1280
    assert page.complaints == []
    page.close()


def test_without_pairs_or_without_coverage(show, report):
    scenario = load("crossroads-s4")
    names = scenario.space().variables
    alone = scenario.space(fixed={n: scenario.parameters[n].default for n in names[1:]})
    X = alone.decode([[0.5]])
    page = show(replace(report, coverage=coverage_map(alone, X, np.array([True]), sample=0)))
    assert page.is_visible("#strips")
    assert not page.is_visible("#pairs-card")
    assert "could be drawn" in page.inner_text("#ways-note")
    assert page.complaints == []
    page.close()
    page = show(replace(report, coverage=None))
    assert not page.is_visible("#coverage")
    assert page.complaints == []
    page.close()
