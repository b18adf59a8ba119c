"""Who hides whom, against geometry by shapely and by hand."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from shapely import LineString, Polygon, affinity, box

from bridgegen.drivers._occlusion_kernels import LAST, RAYS, visible_share
from bridgegen.drivers._perception_kernels import MEMORY, place

EYE = 1.425  # 0.95 of the ego's 1.5 m


def share(target: tuple, *others: tuple, eye: float = EYE) -> float:
    """Return the visible share of a target; bodies are (x, y, h, length, width, height)."""
    rows = [(0.0, 0.0, 0.0, 0.1, 0.1, 1.5), target, *others]
    x, y, h = (np.array([[row[i]] for row in rows], dtype=np.float64) for i in range(3))
    bodies = np.zeros((len(rows), 8))
    bodies[:, [0, 1, 7]] = [row[3:] for row in rows]
    memory = np.zeros((len(rows), MEMORY))
    place(0, np.ones(len(rows), dtype=np.bool_), x, y, h, bodies, memory)
    return visible_share(1, memory, bodies, eye)


def polygon(body: tuple) -> Polygon:
    x, y, h, length, width, _ = body
    flat = box(-0.5 * length, -0.5 * width, 0.5 * length, 0.5 * width)
    return affinity.translate(affinity.rotate(flat, h, (0, 0), use_radians=True), x, y)


def sight_lines_cut(target: tuple, other: tuple, n: int = 200) -> float:
    """Return the share of a target's angle in which another body stands before it."""
    shape, blocker = polygon(target), polygon(other)
    corners = np.array(shape.exterior.coords[:-1])
    middle = math.atan2(target[1], target[0])
    angles = [math.remainder(math.atan2(v, u) - middle, math.tau) for u, v in corners]
    cut = 0
    for angle in np.linspace(min(angles), max(angles), n + 2)[1:-1] + middle:
        ray = LineString([(0, 0), (500 * math.cos(angle), 500 * math.sin(angle))])
        at = ray.intersection(blocker)
        own = ray.intersection(shape)
        if not at.is_empty and not own.is_empty:
            cut += math.hypot(*at.coords[0]) < math.hypot(*own.coords[0])
    return cut / n


PLACE = st.tuples(
    st.floats(5.0, 60.0), st.floats(-20.0, 20.0), st.floats(-3.1, 3.1),
    st.floats(0.5, 12.0), st.floats(0.4, 2.6), st.floats(0.5, 2.0),
)  # fmt: skip


@given(PLACE, PLACE, st.floats(-math.pi, math.pi))
def test_a_tall_body_hides_as_much_as_it_covers(target, other, turn):
    other = (*other[:5], 4.0)
    a, b = polygon(target), polygon(other)
    assume(a.distance(b) > 0.1 and min(a.distance(LineString([(0, 0), (0.1, 0)])), 99) > 1.0)
    assume(b.distance(LineString([(0, 0), (0.1, 0)])) > 1.0)
    visible = share(target, other)
    # each of two edges of what is hidden falls between two rays
    assert visible == pytest.approx(1.0 - sight_lines_cut(target, other), abs=1.01 / RAYS)
    c, s = math.cos(turn), math.sin(turn)
    turned = [
        (c * one[0] - s * one[1], s * one[0] + c * one[1], one[2] + turn, *one[3:])
        for one in (target, other)
    ]
    assert share(*turned) == pytest.approx(visible, abs=1.01 / RAYS)


@given(
    st.floats(15.0, 80.0), st.floats(-math.pi, math.pi), st.floats(-3.1, 3.1), st.floats(0.3, 0.7)
)
def test_a_pedestrian_behind_a_lorry_is_hidden_whole(d, bearing, h, where):
    """A wall 12 m wide and 4 m high, square to the line of sight, covers all of 0.5 m."""
    c, s = math.cos(bearing), math.sin(bearing)
    walker = (d * c, d * s, h, 0.5, 0.5, 1.7)
    lorry = (where * d * c, where * d * s, bearing + math.pi / 2, 12.0, 2.5, 4.0)
    assert share(walker, lorry) == 0.0


def test_who_stands_before_the_lorry_is_seen():
    """At its front corner, 0.5 m nearer to the lane than its side: hidden by none of it."""
    lorry = (10.0, 3.5, 0.0, 12.0, 2.5, 4.0)
    assert share((17.0, 1.5, 0.0, 0.5, 0.5, 1.7), lorry) == 1.0
    assert share((17.0, 3.5, 0.0, 0.5, 0.5, 1.7), lorry) == 0.0


def test_half_a_car_is_hidden():
    """The left half of a car's rear behind a wall that begins at the middle: 2 or 3 rays of 5."""
    car = (40.0, 0.0, 0.0, 4.5, 1.8, 1.5)
    wall = (20.0, 5.0, 0.0, 0.2, 10.0, 4.0)
    assert 0.39 < share(car, wall) < 0.61


def test_one_sees_over_what_is_low():
    """An eye at 1.425 m, a box of 0.5 m at 10 m: at 20 m its shadow is −0.425 m high; at 12 m
    (1.425 − 0.925·12/10) = 0.315 m, of a pedestrian's 1.7 m."""
    low = (10.0, 0.0, math.pi / 2, 6.0, 0.02, 0.5)
    assert share((20.0, 0.0, 0.0, 0.5, 0.5, 1.7), low) == 1.0
    found = share((12.25, 0.0, 0.0, 0.5, 0.5, 1.7), low)
    assert found == pytest.approx(1.0 - (EYE - 0.925 * 12.0 / 9.99) / 1.7, abs=0.01)


def test_a_car_hides_a_car_of_its_height():
    assert share((40.0, 0.0, 0.0, 4.5, 1.8, 1.5), (15.0, 0.0, 0.0, 4.5, 1.8, 1.5)) == 0.0


def test_a_bus_is_seen_above_a_car():
    """Above 1.425 + 0.075·d/d' of its 3.2 m: about half of it."""
    bus, car = (40.0, 0.0, 0.0, 12.0, 2.5, 3.2), (15.0, 0.0, math.pi / 2, 8.0, 1.8, 1.5)
    assert share(bus, car) == pytest.approx(1.0 - (EYE + 0.075 * 34.0 / 14.1) / 3.2, abs=0.01)


def test_who_is_behind_hides_nobody():
    walker = (10.0, 0.0, 0.0, 0.5, 0.5, 1.7)
    assert share(walker, (30.0, 0.0, math.pi / 2, 12.0, 2.5, 4.0)) == 1.0
    assert share(walker, (-10.0, 0.0, math.pi / 2, 12.0, 2.5, 4.0)) == 1.0


def test_bearings_are_compared_round_the_circle():
    """Straight behind, at bearings of just under and just over ±π."""
    walker = (-20.0, -0.3, 0.0, 0.5, 0.5, 1.7)
    assert share(walker, (-10.0, 0.3, math.pi / 2, 6.0, 0.5, 4.0)) == 0.0


def test_the_columns_do_not_overlap():
    assert LAST < MEMORY
