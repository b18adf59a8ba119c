"""Two-dimensional time to collision, by hand, by stepping, and by the published definition."""

from math import cos, hypot, pi, sin

import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given
from hypothesis import strategies as st

from bridgegen.assess.metrics.times import ttc, ttc_over_time

CAR = (4.0, 2.0, 0.0)  # length, width, the centre at the reference point


def pose(x=0.0, y=0.0, h=0.0, v=0.0, box=CAR):
    return x, y, h, v, box


def first_contact(rollout_of, *poses):
    """ttc of one instant of the given vehicles."""
    x, y, h, v, box = zip(*poses, strict=True)
    states = {n: np.array(q)[None, :, None] for n, q in zip("xyhv", (x, y, h, v), strict=True)}
    return float(ttc(rollout_of(box=box, **states))[0])


@pytest.mark.parametrize(
    ("ego", "other", "expected"),
    [
        (pose(v=5), pose(x=54, h=pi, v=5), 5.0),  # head on: 50 m at 10 m/s
        (pose(v=8), pose(x=24, v=3), 4.0),  # catching up: 20 m at 5 m/s
        (pose(v=3), pose(x=-24, v=8), 4.0),  # being caught up with
        (pose(v=10), pose(x=24), 2.0),  # standing in the way
        (pose(v=5), pose(x=24, v=5), np.inf),  # following at the same speed
        (pose(v=3), pose(x=24, v=8), np.inf),  # the one ahead gets away
        (pose(v=30), pose(y=3.5, v=5), np.inf),  # overtaking in the next lane
        (pose(v=5), pose(x=-54, h=pi, v=5), np.inf),  # already past each other
        (pose(), pose(x=10), np.inf),  # both standing
        # Crossing at a right angle: |20 − 10t| ≤ 2 + 1 on both axes, from 1.7 s on.
        (pose(v=10), pose(x=20, y=-20, h=pi / 2, v=10), 1.7),
        # The other needs 3.7 s to our lane, and we are past at 2.3 s.
        (pose(v=10), pose(x=20, y=-40, h=pi / 2, v=10), np.inf),
        # As slow as half our speed it arrives at (25 − 3)/5 = 4.4 s, we at (47 − 3)/10 = 4.4 s.
        (pose(v=10), pose(x=46, y=-25, h=pi / 2, v=5), 4.4),
        # Merging at 45° from behind on the left: the rear right corner of neither is first.
        (pose(v=5, box=(2, 2, 0)), pose(x=8 + 2**0.5, h=pi / 4, box=(2, 2, 0)), 7 / 5),
        (pose(), pose(x=3), 0.0),  # in contact
        (pose(v=5), pose(x=3, v=5), 0.0),
        (pose(), pose(x=4), 0.0),  # just touching
        (pose(v=3), pose(x=3, v=9), 0.0),  # in contact, though parting
        # The centre 1.5 m ahead of the reference point on both: they face each other, 3 m closer.
        (pose(v=5, box=(4, 2, 1.5)), pose(x=27, h=pi, v=5, box=(4, 2, 1.5)), 2.0),
    ],
)
@pytest.mark.parametrize("turn", [0.0, 0.7, -2.5, 31.0])
def test_hand_worked(rollout_of, ego, other, expected, turn):
    def turned(x, y, h, v, box):
        return x * cos(turn) - y * sin(turn), x * sin(turn) + y * cos(turn), h + turn, v, box

    got = first_contact(rollout_of, turned(*ego), turned(*other))
    assert got == pytest.approx(expected, abs=1e-9)


def test_abreast_on_parallel_courses_there_is_none_however_the_cosines_round(rollout_of):
    """A rounded cosine would make them meet in some 10¹⁶ s."""
    for h in np.linspace(-10, 10, 201):
        for v in (7.0, 7.3):
            beside = pose(x=-3.5 * sin(h), y=3.5 * cos(h), h=h + 2 * pi, v=7.0)
            assert first_contact(rollout_of, pose(h=h, v=v), beside) == np.inf


def test_the_smallest_over_instants_and_others(rollout_of):
    v = [[5, 5, 5], [0, 0, 0], [0, 0, 0]]
    first = [34, 24, 34]  # 30, 20, 30 m at 5 m/s
    assert ttc(rollout_of(x=[[0, 0, 0], first, [-99, -99, 29]], v=v)) == [4.0]
    assert ttc(rollout_of(x=[[0, 0, 0], first, [-99, 9, 29]], v=v)) == [1.0]


def test_the_closest_instant_need_not_be_the_most_dangerous(rollout_of):
    """1.5 m beside each other on parallel courses, and 20 m behind a standing one."""
    for x, y in (([0, 24], [3.5, 0]), ([24, 0], [0, 3.5]), ([34, 0, 24], [0, 3.5, 0])):
        v = np.where(np.array(y) > 0, 5.0, 0.0)
        rollout = rollout_of(x=np.stack([0 * v, x]), y=np.stack([0 * v, y]), v=[5 + 0 * v, v])
        assert ttc(rollout) == [4.0]


def test_a_slow_approach_is_an_approach(rollout_of):
    """Converging by a millionth of a radian: 1.499998 m at 1e-5 m/s."""
    got = first_contact(rollout_of, pose(v=10), pose(y=3.5, h=-1e-6, v=10))
    assert got == pytest.approx(149_999.8, rel=1e-6)


def test_driving_on_at_constant_velocity_the_time_runs_down(rollout_of):
    """After k steps of straight driving ttc is its first value minus k steps."""
    time = 0.05 * np.arange(20)
    scene = {
        "x": np.stack([10 * time, 20 + 0 * time]), "y": np.stack([0 * time, -22 + 10 * time]),
        "h": [[0.0], [pi / 2]], "v": 10.0,
    }  # fmt: skip
    for k in range(1, 21):
        got = ttc(rollout_of(**scene, n_steps=[k]))
        assert got == pytest.approx([1.9 - 0.05 * (k - 1)], abs=1e-12)


# Against the world.


def corners(x, y, h, box):
    length, width, ahead = box
    c, s = np.cos(h), np.sin(h)
    local = [(0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)]
    return np.array(
        [
            (
                x + (ahead + f * length) * c - g * width * s,
                y + (ahead + f * length) * s + g * width * c,
            )
            for f, g in local
        ]
    )


def polygons(p, times):
    """The box of a pose, driven straight on, at each time."""
    x, y, h, v, box = p
    there = np.array([v * cos(h), v * sin(h)]) * np.asarray(times)[:, None]
    return shapely.polygons(corners(x, y, h, box)[None] + there[:, None])


def resized(p, by):
    length, width, ahead = p[4]
    return *p[:4], (length + by, width + by, ahead)


boxes = st.tuples(st.floats(0.5, 12), st.floats(0.5, 3), st.sampled_from([0.0, 1.4]))
poses = st.builds(
    pose,
    st.floats(-30, 30),
    st.floats(-30, 30),
    st.one_of(st.floats(-7, 7), st.sampled_from([0.0, pi / 2, pi, -pi / 2])),
    st.one_of(st.floats(0.5, 15), st.just(0.0)),
    boxes,
)


@given(poses, poses)
@example(pose(v=10), pose(x=20, y=-20, h=pi / 2, v=10))
@example(pose(v=10), pose(x=20, y=-26, h=pi / 2, v=10))  # corners brush past each other
@example(pose(h=pi / 2, box=(1, 1, 0)), pose(x=1, y=-2, h=pi / 2, box=(3, 1, 0)))  # corners touch
def test_stepping_through_time_finds_no_earlier_and_no_other_contact(rollout_of, a, b):
    """Shapely's distance, every 5 ms for 8 s: free before ttc, in contact at ttc."""
    got = first_contact(rollout_of, a, b)
    assert got >= 0.0
    before = np.arange(0.0, min(8.0, got), 0.005)
    # A micrometre less of box: where they only graze, rounding decides whether they touch.
    free = shapely.distance(polygons(resized(a, -1e-6), before), polygons(b, before))
    assert (free > 0.0).all()
    if got < 1e6:
        meeting = shapely.distance(polygons(a, [got]), polygons(b, [got]))
        assert meeting == pytest.approx([0.0], abs=1e-6)


def ray_to_segment(p, d, q, r):
    """Distance along the unit vector d from p to segment qr, inf if the ray misses it."""
    edge = r - q
    det = d[0] * -edge[1] + d[1] * edge[0]
    if abs(det) < 1e-12:
        return np.inf
    rhs = q - p
    along = (rhs[0] * -edge[1] + rhs[1] * edge[0]) / det
    share = (d[0] * rhs[1] - d[1] * rhs[0]) / det
    return along if along >= 0 and -1e-12 <= share <= 1 + 1e-12 else np.inf


def published(a, b):
    """Jiao (2023): distance to collision over relative speed.

    The distance to collision is the shortest way that a corner of one box has, along the relative
    velocity, to an edge of the other.
    """
    ca, cb = corners(*a[:3], a[4]), corners(*b[:3], b[4])
    w = np.array([b[3] * cos(b[2]) - a[3] * cos(a[2]), b[3] * sin(b[2]) - a[3] * sin(a[2])])
    speed = hypot(*w)
    if speed <= 1e-10 * (a[3] + b[3]):  # standing, or side by side but for rounding
        return np.inf
    d = w / speed
    ways = [
        ray_to_segment(corner, direction, other[k - 1], other[k])
        for mine, other, direction in ((cb, ca, d), (ca, cb, -d))
        for corner in mine
        for k in range(4)
    ]
    return min(ways) / speed


@given(poses, poses)
def test_agrees_with_the_published_definition(rollout_of, a, b):
    apart = shapely.distance(*(shapely.Polygon(corners(*p[:3], p[4])) for p in (a, b)))
    assume(apart > 1e-6)  # the definition is for vehicles that are not in contact
    expected, got = published(a, b), first_contact(rollout_of, a, b)
    if np.isinf(expected) != np.isinf(got):
        # Only where they graze: a millimetre more of box, or less, decides.
        wide, narrow = (
            first_contact(rollout_of, resized(a, by), resized(b, by)) for by in (2e-3, -2e-3)
        )
        assert np.isfinite(wide)
        assert np.isinf(narrow)
    else:
        assert got == pytest.approx(expected, rel=1e-6, abs=1e-6)


@given(poses, poses)
def test_whichever_of_the_two_is_the_ego(rollout_of, a, b):
    one, other = first_contact(rollout_of, a, b), first_contact(rollout_of, b, a)
    assert one == pytest.approx(other, rel=1e-9, abs=1e-9)


@given(poses, poses, st.floats(0.1, 10))
def test_at_other_speeds_the_same_way_takes_another_time(rollout_of, a, b, factor):
    scaled = first_contact(rollout_of, *((*p[:3], p[3] * factor, p[4]) for p in (a, b)))
    assert scaled * factor == pytest.approx(first_contact(rollout_of, a, b), rel=1e-9)


# Parity: every instant, nothing skipped.


def plain(rollout):
    """Swept separating axes for all instants of all others at once."""
    half = 0.5 * rollout.box[None, :, :2, None]
    u = np.stack([np.cos(rollout.h), np.sin(rollout.h)], axis=-1)
    centre = np.stack([rollout.x, rollout.y], axis=-1) + rollout.box[None, :, 2, None, None] * u
    w = rollout.v[..., None] * u
    left = np.stack([-u[..., 1], u[..., 0]], axis=-1)
    d, w = centre[:, 1:] - centre[:, :1], w[:, 1:] - w[:, :1]
    begin, end = np.zeros(d.shape[:3]), np.full(d.shape[:3], np.inf)
    frames = [(u[:, :1], left[:, :1]), (u[:, 1:], left[:, 1:])]
    halves = [half[:, :1], half[:, 1:]]
    for axis in (vector for frame in frames for vector in frame):
        reach = sum(
            h[:, :, side] * np.abs((axis * frame[side]).sum(-1))
            for frame, h in zip(frames, halves, strict=True)
            for side in (0, 1)
        )
        s, rate = (d * axis).sum(-1), (w * axis).sum(-1)
        still = np.abs(rate) < 1e-11
        safe = np.where(still, 1.0, rate)
        enter = np.where(
            still, np.where(np.abs(s) <= reach, -np.inf, np.inf), -s / safe - reach / np.abs(safe)
        )
        leave = np.where(still, np.inf, -s / safe + reach / np.abs(safe))
        begin, end = np.maximum(begin, enter), np.minimum(end, leave)
    times = np.where(begin <= end, begin, np.inf)
    real = np.arange(rollout.x.shape[2]) < rollout.n_steps[:, None]
    return np.where(real[:, None], times, np.inf).min(axis=(1, 2))


@pytest.mark.parametrize(
    ("shape", "within"),
    [((400, 2, 60), 15), ((60, 6, 25), 30), ((40, 64, 7), 100), ((400, 2, 1), 15)],
)
def test_skipping_instants_changes_nothing(driven, shape, within):
    rollout = driven(*shape, seed=shape[1], within=within)
    got = ttc(rollout)
    np.testing.assert_allclose(got, plain(rollout), rtol=1e-9, atol=1e-9)
    assert (got == 0).any()
    assert (np.isfinite(got) & (got > 0)).any()
    assert (got == np.inf).any() or shape[1] > 2


def test_over_time_it_is_that_of_each_instant(rollout_of):
    """Head on at 10 m/s from 50 m; the second row stops after two instants, the third failed."""
    t = np.arange(5) * 0.5
    x = np.stack([5.0 * t, 54.0 - 5.0 * t])
    rollout = rollout_of(
        x=np.stack([x] * 3), h=[[[0.0], [pi]]], v=5.0, box=CAR, n_steps=[5, 2, 5], status=[0, 0, 1],
        time_step=0.5,
    )  # fmt: skip
    got = ttc_over_time(rollout)
    assert got[0] == pytest.approx(5.0 - t)
    assert got[1, :2] == pytest.approx(5.0 - t[:2])
    assert np.isnan(got[2]).all()
    assert np.nanmin(got[0]) == ttc(rollout)[0]
