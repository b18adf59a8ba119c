"""The playback of real rollouts in a real browser: at any time it draws what the simulator did."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bridgegen.assess.metrics.perception import perceived
from bridgegen.assess.metrics.times import ttc_over_time
from bridgegen.drivers import _weather_columns as column
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.pages.page import write_report
from bridgegen.pages.playbacks import playbacks
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.embedded.simulator import weathers

pytestmark = pytest.mark.browser

SHARES = (0.2, 0.5, 0.9)


class Case:
    """Some rows of a scenario, rolled out, and the page that plays them."""

    def __init__(self, name: str, fixed: dict[str, float], ego: str = "reference") -> None:
        n, logical = 2, load(name)
        space = logical.space(fixed=fixed)
        self.pipeline = Pipeline(logical, space, PipelineOptions(ego=ego))
        self.X = space.decode(np.random.default_rng(5).random((n, space.n_var)))
        self.rollout = self.pipeline.rollout(self.X)
        if self.rollout.detections.size:
            self.counts = perceived(self.rollout).counts
        self.ttc = ttc_over_time(self.rollout)
        rows: Any = SimpleNamespace(
            X=self.X, metrics=np.zeros((n, len(self.pipeline.metrics))),
            critical=np.ones(n, dtype=bool), cause=np.zeros(n, dtype=np.int8),
            take=lambda at: rows,
        )  # fmt: skip
        kept = [(f"{k + 1:04d}", k, ()) for k in range(n)]
        self.kept = playbacks(self.pipeline, rows, kept)

    def steps(self, row: int) -> list[int]:
        return [round(share * (self.rollout.n_steps[row] - 1)) for share in SHARES]


@pytest.fixture(scope="module")
def lights():
    return Case("red-light-runner", {})


@pytest.fixture(scope="module")
def fog():
    """A queue in the fog by night, seen late, wrongly, or never."""
    return Case("jam-tail-in-fog", {"fog_density": 70.0, "sun_altitude_angle": -30.0})


@pytest.fixture(scope="module")
def show(browser, build, tmp_path_factory):
    made = []

    def open_(case: Case, fragment: str = "", **context: Any) -> Any:
        path = tmp_path_factory.mktemp("playback") / "report.html"
        write_report(path, replace(build(60, 0), kept=case.kept))
        context.setdefault("viewport", {"width": 1280, "height": 720})
        page = browser.new_page(**context)
        page.complaints = []
        page.on("pageerror", lambda error: page.complaints.append(str(error)))
        page.on("console", lambda m: page.complaints.append(m.text) if m.type == "error" else None)
        page.goto(path.as_uri() + fragment)
        page.evaluate("bridgegen.pause?.()")  # the worst one has begun to play
        made.append(page)
        return page

    yield open_
    for page in made:
        page.close()


@pytest.fixture(scope="module", params=["lights", "fog"])
def opened(request, show):
    case = request.getfixturevalue(request.param)
    return case, show(case)


def state(page: Any) -> dict[str, Any]:
    return page.evaluate("bridgegen.state()")


def states(page: Any, row: int, steps: list[int]) -> list[dict[str, Any]]:
    """What is drawn of a row at some instants, each with the words for it."""
    return page.evaluate(
        """([row, steps]) => {
             bridgegen.select(row);
             return steps.map((k) => {
               bridgegen.seek(k);
               return { ...bridgegen.state(), told: document.getElementById("now").textContent };
             });
           }""",
        [row, steps],
    )


PIXELS = """() => { const canvas = document.getElementById("scene");
  return canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data
    .reduce((sum, value, i) => (sum + value * ((i % 251) + 1)) % 1000003, 0); }"""
"""A number that another picture has not."""


def frame_of(case: Case, row: int, k: int) -> int:
    """The latest instant up to k at which the sensors took a frame."""
    taken = (case.rollout.detections[row, 1:, : k + 1, 0] >= 0).any(axis=0)
    return int(np.flatnonzero(taken)[-1])


def expected(case: Case, row: int, e: int, k: int) -> tuple[str | None, tuple[float, float]]:
    """What the metrics would say of an entity at the latest frame, and where it was detected."""
    rollout, at = case.rollout, frame_of(case, row, k)
    seen = rollout.detections[row, e, at]
    there = rollout.present[row, e, at] if rollout.present.size else True
    if not there or (seen[0] <= 0 and not case.counts[row, e, at]):
        return None, (0.0, 0.0)
    if seen[0] <= 0:
        return "missed", (0.0, 0.0)
    h, ahead = rollout.h[row, e, at], rollout.box[e, 2]
    truth = rollout.x[row, e, at] + ahead * math.cos(h), rollout.y[row, e, at] + ahead * math.sin(h)
    off = math.dist(truth, seen[1:3])
    return ("displaced" if off > 0.5 else "seen"), (float(seen[1]), float(seen[2]))


def test_bodies_are_where_the_rollout_has_them(opened):
    case, page = opened
    rollout = case.rollout
    for row in range(len(case.X)):
        for k, shown in zip(case.steps(row), states(page, row, case.steps(row)), strict=True):
            assert (shown["index"], len(shown["entities"])) == (k, len(rollout.names))
            for e, body in enumerate(shown["entities"]):
                if rollout.present.size and not rollout.present[row, e, k]:
                    assert body["x"] is None
                    continue
                for axis, within in (("x", 5e-3), ("y", 5e-3), ("h", 1e-3), ("v", 5e-3)):
                    assert body[axis] == pytest.approx(
                        getattr(rollout, axis)[row, e, k], abs=within
                    ), (row, k, e, axis)
                assert shown["a"][e] == pytest.approx(rollout.a[row, e, k], abs=0.006)
            nearest, ttc = rollout.distance[row, :, k].min(), case.ttc[row, k]
            assert shown["distance"] == pytest.approx(nearest, abs=1e-3)
            if math.isfinite(ttc):
                assert shown["ttc"] == pytest.approx(ttc, abs=0.006)
            else:
                assert shown["ttc"] is None


def test_between_two_instants_it_is_between_them(opened):
    case, page = opened
    page.evaluate("bridgegen.select(0)")
    k = case.steps(0)[1]
    page.evaluate(f"bridgegen.seek({k + 0.25})")
    x = case.rollout.x[0, 0]
    assert state(page)["entities"][0]["x"] == pytest.approx(0.75 * x[k] + 0.25 * x[k + 1], abs=5e-3)


def test_lights_show_what_the_simulator_s_showed(show, lights):
    page = show(lights)
    rollout, shown = lights.rollout, set()
    names = page.evaluate("bridgegen.data.kept[0].lamps.map((lamp) => lamp.name)")
    assert set(names) == set(rollout.light_names)
    words = ["off", "red", "red and yellow", "yellow", "green"]
    steps = list(range(0, int(rollout.n_steps[0]), 5))
    for k, now in zip(steps, states(page, 0, steps), strict=True):
        want = [int(rollout.lights[0, rollout.light_names.index(name), k]) for name in names]
        assert now["lights"] == want
        for name, number in zip(names, want, strict=True):
            assert f"light {name} {words[number]}" in now["told"]
        shown |= set(want)
    assert len(shown) > 1
    assert page.complaints == []


def test_detections_are_classified_as_the_metrics_match_them(opened):
    case, page = opened
    for row in range(len(case.X)):
        steps = list(range(3, int(case.rollout.n_steps[row]), 17))
        for k, now in zip(steps, states(page, row, steps), strict=True):
            drawn = now["detections"]
            assert drawn[0] is None
            for e in range(1, len(case.rollout.names)):
                status, spot = expected(case, row, e, k)
                assert (drawn[e] or {"status": None})["status"] == status, (row, k, e)
                if status in ("seen", "displaced"):
                    assert math.dist((drawn[e]["x"], drawn[e]["y"]), spot) < 0.01


def test_the_strip_tells_when_who_was_seen(opened):
    case, page = opened
    page.evaluate("bridgegen.select(0)")
    rows = page.evaluate("bridgegen.curves.strip.rows")
    assert rows
    for row in rows:
        told = [None] * int(case.rollout.n_steps[0])
        for spell in row["spells"]:
            told[spell["from"] : spell["to"]] = [spell["status"]] * (spell["to"] - spell["from"])
        want = [expected(case, 0, row["e"], k)[0] for k in range(len(told))]
        assert told == want, row["name"]
    x, y = page.evaluate(
        "(({ left, right, top }) => [left + 0.5 * (right - left), top + 5])(bridgegen.curves.strip)"
    )
    page.locator("#curves").scroll_into_view_if_needed()
    box = page.locator("#curves").bounding_box()
    page.mouse.click(box["x"] + x, box["y"] + y)
    assert state(page)["index"] == pytest.approx(0.5 * (len(told) - 1), abs=1)


def test_a_scenario_that_is_chosen_again_keeps_its_curves(opened):
    _, page = opened
    page.evaluate("bridgegen.select(1)")
    shots = []
    for _ in range(2):
        page.evaluate("bridgegen.select(0); bridgegen.seek(30)")
        shots.append(page.evaluate(PIXELS.replace('"scene"', '"curves"')))
    assert shots[0] == shots[1]


def test_each_kind_of_detection_is_drawn_and_told(show, fog):
    """An instant for each kind; hiding them changes the picture. Who has a label is told, too."""
    found = {
        expected(fog, row, e, k)[0]: (row, e, k)
        for row in range(len(fog.X))
        for e in range(1, len(fog.rollout.names))
        for k in range(0, int(fog.rollout.n_steps[row]), 4)
    }
    assert {"seen", "displaced", "missed"} <= set(found)
    page = show(fog)
    for status, (row, e, k) in found.items():
        (now,) = states(page, row, [k])
        if status is None:
            assert now["detections"][e] is None
            continue
        page.click("#zoom-fit")
        page.focus("#scene")
        name = fog.rollout.names[e]
        if e in page.evaluate(f"bridgegen.data.kept[{row}].players"):
            word = {"displaced": "m off", "missed": "missed", "seen": "seen"}[status]
            assert word in next(part for part in now["told"].split("; ") if name in part)
        with_marks = page.evaluate(PIXELS)
        page.keyboard.press("s")
        assert page.evaluate(PIXELS) != with_marks
        page.keyboard.press("s")
        assert page.evaluate(PIXELS) == with_marks


def test_the_weather_is_the_simulator_s(show, fog):
    page = show(fog)
    columns = {name: fog.X[:, i] for i, name in enumerate(fog.pipeline.space.names)}
    ((_, felt), *_) = weathers(fog.pipeline.runner.simulator.program, columns, fog.rollout, 0)
    shown = state(page)["weather"]
    assert shown["visual_range"] == pytest.approx(felt[column.VISUAL_RANGE], rel=1e-3)
    assert shown["sun_elevation"] == pytest.approx(math.radians(-30.0), rel=1e-3)
    assert shown["friction_scale"] == pytest.approx(felt[column.FRICTION_SCALE], rel=1e-3)
    assert page.inner_text("#weather").startswith("night, fog, visibility")
    with_fog = page.evaluate(PIXELS)
    page.click("#legend [data-layer='weather'] button")
    assert page.get_attribute("#legend [data-layer='weather'] button", "aria-pressed") == "false"
    assert page.evaluate(PIXELS) != with_fog


def test_the_planned_path_is_what_the_driver_planned(opened):
    case, page = opened
    ((_, replay),) = case.pipeline.replays(case.X).parts
    meant = replay.intentions
    body = case.rollout.box[0]
    numbers = range(2, int(np.searchsorted(meant.steps, case.rollout.n_steps[0])), 9)
    steps = meant.steps[list(numbers)].tolist()
    for i, k, now in zip(numbers, steps, states(page, 0, steps), strict=True):
        shown = now["intention"]
        if meant.way[0, i] < 0:
            assert shown is None
            continue
        v, a = case.rollout.v[0, 0, k], meant.acceleration[0, i]
        front = meant.station[0, i] + body[2] + body[0] / 2
        until = min(3.0, v / -a) if a < 0 else 3.0
        assert shown["planned"] == pytest.approx(a, abs=0.006)
        assert shown["front"] == pytest.approx(front, abs=0.01)
        assert shown["marks"][2] == pytest.approx(front + v * until + 0.5 * a * until**2, abs=0.05)


def test_a_link_restores_scenario_and_time_exactly(show, fog):
    page = show(fog, "#0002@3.45")
    k = round(3.45 / fog.rollout.time_step)
    assert (state(page)["scenario"], state(page)["index"], state(page)["playing"]) == (
        "0002", k, False,
    )  # fmt: skip
    page.focus("#scene")
    for key in (".", ".", ","):
        page.keyboard.press(key)
    assert state(page)["index"] == k + 1
    page.wait_for_function("location.hash.startsWith('#0002@') && location.hash !== '#0002@3.45'")
    other = show(fog, page.evaluate("location.hash"))
    assert (state(other)["scenario"], state(other)["index"]) == ("0002", k + 1)
    other.evaluate("location.hash = '#0001@1.2'")
    other.wait_for_function("bridgegen.state().scenario === '0001'")
    assert state(other)["time"] == pytest.approx(1.2)
    for odd in ("#0009@1", "#%E0%A4%A", "#@", "#evaluation-7@2"):
        other.evaluate(f"location.hash = '{odd}'")
    assert (state(other)["scenario"], state(other)["time"]) == ("0001", pytest.approx(1.2))
    other.evaluate("location.hash = '#0001@99999'")
    other.wait_for_function("bridgegen.state().index === bridgegen.data.kept[0].n_steps - 1")
    assert page.complaints == other.complaints == []


def test_who_listens_is_told_once_it_rests(show, lights):
    page = show(lights)
    page.evaluate("bridgegen.seek(20)")
    page.wait_for_function("document.getElementById('said').textContent.startsWith('1.00 s')")
    assert page.get_attribute("#said", "role") == "status"
    assert page.get_attribute("#scrub", "aria-valuetext") == page.inner_text("#now")


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize(("width", "columns"), [(1280, 2), (400, 1)])
def test_it_fits_both_widths_in_both_schemes(show, fog, width, columns, scheme):
    page = show(fog, viewport={"width": width, "height": 720}, color_scheme=scheme)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    panels = page.evaluate("[0, 1, 2, 3].map((i) => bridgegen.curves.pixelOf(i, 0))")
    assert len({round(x) for x, _ in panels}) == columns
    box = page.locator("#curves").bounding_box()
    assert all(0 < x < box["width"] and 0 < y < box["height"] for x, y in panels)
    for panel in range(4):  # a click in any of them seeks
        k = 40 + 30 * panel
        x, y = page.evaluate(f"bridgegen.curves.pixelOf({panel}, {k})")
        # below the picture, which stays in sight on a phone
        top = page.evaluate(
            "document.getElementById('curves').getBoundingClientRect().top + scrollY"
        )
        page.evaluate(f"scrollTo(0, {top + y - 680})")
        box = page.locator("#curves").bounding_box()
        page.mouse.click(box["x"] + x, box["y"] + y)
        assert state(page)["index"] == pytest.approx(k, abs=1)
    assert page.complaints == []


def test_who_wants_no_motion_gets_none(show, fog):
    page = show(fog, reduced_motion="reduce")
    page.evaluate("bridgegen.select(1)")
    assert not state(page)["playing"]
    assert page.complaints == []


def test_a_driver_that_does_not_tell_its_plan_is_said_to_have_none(show):
    case = Case("crossroads-s4", {}, ego="route-follower")
    page = show(case)
    assert page.inner_text("#course-button") == "Way ahead"
    assert not page.is_visible("#legend [data-layer='sensed']")
    k = case.steps(0)[0]
    (now,) = states(page, 0, [k])
    assert now["intention"]["planned"] is None
    assert now["intention"]["a"] == pytest.approx(case.rollout.a[0, 0, k], abs=0.006)
    assert "plans" not in now["told"]
    assert page.complaints == []


def test_in_perspective_bodies_are_where_a_pinhole_camera_sees_them(show, lights):
    """From behind the ego, turned by a drag, and from straight above."""
    page = show(lights)
    page.evaluate("bridgegen.select(0)")
    k = lights.steps(0)[1]
    page.click("#chase")
    page.evaluate(f"bridgegen.seek({k})")
    width, height = page.evaluate("(({ clientWidth: w, clientHeight: h }) => [w, h])(scene)")

    def seen(yaw: float, pitch: float, away: float = 17.0) -> list[tuple[float, float] | None]:
        shown, bodies = state(page), page.evaluate("bridgegen.data.kept[0].entities")
        centres = [
            np.array([b["x"], b["y"], 0.0])
            + body["center_ahead"] * np.array([math.cos(b["h"]), math.sin(b["h"]), 0.0])
            for b, body in zip(shown["entities"], bodies, strict=True)
        ]
        turned = shown["entities"][0]["h"] + yaw
        flat = np.array([math.cos(turned), math.sin(turned), 0.0])
        ahead = math.cos(pitch) * flat - math.sin(pitch) * np.array([0.0, 0.0, 1.0])
        right = np.cross(flat, [0.0, 0.0, 1.0])
        eye = centres[0] + [0.0, 0.0, 1.2] - away * ahead
        found = []
        for centre in centres:
            x, y, z = (centre - eye) @ np.stack([right, np.cross(right, ahead), ahead], axis=1)
            focus = 0.8 * width
            pixel = (width / 2 + focus * x / z, 0.56 * height - focus * y / z)
            found.append(pixel if z > 0 else None)
        return found

    def agrees(yaw: float, pitch: float) -> None:
        shown = state(page)["screen"]
        for pixel, wanted in zip(shown, seen(yaw, pitch), strict=True):
            assert (pixel is None) == (wanted is None)
            assert pixel is None or pixel == pytest.approx(wanted, abs=0.01)

    agrees(0.0, 0.26)
    behind = page.evaluate(PIXELS)
    box = page.locator("#scene").bounding_box()
    page.mouse.move(box["x"] + 200, box["y"] + 200)
    page.mouse.down()
    page.mouse.move(box["x"] + 300, box["y"] + 240)
    page.mouse.up()
    agrees(-0.6, 0.5)
    assert page.evaluate(PIXELS) != behind
    page.click("#chase")  # from above
    agrees(-0.6, math.pi / 2)
    page.evaluate("bridgegen.select(1)")
    assert page.get_attribute("#chase", "aria-pressed") == "true"  # of another scenario, too
    page.click("#follow")
    assert page.get_attribute("#chase", "aria-pressed") == "false"
    assert page.complaints == []
