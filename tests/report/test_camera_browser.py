"""What the playback frames: the conflict, the whole motion, or the ego; and where its words are."""

import io
import json
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from bridgegen.pages.playback import Entity

pytestmark = pytest.mark.browser

INSTANTS = range(0, 400, 8)


def states(page, kept):
    """Return what is drawn of a scenario at some instants."""
    return page.evaluate(
        "([kept, instants]) => { bridgegen.select(kept);"
        " return instants.map((k) => { bridgegen.seek(k); return bridgegen.state(); }); }",
        [kept, list(INSTANTS)],
    )


def size(page):
    box = page.locator("#scene").bounding_box()
    return box["width"], box["height"]


@pytest.mark.parametrize("width", [1280, 390])
def test_the_conflict_is_framed_and_a_car_is_well_seen(show, report, width):
    opened = show(report, viewport={"width": width, "height": 720})
    for kept in range(len(report.kept)):
        for state in states(opened.page, kept):
            assert 8.0 <= state["scale"] <= 20.0
            (ax, ay), other = state["screen"][0], state["screen"][1]
            wide, high = size(opened.page)
            assert 0 < ax < wide
            assert 0 < ay < high
            apart = np.hypot(ax - other[0], ay - other[1]) / state["scale"]
            if apart < 15.0:
                assert 0 < other[0] < wide
                assert 0 < other[1] < high
    opened.page.close()


def test_all_shows_the_whole_motion_at_one_scale(show, report):
    opened = show(report)
    opened.page.evaluate("bridgegen.select(0)")
    opened.page.click("#zoom-all")
    assert opened.page.get_attribute("#zoom-all", "aria-pressed") == "true"
    wide, high = size(opened.page)
    scales = set()
    for k in INSTANTS:
        opened.page.evaluate(f"bridgegen.seek({k})")
        state = opened.state()
        scales.add(state["scale"])
        for x, y in filter(None, state["screen"]):
            assert 0 < x < wide
            assert 0 < y < high
    assert len(scales) == 1
    opened.page.close()


def test_the_reader_s_zoom_stays_while_the_camera_moves(show, report):
    opened = show(report)
    opened.page.evaluate("bridgegen.select(0); bridgegen.seek(0)")
    before = opened.state()["scale"]
    opened.page.click("#zoom-in")
    assert opened.state()["scale"] == pytest.approx(1.4 * before)
    assert opened.page.get_attribute("#zoom-fit", "aria-pressed") == "true"
    opened.page.click("#zoom-fit")
    assert opened.state()["scale"] == pytest.approx(before)
    opened.page.close()


def test_labels_are_smaller_than_cars_and_leave_the_collision_free(show, report):
    opened = show(report)
    seen = 0
    for kept, p in enumerate(report.kept):
        for state in states(opened.page, kept):
            body = p.entities[0].length * p.entities[0].width * state["scale"] ** 2
            for x0, y0, x1, y1 in state["labels"]:
                assert (x1 - x0) * (y1 - y0) <= max(body, 45 * 20)  # "ego" always fits
                for a0, b0, a1, b1 in state["crosses"]:
                    seen += 1
                    wide, high = min(x1, a1) - max(x0, a0), min(y1, b1) - max(y0, b0)
                    assert min(wide, high) <= 0
    assert seen
    opened.page.close()


def test_who_is_half_out_of_the_picture_is_named_once(show, report):
    """A bus drives out of the picture while the ego stands in its middle."""
    p = report.kept[0]
    away = np.arange(401) * 0.25
    rows = {
        "x": np.stack([np.zeros(401), away]), "y": np.zeros((2, 401)), "h": np.zeros((2, 401)),
        "v": np.stack([np.zeros(401), np.full(401, 5.0)]),
    }  # fmt: skip
    bus = replace(p.entities[1], name="bus", length=12.0, width=2.5)
    kept = replace(p, entities=(p.entities[0], bus), distance=away + 1.0, **rows)
    opened = show(replace(report, kept=(kept,)))
    page = opened.page
    page.evaluate("bridgegen.select(0)")
    page.click("#follow")
    width, half = page.evaluate("document.getElementById('scene').clientWidth"), 0
    for k in range(0, 401, 4):
        page.evaluate("k => bridgegen.seek(k)", k)
        state = opened.state()
        x = state["screen"][1][0]
        is_partly_seen = width < x < width + 6.0 * state["scale"]
        half += is_partly_seen
        assert len(state["labels"]) == (2 if x < width else 1)
    assert half > 2
    page.close()


def test_the_legend_names_the_ego_and_all_that_move(show, report):
    p = report.kept[0]
    more = tuple(Entity(f"car_{n}", 4.8, 2.0, 1.4, "car") for n in range(4))
    rows = {
        name: np.vstack([getattr(p, name), np.tile(getattr(p, name)[1:2] + off, (4, 1))])
        for name, off in (("x", 30.0), ("y", 5.0), ("h", 0.0), ("v", 1.0))
    }
    opened = show(replace(report, kept=(replace(p, entities=(*p.entities, *more), **rows),)))
    names = opened.page.inner_text("#legend-players").split("\n")
    assert names == [one.name for one in (*p.entities, *more)]
    assert names[0] == "ego"
    opened.page.close()


def test_sections_fold_and_a_link_to_one_unfolds_it(show, report):
    opened = show(report)
    page = opened.page
    page.click("#space > .fold")
    assert page.is_hidden("#scatter")
    assert page.get_attribute("#space > .fold", "aria-expanded") == "false"
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert page.is_visible("#scatter")  # paper shows all
    assert page.evaluate("bridgegen.scatter.box.right > 500")
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert page.is_hidden("#scatter")
    page.click("#contents button:has-text('Parameter space')")
    assert page.is_visible("#scatter")
    page.click("#space h2")
    assert page.is_hidden("#scatter")
    assert opened.complaints == []
    page.close()


def saved(page, kind):
    with page.expect_download(timeout=60_000) as download:
        page.select_option("#save", kind)
    found = download.value
    return found.suggested_filename, Path(found.path()).read_bytes()


def test_a_moment_is_saved_as_a_picture(show, report):
    opened = show(report)
    opened.page.evaluate("bridgegen.select(0); bridgegen.seek(100)")
    name, data = saved(opened.page, "picture")
    assert name == "0001-5.00s.png"
    with Image.open(io.BytesIO(data)) as picture:
        assert picture.size == tuple(int(v) for v in size(opened.page))
        seen = picture.convert("RGB").getpixel(tuple(round(v) for v in opened.state()["screen"][0]))
    assert seen == (0x00, 0x63, 0xB0)  # the ego's colour
    assert opened.complaints == []
    opened.page.close()


@pytest.mark.skipif(shutil.which("ffprobe") is None, reason="ffprobe is not installed")
def test_the_whole_is_saved_as_a_film(show, report, tmp_path):
    opened = show(report)
    opened.page.evaluate("bridgegen.select(0)")
    opened.page.select_option("#speed", "4")
    name, data = saved(opened.page, "film")
    assert name == "0001.webm"
    (tmp_path / name).write_bytes(data)
    asked = [
        "ffprobe",
        "-v",
        "error",
        "-count_frames",
        "-show_entries",
        "stream=width,nb_read_frames",
    ]
    told = subprocess.run(
        [*asked, "-of", "json", tmp_path / name], capture_output=True, check=True
    )  # fmt: skip
    (stream,) = json.loads(told.stdout)["streams"]
    assert stream["width"] == size(opened.page)[0]
    assert int(stream["nb_read_frames"]) > 20
    assert not opened.state()["playing"]
    opened.page.close()


def test_a_building_is_as_wide_as_it_is(show, report):
    """12 m long and 4 m wide, along the X axis: 4 m to its side there is ground."""
    p = report.kept[0]
    house = Entity("house", 12.0, 4.0, 0.0, "obstacle")
    rows = {name: getattr(p, name).copy() for name in "xyhv"}
    for name, value in (("x", p.x[0, 100] + 12.0), ("y", p.y[0, 100]), ("h", 0.0), ("v", 0.0)):
        rows[name][1] = value
    kept = replace(p, entities=(p.entities[0], house), lanes=p.lanes[:0], **rows)
    opened = show(replace(report, kept=(kept,)))
    page = opened.page
    page.evaluate("bridgegen.select(0); bridgegen.seek(100)")
    state = opened.state()
    (x, y), scale = state["screen"][1], state["scale"]
    with Image.open(io.BytesIO(page.locator("#scene").screenshot())) as picture:
        image = picture.convert("RGB")
    at = [image.getpixel((round(x + a * scale), round(y + b * scale))) for a, b in
          ((0, 0), (5.5, 1.5), (3.0, 4.0), (0, 4.0), (-3.0, -4.0))]  # fmt: skip
    assert at[1] == at[0]
    assert at[0] not in at[2:]
    page.close()
