from dataclasses import dataclass
from math import cos, hypot, pi, sin

import numpy as np
import pytest
import shapely
from hypothesis import example, given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.simulation.boxes import as_steps, box_distance


@dataclass(frozen=True)
class Box:
    """A box by its reference point; ``ahead`` of it lies the centre."""

    length: float
    width: float
    x: float = 0.0
    y: float = 0.0
    h: float = 0.0
    ahead: float = 0.0

    def polygon(self) -> shapely.Polygon:
        c, s = cos(self.h), sin(self.h)
        corners = []
        for fx, fy in ((0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)):
            along, left = self.ahead + fx * self.length, fy * self.width
            corners.append((self.x + along * c - left * s, self.y + along * s + left * c))
        return shapely.Polygon(corners)

    def moved(self, angle: float, dx: float, dy: float) -> "Box":
        c, s = cos(angle), sin(angle)
        x, y = self.x * c - self.y * s + dx, self.x * s + self.y * c + dy
        return Box(self.length, self.width, x, y, self.h + angle, self.ahead)


def distances(*boxes: Box) -> np.ndarray:
    """Distance of the first box to each, through the public function."""
    size = [(b.length, b.width, b.ahead) for b in boxes]
    x, y, h = (np.array([[[getattr(b, f)] for b in boxes]]) for f in "xyh")
    return box_distance(size, x, y, h, np.array([1]))[0, :, 0]


def distance(a: Box, b: Box) -> float:
    return float(distances(a, b)[1])


near = st.floats(-15, 15)
angle = st.one_of(st.floats(-10, 10), st.sampled_from([0.0, pi / 2, pi, -pi / 2, pi / 4, 1e-9]))
box = st.builds(
    Box, st.floats(0.3, 20), st.floats(0.3, 4), near, near, angle, st.sampled_from([0.0, 1.4])
)
CAR = Box(4.0, 2.0)


@pytest.mark.parametrize(
    ("other", "expected"),
    [
        (Box(4, 2, 10, 0), 6.0),  # nose to tail
        (Box(4, 2, 0, 3.5), 1.5),  # side by side
        (Box(4, 2, 7, 6), 5.0),  # corner to corner: 3, 4, 5
        (Box(4, 2, 6, 0, pi / 2), 3.0),  # its flank before our nose
        (Box(4, 2, 10, 0, pi), 6.0),  # head on
        (Box(2, 2, 6, 0, pi / 4), 4 - 2**0.5),  # its corner before our nose
        (Box(4, 2, 4, 0), 0.0),  # touching along an edge
        (Box(4, 2, 4, 2), 0.0),  # touching at a corner
        (Box(4, 2, 3.5, 1.5), 0.0),  # overlapping corners
        (Box(20, 0.5, 0, 0, pi / 2), 0.0),  # a cross: no corner of either lies in the other
        (Box(1, 1, 0.2, 0.1, 0.3), 0.0),  # inside
        (Box(40, 40, 1, 2, 0.3), 0.0),  # around
        (Box(4, 2, 10, 0, ahead=1.5), 7.5),  # centre ahead of the reference point
        (Box(4, 2, 10, 0, pi, ahead=1.5), 4.5),
    ],
)
def test_hand_worked_distances(other: Box, expected: float):
    assert distance(CAR, other) == pytest.approx(expected, abs=1e-12)
    if expected == 0.0:
        assert distance(CAR, other) == 0.0


@given(box, box, st.sampled_from([0.0, 1e4, -3e3]), st.floats(-1e4, 1e4))
@example(Box(4, 2, 0, 0, pi / 4), Box(4, 2, 2.83, 2.83, pi / 4), 0.0, 0.0)  # parallel, touching
@example(Box(4, 2), Box(4, 2, 1e4, 1e4, 1.0), 0.0, 0.0)  # far apart
def test_agrees_with_shapely(a: Box, b: Box, dx: float, dy: float):
    a, b = a.moved(0.0, dx, dy), b.moved(0.0, dx, dy)
    expected = shapely.distance(a.polygon(), b.polygon())
    assert distance(a, b) == pytest.approx(expected, abs=1e-9)


@given(box, box, st.floats(0, 20), st.sampled_from([-1.0, 1.0]))
def test_parallel_boxes_by_their_own_frame(a: Box, b: Box, forward: float, side: float):
    """Along a common heading the distance is that of two axis-aligned rectangles."""
    lateral = side * 0.25 * (a.width + b.width)
    c, s = cos(a.h), sin(a.h)
    shift = a.ahead - b.ahead + forward  # of the reference points, so centres are ``forward`` apart
    other = Box(
        b.length, b.width,
        a.x + shift * c - lateral * s, a.y + shift * s + lateral * c, a.h, b.ahead,
    )  # fmt: skip
    expected = max(0.0, forward - 0.5 * (a.length + b.length))
    assert distance(a, other) == pytest.approx(expected, abs=1e-9)


@given(box, box)
def test_symmetric_to_the_last_bit(a: Box, b: Box):
    assert distance(a, b) == distance(b, a)


@given(box, box, st.floats(-7, 7), st.floats(-1e3, 1e3), st.floats(-1e3, 1e3))
def test_turning_and_moving_the_scene_changes_nothing(
    a: Box, b: Box, turn: float, dx: float, dy: float
):
    moved = distance(a.moved(turn, dx, dy), b.moved(turn, dx, dy))
    assert moved == pytest.approx(distance(a, b), abs=1e-9)


@given(box, box, st.floats(1.0, 3.0), st.floats(1.0, 3.0))
def test_a_larger_box_is_never_farther_away(a: Box, b: Box, longer: float, wider: float):
    larger = Box(b.length * longer, b.width * wider, b.x, b.y, b.h, b.ahead)
    assert distance(a, larger) <= distance(a, b) + 1e-12


@given(box, st.floats(0, 2 * pi), st.floats(0, 30), st.floats(0, 30))
def test_moving_straight_away_from_the_same_centre_is_never_closer(
    b: Box, direction: float, near_by: float, farther: float
):
    """Convex bodies that share a centre part monotonically along any ray."""

    def at(r: float) -> Box:
        x, y = r * cos(direction) - b.ahead * cos(b.h), r * sin(direction) - b.ahead * sin(b.h)
        return Box(b.length, b.width, x, y, b.h, b.ahead)

    assert distance(CAR, at(near_by + farther)) >= distance(CAR, at(near_by)) - 1e-12


@given(box, box)
def test_bounded_by_centres_and_circles(a: Box, b: Box):
    ca, cb = a.polygon().centroid, b.polygon().centroid
    centres = hypot(ca.x - cb.x, ca.y - cb.y)
    circles = 0.5 * (hypot(a.length, a.width) + hypot(b.length, b.width))
    assert centres - circles - 1e-9 <= distance(a, b) <= centres + 1e-9


def random_scene(n: int, e: int, t: int, seed: int = 0):
    rng = np.random.default_rng(seed)
    size = np.column_stack([rng.uniform(1, 9, e), rng.uniform(0.5, 3, e), rng.uniform(-1, 2, e)])
    x, y = rng.uniform(-12, 12, (2, n, e, t))
    h = rng.uniform(-4, 4, (n, e, t))
    h[:, :, 1::2] = h[:, :, 0:-1:2]  # headings that stay for an instant
    h[:, :, 5::6] = h[:, :, :1]  # and that come back
    return size, x, y, h


def test_every_instant_of_every_entity_is_compared_with_the_ego():
    size, x, y, h = random_scene(3, 4, 9)
    got = box_distance(size, x, y, h, np.array([9, 9, 9]))
    assert got.shape == (3, 4, 9)
    assert (got[:, 0] == np.inf).all()
    assert (got[:, 1:] == 0).any()
    for i, e, k in np.ndindex(3, 3, 9):
        ego, other = (
            Box(*size[j, :2], x[i, j, k], y[i, j, k], h[i, j, k], size[j, 2]).polygon()
            for j in (0, e + 1)
        )
        assert got[i, e + 1, k] == pytest.approx(shapely.distance(ego, other), abs=1e-12)


def test_padding_repeats_the_last_instant_and_is_not_read():
    size, x, y, h = random_scene(2, 3, 8)
    n_steps = np.array([5, 1])
    got = box_distance(size, x, y, h, n_steps)
    for i, n in enumerate(n_steps):
        assert (got[i, :, n:] == got[i, :, n - 1 : n]).all()
        for values in (x, y, h):
            values[i, :, n:] = 1e6
    np.testing.assert_array_equal(box_distance(size, x, y, h, n_steps), got)


def test_a_row_does_not_depend_on_its_batch():
    size, x, y, h = random_scene(17, 3, 37)  # 37 instants: vectorised blocks and a remainder
    n_steps = np.random.default_rng(1).integers(1, 38, 17)
    whole = box_distance(size, x, y, h, n_steps)
    for rows in ([3], [16, 0, 5], list(range(16, -1, -1))):
        part = box_distance(size, x[rows], y[rows], h[rows], n_steps[rows])
        assert part.tobytes() == whole[rows].tobytes()


def test_an_instant_does_not_depend_on_its_neighbours():
    size, x, y, h = random_scene(1, 2, 37)
    whole = box_distance(size, x, y, h, np.array([37]))
    for k in range(37):
        one = box_distance(size, *(q[:, :, k : k + 1] for q in (x, y, h)), np.array([1]))
        assert one[0, 1, 0] == whole[0, 1, k]


def test_read_only_strided_and_empty_arrays_are_welcome():
    size, x, y, h = random_scene(4, 2, 6)
    n_steps = np.full(4, 6)
    expected = box_distance(size, x, y, h, n_steps)
    for values in (x, y, h):
        values.flags.writeable = False
    np.testing.assert_array_equal(box_distance(size, x, y, h, n_steps), expected)
    every_other = box_distance(size, x[::2], y[::2], h[::2], n_steps[::2])
    np.testing.assert_array_equal(every_other, expected[::2])
    assert box_distance(size, x[:0], y[:0], h[:0], n_steps[:0]).shape == (0, 2, 6)


def test_alone_the_ego_has_no_distance_to_anybody():
    size, x, y, h = random_scene(2, 1, 5)
    assert (box_distance(size, x, y, h, np.array([5, 5])) == np.inf).all()


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("x", np.zeros((2, 3)), "shape"),
        ("y", np.zeros((2, 3, 5)), "shape"),
        ("h", np.full((2, 3, 4), np.nan), "finite"),
        ("box", np.ones((2, 3)), "box"),
        ("box", np.zeros((3, 3)), "lengths"),
        ("n_steps", np.array([1, 2, 3]), "n_steps"),
        ("n_steps", np.array([1.0, 2.0]), "whole numbers"),
        ("n_steps", np.array([0, 2]), "n_steps"),
        ("n_steps", np.array([5, 2]), "n_steps"),
    ],
)
def test_wrong_arrays_never_reach_compiled_code(field, value, message):
    arrays = {name: np.zeros((2, 3, 4)) for name in "xyh"}
    arrays |= {"box": np.ones((3, 3)), "n_steps": np.array([4, 4])}
    with refuses(ValueError, message):
        box_distance(**(arrays | {field: value}))


def test_steps_of_any_whole_type():
    assert as_steps(np.array([1, 3], dtype=np.int16), 2, 3).dtype == np.int64
