"""Where on a route a conflict happens, on a straight route of 100 m."""

import numpy as np
import pytest

from bridgegen.assess.conflict.place import place_on_route

STEP = 0.5
WAY = np.column_stack([np.arange(0.0, 100.0 + STEP, STEP), np.zeros(201)])
NONE = np.empty((0, 2))
ONE = np.array([[40.0, 60.0]])
TWO = np.array([[20.0, 30.0], [50.0, 70.0]])


@pytest.mark.parametrize(
    ("x", "one", "two"),
    [
        (0.0, "before", "before"),
        (19.0, "before", "before"),
        (20.0, "before", "in"),  # where the route enters is in the junction
        (30.0, "before", "in"),
        (30.5, "before", "between"),
        (39.5, "before", "between"),
        (40.0, "in", "between"),
        (50.0, "in", "in"),
        (60.0, "in", "in"),
        (60.5, "after", "in"),
        (70.5, "after", "after"),
        (100.0, "after", "after"),
    ],
)
def test_before_in_between_and_after_by_hand(x, one, two):
    words = {
        "before": "before the junction", "in": "in the junction",
        "between": "between junctions", "after": "after the junction",
    }  # fmt: skip
    at = np.array([x])
    assert place_on_route(WAY, STEP, ONE, at, np.zeros(1)) == [words[one]]
    assert place_on_route(WAY, STEP, TWO, at, np.zeros(1)) == [words[two]]


def test_a_point_beside_the_route_counts_where_it_is_nearest():
    x, y = np.array([10.0, 45.0, 130.0]), np.array([-20.0, 7.0, 3.0])
    found = place_on_route(WAY, STEP, ONE, x, y)
    assert found == ["before the junction", "in the junction", "after the junction"]


def test_both_coordinates_count():
    """On a route around a corner, points are told apart by y, too."""
    north = np.column_stack([np.full(100, 100.0), np.arange(0.5, 50.5, 0.5)])
    way = np.concatenate([WAY, north])
    found = place_on_route(way, STEP, np.array([[95.0, 110.0]]), np.full(2, 100.0),
                           np.array([5.0, 40.0]))  # fmt: skip
    assert found == ["in the junction", "after the junction"]


def test_a_route_without_junctions_has_no_places():
    assert place_on_route(WAY, STEP, NONE, np.zeros(2), np.zeros(2)) == ["", ""]
