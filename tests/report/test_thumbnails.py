"""Thumbnails: true to the motion, small, safe to read from a stranger's folder, and they play."""

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import StorageError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.pages.playback import Outline, Playback
from bridgegen.pages.playbacks import nominal_playback
from bridgegen.pages.templates import style
from bridgegen.pages.thumbnails import (
    EVERY,
    FILE,
    MOST_BYTES,
    MOST_POINTS,
    Thumbnail,
    drawn,
    read_thumbnails,
    thumbnail,
    write_thumbnails,
)
from bridgegen.scenario.language.reader import load

CAPTION = 'a <script>alert(1)</script> "b" & c'


@pytest.fixture(scope="module")
def playback() -> Playback:
    """Return the collision of crossroads-s3 at its defaults."""
    scenario = load("crossroads-s3")
    return nominal_playback(Pipeline(scenario, scenario.space()), "nominal")


@pytest.fixture(scope="module")
def shown(playback: Playback) -> Thumbnail:
    found = thumbnail(playback, CAPTION)
    assert found is not None
    return found


def test_bodies_are_as_far_apart_as_in_the_motion(playback, shown):
    conflict = playback.conflict
    ego, other = (np.array(body.poses) for body in shown.bodies[:2])
    steps = round(EVERY / playback.time_step)
    at = conflict.instant + steps * (np.arange(len(ego)) - shown.moment)
    x, y = (axis[0, at] - axis[conflict.partner, at] for axis in (playback.x, playback.y))
    np.testing.assert_allclose(np.hypot(*(ego - other)[:, :2].T), np.hypot(x, y), atol=0.02)
    turned = playback.h[0, at] - playback.h[0, at[0]]
    np.testing.assert_allclose(ego[:, 2], turned, atol=0.01)
    assert ego[0, 0] < ego[shown.moment, 0]  # it comes from the left


def test_a_turned_world_has_the_same_thumbnail(playback, shown):
    turn = 1.2
    c, s = math.cos(turn), math.sin(turn)
    matrix = np.array([[c, s], [-s, c]])
    turned = replace(
        playback,
        x=c * playback.x - s * playback.y,
        y=s * playback.x + c * playback.y,
        h=playback.h + turn,
        lanes=tuple(replace(lane, points=lane.points @ matrix) for lane in playback.lanes),
    )
    again = thumbnail(turned, CAPTION)
    for one, other in zip(again.bodies, shown.bodies, strict=True):
        np.testing.assert_allclose(one.poses, other.poses, atol=0.011)
    assert [shape.kind for shape in again.road] == [shape.kind for shape in shown.road]


@pytest.mark.parametrize(
    "name", ["cut-in", "roundabout-entry", "pedestrian-behind-parked", "road-works"]
)
def test_a_thumbnail_is_small(name, tmp_path):
    scenario = load(name)
    found = thumbnail(nominal_playback(Pipeline(scenario, scenario.space()), name), name)
    write_thumbnails(tmp_path, [found])
    assert (tmp_path / FILE).stat().st_size <= MOST_BYTES
    (again,) = read_thumbnails(tmp_path)
    assert again == found
    assert len(drawn(again, "t0")) < 12_000


def test_none_removes_what_was_kept_before(shown, tmp_path):
    write_thumbnails(tmp_path, [shown])
    write_thumbnails(tmp_path, [None])
    assert read_thumbnails(tmp_path) == ()
    assert not (tmp_path / FILE).exists()


def test_what_cannot_be_removed_is_one_error(tmp_path):
    (tmp_path / FILE).mkdir()
    with refuses(StorageError, FILE):
        write_thumbnails(tmp_path, [])


def test_long_roads_keep_their_direction_and_a_body_beyond_all_bounds_costs_the_picture(playback):
    far = Outline("centre", np.array([[-9000.0, -4500.0], [9000.0, 4500.0]]))
    found = thumbnail(replace(playback, lanes=(far,)), CAPTION)
    ((x0, y0), (x1, y1)) = found.road[0].points
    assert math.hypot(x1 - x0, y1 - y0) == pytest.approx(math.hypot(18000.0, 9000.0), abs=0.2)
    long = replace(playback.entities[0], length=300.0)
    assert thumbnail(replace(playback, entities=(long, *playback.entities[1:])), CAPTION) is None


def test_captions_are_text(shown):
    text = drawn(shown, "t0")
    assert "<script" not in text
    assert "&lt;script&gt;" in text


def _written(folder: Path, shown: Thumbnail, **changes: object) -> None:
    record = json.loads(shown.model_dump_json()) | changes
    (folder / FILE).write_text(json.dumps({"thumbnails": [record]}), "utf-8")


@pytest.mark.parametrize(
    "changes",
    [
        {"moment": 1000},
        {"width": 0.0},
        {"width": float("nan")},
        {"bodies": []},
        {"road": [{"kind": '"/><script>', "points": [[0, 0], [1, 1]]}]},
        {"road": [{"kind": "stop", "points": [[0, 0]] * MOST_POINTS}] * 2},
        {"contact": [1e9, 0]},
        {"svg": "<svg onload=alert(1)>"},
        {"caption": "a" * 501},
    ],
    ids=str,
)
def test_what_breaks_a_rule_costs_the_picture_alone(changes, shown, tmp_path):
    _written(tmp_path, shown)
    assert len(read_thumbnails(tmp_path)) == 1
    _written(tmp_path, shown, **changes)
    assert read_thumbnails(tmp_path) == ()


def test_links_and_large_files_are_not_read(shown, tmp_path):
    inside = tmp_path / "run"
    inside.mkdir()
    write_thumbnails(tmp_path, [shown])
    (inside / FILE).symlink_to(tmp_path / FILE)
    assert read_thumbnails(inside) == ()
    with (tmp_path / FILE).open("ab") as file:
        file.write(b" " * 500_000)
    assert read_thumbnails(tmp_path) == ()


@given(data=st.binary(max_size=300))
def test_any_bytes_are_read_or_not_shown(data, tmp_path_factory):
    folder = tmp_path_factory.mktemp("bytes")
    (folder / FILE).write_bytes(data)
    assert read_thumbnails(folder) == ()


# --- In a browser ---


def _page(folder: Path, shown: Thumbnail) -> str:
    path = folder / "page.html"
    policy = "default-src 'none'; style-src 'unsafe-inline'"
    head = f'<meta http-equiv="Content-Security-Policy" content="{policy}"><style>{style()}</style>'
    body = f"<p style='height: 60px'>text</p>{drawn(shown, 't0')}<p><a href='#x'>next</a></p>"
    path.write_text(f"<!DOCTYPE html><meta charset=utf-8>{head}{body}", "utf-8")
    return path.as_uri()


def _places(tab: Any) -> list[float]:
    """Return where the bodies that are seen are across the screen."""
    return tab.evaluate(
        "[...document.querySelectorAll('.thumbnail > g > g > g')]"
        ".map((g) => g.getBoundingClientRect()).filter((box) => box.width).map((box) => box.x)"
    )


@pytest.mark.browser
@pytest.mark.parametrize("how", ["pointer", "focus", "tap"])
def test_it_plays_while_it_is_pointed_at_or_has_focus(how, browser, shown, tmp_path):
    context = browser.new_context(has_touch=how == "tap")
    tab = context.new_page()
    tab.goto(_page(tmp_path, shown))
    still = _places(tab)
    assert len(still) == len(shown.bodies)
    tab.wait_for_timeout(300)
    assert _places(tab) == still
    if how == "pointer":
        tab.hover("#t0")
    elif how == "focus":
        tab.focus("#t0")
    else:
        tab.tap("#t0")
    tab.wait_for_timeout(300)
    first = _places(tab)
    tab.wait_for_timeout(300)
    assert first != still
    assert _places(tab) != first
    tab.mouse.move(1, 1)
    tab.focus("a")
    tab.wait_for_timeout(200)
    assert _places(tab) == still
    context.close()


@pytest.mark.browser
def test_it_stays_still_for_those_who_want_less_motion(browser, shown, tmp_path):
    context = browser.new_context(reduced_motion="reduce")
    tab = context.new_page()
    tab.goto(_page(tmp_path, shown))
    still = _places(tab)
    assert len(still) == len(shown.bodies)
    tab.hover("#t0")
    tab.focus("#t0")
    tab.wait_for_timeout(400)
    assert _places(tab) == still
    context.close()
