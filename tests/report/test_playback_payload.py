"""What a playback says as whole numbers, read again as the page reads it."""

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bridgegen.pages.playback import Course, Planned, Sensed, Weather
from bridgegen.pages.playback_payload import ROAD_SCALE, SCALE, playback_payload, road_payload
from bridgegen.pages.series import unpacked
from bridgegen.scenario.participants import PARTICIPANTS
from bridgegen.scenario.weather import COLUMNS

KINDS = ("car", "truck")
ANYWHERE = st.floats(-5000.0, 5000.0)


def sent(p):
    return json.loads(json.dumps(playback_payload(p, 0, None), allow_nan=False))


def test_a_road_is_within_half_a_centimetre(report):
    p = report.kept[0]
    for told, lane in zip(road_payload(p), p.lanes, strict=True):
        points = np.cumsum(np.reshape(told["points"], (-1, 2)), axis=0) / ROAD_SCALE
        assert np.abs(points - lane.points).max() <= 0.5 / ROAD_SCALE + 1e-9


@pytest.mark.parametrize(
    ("kind", "shape", "headlights"),
    [
        *((one.name, one.drawing.shape, one.drawing.headlights) for one in PARTICIPANTS.values()),
        ("train", "vehicle", True),
    ],
)
def test_the_page_is_told_how_each_kind_is_drawn(report, kind, shape, headlights):
    p = report.kept[0]
    ego, other = p.entities
    read = sent(replace(p, entities=(ego, replace(other, type=kind))))["entities"]
    assert (read[0]["shape"], read[0]["headlights"]) == ("vehicle", True)
    assert (read[1]["shape"], read[1]["headlights"]) == (shape, headlights)


@given(
    seen_by=arrays(np.int64, 12, elements=st.integers(-1, 3)),
    counts=arrays(np.bool_, 12),
    spot=arrays(np.float64, (2, 12), elements=ANYWHERE),
    turn=arrays(np.float64, 12, elements=st.floats(-20.0, 20.0)),
    size=arrays(np.float64, (2, 12), elements=st.floats(0.1, 30.0)),
    kind=arrays(np.int64, 12, elements=st.integers(0, 1)),
)
def test_detections_come_back_to_a_centimetre(report, seen_by, counts, spot, turn, size, kind):
    p = report.kept[0]
    steps = np.arange(0, 24, 2)
    nothing = seen_by <= 0

    def told(values):
        return np.stack([np.full(12, np.nan), np.where(nothing, np.nan, values)])

    given_ = Sensed(
        steps=steps, seen_by=np.stack([np.full(12, -1), seen_by]),
        counts=np.stack([np.zeros(12, bool), counts]), x=told(spot[0]), y=told(spot[1]),
        h=told(turn), length=told(size[0]), width=told(size[1]), confidence=told(np.full(12, 0.5)),
        kind=np.stack([np.full(12, -1), np.where(nothing, -1, kind)]), kinds=KINDS,
        kind_of=np.array([0, 0]), tolerance=0.5,
    )  # fmt: skip
    read = sent(replace(p, sensed=given_))["sensed"]
    assert np.cumsum(read["steps"]).tolist() == steps.tolist()
    other = read["entities"][1]
    letters = {"-": (-1, None), **{c: (i, True) for i, c in enumerate("0123")},
               **{c: (i, False) for i, c in enumerate("mabc")}}  # fmt: skip
    for letter, by, counted in zip(other["seen"], seen_by, counts, strict=True):
        assert letters[letter] == (by, bool(counted) if by >= 0 else None)
    at = np.flatnonzero(seen_by > 0)
    wrong = dict(other["taken_for"])
    for i, k in enumerate(at.tolist()):
        dx, dy, dh, length, width, _ = (column[i] for column in other["numbers"])
        step, e = steps[k], p.entities[1]
        h = p.h[1, step]
        x = p.x[1, step] + e.center_ahead * np.cos(h) + dx / SCALE["length"]
        y = p.y[1, step] + e.center_ahead * np.sin(h) + dy / SCALE["length"]
        assert (x, y) == pytest.approx((spot[0, k], spot[1, k]), abs=0.0051)
        apart = h + dh / SCALE["h"] - turn[k]
        assert abs(apart - 2 * np.pi * round(apart / (2 * np.pi))) <= 1e-4
        assert (length / 100, width / 100) == pytest.approx(tuple(size[:, k]), abs=0.0051)
        assert wrong.get(i, 0) == kind[k]


def test_a_course_comes_back_as_changes(report):
    p = report.kept[0]
    steps = np.arange(0, 20, 4)
    shift = np.array([[0.0] * 4, [0.0] * 4, [0.0, 3.5, 20.0, 30.0], [0.0, 3.5, 20.0, 30.0],
                      [3.5, 0.0, 80.0, 30.0]])  # fmt: skip
    course = Course(
        ways=(np.array([[0.0, 0.0], [10.0, 0.0], [20.0, 5.0]]),), steps=steps,
        way=np.array([0, 0, -1, 0, 0]), station=np.arange(5.0),
        acceleration=np.array([0.0, -1.25, np.nan, 2.0, 0.5]), shift=shift,
    )  # fmt: skip
    read = sent(replace(p, course=course))["course"]
    assert read["ways"] == [[0, 0, 1000, 0, 1000, 500]]
    assert read["way"] == [[0, 0], [2, -1], [3, 0]]
    assert [one[0] for one in read["shift"]] == [0, 2, 4]
    assert read["shift"][1][1:] == [0.0, 3.5, 20.0, 30.0]
    back = unpacked(read["acceleration"], 5, SCALE["a"])
    assert back == pytest.approx(course.acceleration, nan_ok=True)
    assert sent(replace(p, course=replace(course, shift=shift * 0)))["course"]["shift"] == []


def test_weather_that_would_begin_after_the_end_is_left_out(report):
    p = report.kept[0]
    clear = {one.name: one.clear for one in COLUMNS}
    now = Weather(0, clear, 9_000.0, 3000.0)
    later = replace(now, step=p.n_steps, stated=clear | {"rain": 5.0})
    (told,) = sent(replace(p, weather=(now, later)))["weather"]
    rounded = {"sun_azimuth": 3.142, "sun_elevation": 0.7854}
    around = {"sight": 9_000.0, "background": 3000.0}
    assert told == {"step": 0, "words": "day", **clear, **rounded, **around}


def test_trajectories_come_back_to_half_a_centimetre(report):
    p = report.kept[0]
    points = np.random.default_rng(1).uniform(-900.0, 900.0, (3, 20, 2))
    made = [Planned(k, 3.0, one) for k, one in zip((0, 4, p.n_steps), points, strict=True)]
    assert sent(p)["plans"] == []
    read = sent(replace(p, plans=tuple(made)))["plans"]
    assert [(one["step"], one["seconds"]) for one in read] == [(0, 3.0), (4, 3.0)]  # not the last
    for one, line in zip(read, points, strict=False):
        came = np.cumsum(np.reshape(one["points"], (-1, 2)), axis=0) / ROAD_SCALE
        assert np.abs(came - line).max() <= 0.5 / ROAD_SCALE + 1e-9
