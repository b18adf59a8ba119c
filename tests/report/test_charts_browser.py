"""The charts that the page draws itself: what a person sees at a place is what the data says."""

import re
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from tests.approval import approve

from bridgegen.pages.data import Column, ReportData
from bridgegen.pages.page import write_report

pytestmark = pytest.mark.browser

Open = Callable[..., Any]


@pytest.fixture(scope="module")
def show(browser, tmp_path_factory) -> Open:
    """Open a report with its scatter plot in sight and drawn; fail on any complaint."""

    def open_(data: ReportData, **context: Any) -> Any:
        path = tmp_path_factory.mktemp("report") / "report.html"
        write_report(path, data)
        context.setdefault("viewport", {"width": 1280, "height": 720})
        page = browser.new_page(**context)
        page.on("pageerror", lambda error: pytest.fail(str(error)))
        page.goto(path.as_uri())
        page.locator("#scatter").scroll_into_view_if_needed()
        page.wait_for_function("bridgegen.scatter.points?.length")
        return page

    return open_


@pytest.fixture(scope="module")
def opened(show, report):
    page = show(report)
    yield page
    page.close()


@pytest.fixture
def page(opened):
    """The page as it was opened."""
    opened.select_option("#axis-x", "d_min")
    opened.select_option("#axis-y", "ego_speed")
    opened.mouse.move(0, 0)
    opened.locator("#scatter").scroll_into_view_if_needed()
    return opened


def with_values(report: ReportData, name: str, values: np.ndarray) -> ReportData:
    """Return the report with other values of a metric."""
    e = report.evaluations
    metrics = tuple(replace(c, values=values) if c.name == name else c for c in e.metrics)
    return replace(report, evaluations=replace(e, metrics=metrics))


def column(report: ReportData, name: str) -> np.ndarray:
    e = report.evaluations
    return next(c.values for c in (*e.parameters, *e.metrics) if c.name == name)


def marks(page: Any, axis: str, chart: str = "bridgegen.scatter") -> list[tuple[float, str, float]]:
    """Return value, text and pixel of an axis's marks."""
    a = f"{chart}.{axis}"
    found = page.evaluate(f"{a}.marks(60).map((m) => [m.value, m.text, {a}.at(m.value)])")
    return [tuple(one) for one in found]


def box_of(page: Any) -> dict[str, float]:
    return page.locator("#scatter .chart-stage canvas").bounding_box()


def pixel_of(page: Any, evaluation: int) -> tuple[float, float]:
    x, y = page.evaluate(f"bridgegen.scatter.pixelOf({evaluation})")
    return x, y


def lone(report: ReportData, *, critical: bool) -> int:
    """Return an evaluation of which no other point is near, in d_min and ego_speed."""
    at = np.stack([column(report, "d_min"), column(report, "ego_speed")], axis=1)
    at = at / np.ptp(at, axis=0)
    apart = np.hypot(*(at[:, None] - at[None]).transpose(2, 0, 1))
    np.fill_diagonal(apart, np.inf)
    kept = [p.evaluation for p in report.kept]
    fits = (report.evaluations.critical == critical) & ~np.isin(np.arange(len(at)), kept)
    return int(np.where(fits, apart.min(axis=1), -1.0).argmax())


def colour_at(page: Any, x: float, y: float) -> list[int]:
    return page.evaluate(
        """([x, y]) => {
             const { canvas } = bridgegen.scatter, r = canvas.width / canvas.clientWidth;
             const c = canvas.getContext("2d");
             const { data } = c.getImageData(Math.round(x * r), Math.round(y * r), 1, 1);
             return [...data].slice(0, 3);
           }""",
        [x, y],
    )


def test_marks_are_round_and_in_proportion(page):
    for axis in "xy":
        found = marks(page, axis)
        values, texts, pixels = zip(*found, strict=True)
        step = values[1] - values[0]
        assert np.diff(values) == pytest.approx(step)
        assert float(f"{step:e}".partition("e")[0]) in (1.0, 2.0, 5.0)
        assert np.array(values) / step == pytest.approx(np.round(np.array(values) / step))
        assert [float(text.replace("−", "-")) for text in texts] == pytest.approx(values)
        assert np.diff(pixels) == pytest.approx(np.diff(pixels)[0])


@pytest.mark.parametrize("critical", [True, False])
def test_a_point_is_where_its_values_say(page, report, critical):
    evaluation = lone(report, critical=critical)
    at = []
    for axis, name in (("x", "d_min"), ("y", "ego_speed")):
        (v0, _, p0), *_, (v1, _, p1) = marks(page, axis)
        value = column(report, name)[evaluation]
        at.append(p0 + (value - v0) / (v1 - v0) * (p1 - p0))
    assert pixel_of(page, evaluation) == pytest.approx(at, abs=0.05)
    # The point's colour: critical ones are orange, others blue; the card is white.
    r, _, b = colour_at(page, *at)
    assert (r > b + 60) if critical else (b > r + 20)


def test_pointing_shows_the_values_of_the_nearest_point(page, report):
    evaluation, box = lone(report, critical=True), box_of(page)
    x, y = pixel_of(page, evaluation)
    assert page.locator(".chart-tip:visible").count() == 0
    page.mouse.move(box["x"] + x + 3, box["y"] + y + 2)
    text = page.inner_text(".chart-tip:visible")
    assert f"Evaluation {evaluation + 1}" in text
    shown = float(re.search(r"d_min ([\d.]+)", text)[1])
    assert shown == pytest.approx(column(report, "d_min")[evaluation], rel=1e-3, abs=1e-3)
    shown = float(re.search(r"ego_speed ([\d.]+)", text)[1])
    assert shown == pytest.approx(column(report, "ego_speed")[evaluation], rel=1e-3)
    assert "critical, rank" in text
    page.mouse.move(box["x"] + x + 300, box["y"] - 40)
    assert page.locator(".chart-tip:visible").count() == 0


def test_a_click_on_an_exported_point_plays_it(page, report):
    one, box = report.kept[2], box_of(page)
    x, y = pixel_of(page, one.evaluation)
    page.mouse.click(box["x"] + x, box["y"] + y)
    page.wait_for_function(f"bridgegen.state().scenario === '{one.name}'")
    page.wait_for_function("bridgegen.state().playing")
    assert page.locator("#scene").bounding_box()["y"] < 720  # in sight
    page.evaluate("bridgegen.pause()")


def test_a_click_on_a_point_without_motion_gives_the_command(page, report, show):
    data = replace(report, summary=replace(report.summary, view="bridgegen open 'runs/s 4'"))
    other = show(data)
    other.select_option("#axis-x", "d_min")
    other.select_option("#axis-y", "ego_speed")
    other.locator("#scatter").scroll_into_view_if_needed()
    evaluation, box = lone(report, critical=False), box_of(other)
    x, y = pixel_of(other, evaluation)
    other.mouse.move(box["x"] + x, box["y"] + y)
    assert "to play it: bridgegen open" in other.inner_text(".chart-tip:visible")
    other.mouse.click(box["x"] + x, box["y"] + y)
    want = f"bridgegen open 'runs/s 4' --evaluation {evaluation + 1}"
    assert other.inner_text("#no-motion-command") == want
    other.close()


def test_keys_lead_from_point_to_point_and_are_said(page, report):
    page.focus("#scatter .chart-stage canvas")
    d_min = np.sort(column(report, "d_min"))
    seen = []
    for key in ("End", "ArrowLeft", "ArrowLeft"):
        page.keyboard.press(key)
        said = page.inner_text("#scatter [role=status]")
        seen.append(float(re.search(r"d_min ([\d.]+)", said)[1]))
    assert seen == pytest.approx(d_min[::-1][:3], rel=1e-3)
    page.keyboard.press("Escape")
    assert page.locator(".chart-tip:visible").count() == 0


def test_dragging_zooms_and_the_button_resets(page):
    box = box_of(page)
    (v0, _, p0), (v1, _, p1) = marks(page, "x")[1:3]
    (w0, _, q0), (w1, _, q1) = marks(page, "y")[1:3]
    page.mouse.move(box["x"] + p0, box["y"] + q0)
    page.mouse.down()
    page.mouse.move(box["x"] + p1, box["y"] + q1, steps=3)
    page.mouse.up()
    ends = page.evaluate("[...'xy'].map((a) => bridgegen.scatter[a]).map((a) => [a.low, a.high])")
    assert ends == pytest.approx(np.array([[v0, v1], [w0, w1]]), rel=5e-3)
    page.click("#scatter-reset")
    assert page.evaluate("bridgegen.scatter.zoom.ends") is None
    assert page.is_hidden("#scatter-reset")


def test_the_legend_hides_a_series(page):
    before = page.evaluate("bridgegen.scatter.points.length")
    button = page.locator("#scatter .chart-legend button", has_text="not critical")
    count = int(re.search(r"\((\d+)\)", button.inner_text())[1])
    button.click()
    assert page.evaluate("bridgegen.scatter.points.length") == before - count
    button.click()
    assert page.evaluate("bridgegen.scatter.points.length") == before


def test_a_few_values_do_not_rule_an_axis(report, show):
    n = report.evaluations.critical.size
    values = np.linspace(1.0, 9.0, n)
    values[[5, 40]] = 900.0, 1200.0
    page = show(with_values(report, "v_d", values))
    page.select_option("#axis-x", "v_d")
    axis = page.evaluate("bridgegen.scatter.x")
    assert (axis["below"], axis["above"]) == (0, 2)
    assert 9.0 <= axis["high"] < 20.0
    (text,) = page.evaluate("bridgegen.scatter.x.beyond(['', '▶'])")
    assert text.startswith("2 values above")
    assert "1,200" in text
    # They are at the end of the axis, can be pointed at, and say what they are.
    right, box = page.evaluate("bridgegen.scatter.box.right"), box_of(page)
    x, y = pixel_of(page, 40)
    assert x == pytest.approx(right)
    page.mouse.move(box["x"] + x, box["y"] + y)
    assert "v_d 1200" in page.inner_text(".chart-tip:visible")
    page.click("#scatter-whole")
    assert page.evaluate("bridgegen.scatter.x.high") >= 1200
    assert page.evaluate("bridgegen.scatter.x.above") == 0
    page.close()


def test_values_of_many_magnitudes_have_a_logarithmic_axis(report, show):
    n = report.evaluations.critical.size
    page = show(with_values(report, "v_d", 10.0 ** np.linspace(-1, 3, n)))
    page.select_option("#axis-x", "v_d")
    values, texts, pixels = zip(*marks(page, "x"), strict=True)
    assert page.evaluate("bridgegen.scatter.x.log")
    assert np.diff(np.log10(values)) == pytest.approx(1.0)
    assert np.diff(pixels) == pytest.approx(np.diff(pixels)[0])
    assert {"0.1", "1", "1,000"} <= set(texts)
    page.close()


def test_both_themes_are_drawn_when_the_theme_changes(report, show):
    page = show(report)
    light = colour_at(page, 100, 5)
    page.emulate_media(color_scheme="dark")
    page.wait_for_function("getComputedStyle(document.body).color === 'rgb(231, 236, 243)'")
    page.evaluate("new Promise((r) => requestAnimationFrame(() => requestAnimationFrame(r)))")
    text = page.evaluate(
        """() => { // the lightest pixel among the texts of the Y axis
             const { canvas } = bridgegen.scatter;
             const { data } = canvas.getContext("2d").getImageData(0, 0, 60, canvas.height);
             let most = 0;
             for (let i = 0; i < data.length; i += 4) {
               if (data[i + 3] > 200) most = Math.max(most, data[i]);
             }
             return most;
           }"""
    )
    assert text > 200  # ink on a dark ground; on a light one nothing there is as light
    assert light == [0, 0, 0]  # transparent: the card is its ground
    page.close()


def test_medians_over_the_iterations(page, report):
    page.locator("#trend-plots .plot").first.scroll_into_view_if_needed()
    page.wait_for_function("bridgegen.trends[0].points")
    e = report.evaluations
    d_min = column(report, "d_min")
    want = [np.median(d_min[e.iteration == k]) for k in np.unique(e.iteration)]
    (v0, _, p0), *_, (v1, _, p1) = marks(page, "y", "bridgegen.trends[0]")
    drawn = [page.evaluate(f"bridgegen.trends[0].pixelOf('median', {k})[1]") for k in range(3)]
    assert [v0 + (p - p0) / (p1 - p0) * (v1 - v0) for p in drawn] == pytest.approx(want, abs=2e-3)
    box = page.locator("#trend-plots .chart-stage canvas").first.bounding_box()
    x, _ = page.evaluate("bridgegen.trends[0].pixelOf('median', 1)")
    page.mouse.move(box["x"] + x + 2, box["y"] + 60)
    text = page.inner_text("#trend-plots .chart-tip:visible")
    assert "iteration 2" in text
    assert float(re.search(r"median ([\d.]+)", text)[1]) == pytest.approx(want[1], rel=1e-3)


def test_screen_readers_are_told_what_the_charts_show(page, report):
    label = page.get_attribute("#scatter canvas[role=img]", "aria-label")
    critical = int(report.evaluations.critical.sum())
    approve(label, "ego_speed", "d_min", critical)
    page.locator("#trend-plots .plot").first.scroll_into_view_if_needed()
    page.wait_for_function("bridgegen.trends[0].points")
    label = page.get_attribute("#trend-plots canvas[role=img]", "aria-label")
    first = column(report, "d_min")[report.evaluations.iteration == 0]
    assert f"in iteration 1 median {np.median(first):.4g} m" in label


def test_hostile_names_are_text(report, show):
    evil = '<img src=x onerror="window.hacked=1"><b>%{x}'
    e = report.evaluations
    column_ = Column(evil, "m", e.parameters[0].values, searched=True)
    page = show(replace(report, evaluations=replace(e, parameters=(column_, *e.parameters[1:]))))
    page.select_option("#axis-x", evil)
    page.focus("#scatter .chart-stage canvas")
    page.keyboard.press("Home")
    assert evil in page.inner_text(".chart-tip:visible")
    assert page.evaluate("window.hacked") is None
    page.close()


def test_names_of_the_parallel_coordinates_do_not_overlap_on_a_phone(report, show):
    page = show(report, viewport={"width": 390, "height": 844})
    page.evaluate(
        """() => {
             const drawn = CanvasRenderingContext2D.prototype.fillText;
             window.texts = [];
             CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
               if (this.canvas.id === "parallel" && y < 40) {
                 const w = this.measureText(text).width;
                 const from = x - { left: 0, center: w / 2, right: w }[this.textAlign];
                 window.texts.push([y, from, from + w]);
               }
               drawn.apply(this, arguments);
             };
             window.dispatchEvent(new Event("resize"));
           }"""
    )
    page.locator("#parallel").scroll_into_view_if_needed()
    page.emulate_media(color_scheme="dark")
    page.wait_for_function("window.texts.length > 4")
    texts = page.evaluate("window.texts")
    for y in {one[0] for one in texts}:
        ends = sorted({(a, b) for at, a, b in texts if at == y})
        assert all(b < c for (_, b), (c, _) in pairwise(ends))
    page.close()


def test_a_participant_that_stops_dead_does_not_rule_the_acceleration(report, show):
    p = report.kept[0]
    a = np.zeros((2, 401))
    a[0, 20:40] = -4.3
    a[1, 60], a[1, 90] = -170.0, 80.0
    v = p.v.copy()
    v[1, 30] = 400.0
    page = show(replace(report, kept=(replace(p, a=a, v=v), *report.kept[1:])))
    panels = page.evaluate(
        "bridgegen.curves.panels.map((p) => ({ name: p.title, low: p.low, beyond: p.beyond }))"
    )
    found = {one["name"]: one for one in panels}
    assert -6.0 < found["acceleration"]["low"] < -4.3  # the ego's braking is most of the axis
    beyond = [(one["name"], one["value"], one["index"]) for one in found["acceleration"]["beyond"]]
    assert beyond == [("bv", 80.0, 90), ("bv", -170.0, 60)]
    assert [one["value"] for one in found["speed"]["beyond"]] == [400.0]
    assert found["distance"]["beyond"] == []
    page.close()


def test_of_a_searched_parameter_every_value_is_in_its_place(report, show):
    e = report.evaluations
    values = np.append(np.linspace(5.0, 5.1, e.critical.size - 1), 8.9)
    first = replace(e.parameters[0], values=values)
    page = show(replace(report, evaluations=replace(e, parameters=(first, *e.parameters[1:]))))
    page.select_option("#axis-x", first.name)
    x = page.evaluate("bridgegen.scatter.x")
    assert x["low"] < 5.0 < 8.9 < x["high"]
    assert x["above"] == 0
    page.close()


def test_without_critical_scenarios_a_click_gives_the_command(report, show):
    e = report.evaluations
    none = replace(e, critical=np.zeros_like(e.critical))
    page = show(replace(report, kept=(), evaluations=none))
    assert page.is_hidden("#player")
    page.focus("#scatter .chart-stage canvas")
    page.keyboard.press("End")
    page.keyboard.press("Enter")
    page.wait_for_selector("#no-motion", state="visible")
    evaluation = int(column(report, page.input_value("#axis-x")).argmax())
    assert page.inner_text("#no-motion-command").endswith(f"--evaluation {evaluation + 1}")
    page.close()
