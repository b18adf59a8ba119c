"""What MetaDrive's expert is shown of our world is what MetaDrive shows it of its own."""

from dataclasses import replace

import numpy as np
import pytest
from shapely import affinity
from shapely.geometry import LineString, Point, box

from bridgegen.adapters.planners import _metadrive_observation as its
from bridgegen.drivers.interface import Lanes, Observation
from bridgegen.drivers.kinds import PEDESTRIAN

from .two_lane_road import BODY, WIDTH, observation, track

CENTRE = BODY["centre"]
STILL = np.zeros((1, 2))

# Recorded from metadrive-simulator 0.4.3, headless: a straight road of three lanes of 3.5 m, the
# ego on the left one at y = 7 m, one car at 8 m/s. State: x, y, heading, speed, last heading, last
# action; the car's x, y.
RECORDED = [
    (
        (5.0, 7.0, 0.0, 15.0, 0.0, 0.0, 0.0), (27.0, 4.0, 0.1),
        {0: 0.0972222, 2: 0.5, 3: 0.6790124, 4: 0.5, 5: 0.5, 6: 0.5, 7: 0.0, 8: 0.5,
         19: 0.72, 20: 0.47, 21: 0.3425, 22: 0.518, 23: 0.0, 34: 0.0},
        {233: 0.40271, 234: 0.3998006, 235: 0.3971432, 236: 0.4186401, 237: 0.4792253},
    ),
    (
        (45.0449142, 7.4011965, 0.0033935, 9.0468307, 0.0062624, -0.0120454, 0.0404176),
        (57.9838219, 7.1020561, 0.0998298),
        {0: 0.0749335, 2: 0.4983032, 3: 0.414427, 4: 0.4998996, 5: 0.4939773, 6: 0.5202088,
         7: 0.0286889, 8: 0.4108452, 19: 0.6293755, 20: 0.4965689, 21: 0.4765089},
        {},  # its physics' boxes are one step of 0.02 s ahead of their positions
    ),
]  # fmt: skip


def straight(x: float, y: float, h: float, v: float) -> Observation:
    """Return an observation on MetaDrive's road, by the body's centre."""
    o = observation((0.0, 0.0, v))
    rx, ry = x - CENTRE * np.cos(h), y - CENTRE * np.sin(h)
    route = np.zeros((1, 40, 4))
    route[0, :, 0], route[0, :, 1] = rx + np.arange(40) * 2.0, 7.0
    beside = np.zeros((1, 40, 2, 4))
    beside[:, :, 1] = (-WIDTH, WIDTH, 1.0, 1.0)
    lanes = replace(o.lanes, beside=beside)
    return replace(o, x=np.array([rx]), y=np.array([ry]), h=np.array([h]), route=route, lanes=lanes)


@pytest.mark.parametrize(("ego", "car", "numbers", "beams"), RECORDED)
def test_it_is_what_metadrive_shows(ego, car, numbers, beams):
    x, y, h, v, last, steering, throttle = ego
    other = track(*car, v=1.0)
    other[4:8] = (8.0, 0.8, 4.515, 1.852)
    o = replace(straight(x, y, h, v), tracks=other[None, None])
    action = np.array([[steering, throttle]])
    seen = its.observed(o, CENTRE, np.zeros(1), np.array([last]), action)[0]
    for k, value in numbers.items():
        assert seen[k] == pytest.approx(value, abs=4e-4), k  # its ego slips and pitches
    for k, value in beams.items():
        assert seen[35 + k] == pytest.approx(value, abs=1e-4), k
    if beams:
        assert (np.flatnonzero(seen[35:] < 1.0) == list(beams)).all()


def test_beams_meet_boxes_where_shapely_does():
    rng = np.random.default_rng(1)
    for _ in range(20):
        x, y, h = rng.uniform(-30, 30), rng.uniform(-30, 30), rng.uniform(-3, 3)
        tracks = np.array([[track(*rng.uniform(-40, 40, 2), rng.uniform(-3, 3)) for _ in range(3)]])
        found = its.beams(*np.array([[x], [y], [h]]), tracks)[0]
        boxes = [
            affinity.translate(
                affinity.rotate(box(-2.25, -0.9, 2.25, 0.9), t[3], (0, 0), use_radians=True),
                t[1], t[2],
            )
            for t in tracks[0]
        ]  # fmt: skip
        start = Point(x, y)
        if any(one.distance(start) < 0.1 for one in boxes):
            continue
        for k in range(0, its.BEAMS, 7):
            angle = h + k * 2 * np.pi / its.BEAMS
            ray = LineString([start, (x + 50 * np.cos(angle), y + 50 * np.sin(angle))])
            hits = [start.distance(ray.intersection(one)) for one in boxes if ray.intersects(one)]
            assert found[k] * 50.0 == pytest.approx(min(hits, default=50.0), abs=1e-6)


def test_unconfirmed_far_and_surrounding_boxes_are_not_met():
    here = np.zeros(1), np.zeros(1), np.zeros(1)
    tentative, far = track(10.0, 0.0), track(53.0, 0.0)
    tentative[0] = 1.0
    for one in (tentative, far, track(0.5, 0.0)):
        assert (its.beams(*here, one[None, None]) == 1.0).all()


@pytest.mark.parametrize("curvature", [0.02, -0.02])
def test_a_bend_is_its_radius_direction_and_angle(curvature):
    o = observation((0.0, 0.0, 10.0), curvature=curvature)
    turned = np.array([0.3])
    seen = its.observed(o, CENTRE, turned, o.h, STILL)[0]
    # Two lanes, the left one 3.5 m to the left of the route, which is 50 m from the arc's centre.
    radius = 50.0 - np.sign(curvature) * WIDTH
    assert seen[11] == pytest.approx(radius / (60.0 + 2 * WIDTH), rel=1e-6)
    assert seen[12] == (0.0 if curvature > 0 else 1.0)
    angle = 0.3 + 76.0 * 0.02  # from 2 m ahead to the last point, at 78 m
    assert seen[13] == pytest.approx((np.degrees(angle) / 135.0 + 1.0) / 2, rel=1e-6)
    assert (seen[16:19] == [0.0, 0.5, 0.5]).all()


def test_the_checkpoint_is_where_the_bend_begins():
    o = observation((0.0, 0.0, 10.0))
    o.route[:, 10:, 3] = 0.05
    seen = its.observed(o, CENTRE, np.zeros(1), o.h, STILL)[0]
    # 20 m ahead of the rear axle, in the middle between the two lanes, to the left.
    assert seen[9] == pytest.approx(((20.0 - CENTRE) / 50.0 + 1.0) / 2, abs=1e-6)
    assert seen[10] == pytest.approx((WIDTH / 2 / 50.0 + 1.0) / 2, abs=1e-6)
    assert (seen[11:14] == [0.0, 0.5, 0.5]).all()
    assert seen[16] > 0.2
    assert seen[17] == 0.0


def test_checkpoints_are_on_the_side_where_metadrive_shows_them():
    # Recorded from metadrive-simulator 0.4.3: two lanes of 3.5 m, the ego on the left one at
    # y = 3.5 m; the straight ends at x = 94.49 m, the bend to the right at (142.45, -85.87).
    o = straight(58.52632, 3.44365, -0.013592, 11.4)
    route = np.zeros((1, 40, 4))
    route[0, :, 0], route[0, :, 1] = 94.4906 + 2.0 * (np.arange(40) - 18), 3.5
    route[0, 18:, 3] = -0.02
    route[0, 39, :2] = 142.4461, -85.8724 + WIDTH / 2
    seen = its.observed(replace(o, route=route), CENTRE, np.zeros(1), o.h, STILL)[0]
    assert seen[[9, 10, 14, 15]] == pytest.approx(
        [0.859836, 0.487953, 0.847292, 0.140297], abs=1e-3
    )


def test_others_are_vehicles_the_nearest_first():
    tracks = np.array(
        [[track(30.0, 0.0, v=5.0), track(12.0, 3.0), track(5.0, 0.0, kind=PEDESTRIAN)]]
    )
    o = observation((0.0, 0.0, 10.0), tracks=tracks)
    seen = its.observed(o, CENTRE, np.zeros(1), o.h, STILL)[0, 19:35].reshape(4, 4)
    assert seen[0] == pytest.approx([(10.6 / 50 + 1) / 2, 0.53, (-36 / 80 + 1) / 2, 0.5], abs=1e-6)
    assert seen[1, 0] == pytest.approx((28.6 / 50 + 1) / 2, abs=1e-6)
    assert (seen[2:] == 0.0).all()


def test_a_row_does_not_depend_on_the_others():
    rng = np.random.default_rng(0)
    n = 70
    rows = rng.uniform((0.0, -1.0, 0.0), (200.0, 4.0, 30.0), (n, 3))
    tracks = np.array(
        [[track(*rng.uniform(-40, 40, 2), v=3.0) for _ in range(5)] for _ in range(n)]
    )
    o = observation(*map(tuple, rows), curvature=0.01, tracks=tracks)
    turned, last, action = np.zeros(n), o.h - 0.01, rng.uniform(-1, 1, (n, 2))
    whole = its.observed(o, CENTRE, turned, last, action)
    assert (whole >= 0.0).all()
    assert (whole <= 1.0).all()
    for k in (0, 33, 69):
        one = slice(k, k + 1)
        alone = its.observed(o.take(one), CENTRE, turned[one], last[one], action[one])
        assert alone.tobytes() == whole[one].tobytes()


def test_it_is_the_same_seen_from_any_direction():
    o = observation((0.0, 0.4, 10.0), curvature=0.01, tracks=track(20.0, 3.0, 0.2, 4.0)[None, None])
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.array([[c, s], [-s, c]])
    route, tracks = o.route.copy(), o.tracks.copy()
    route[:, :, :2], route[:, :, 2] = route[:, :, :2] @ turn, route[:, :, 2] + 0.7
    tracks[:, :, 1:3], tracks[:, :, 3] = tracks[:, :, 1:3] @ turn, tracks[:, :, 3] + 0.7
    tracks[:, :, 4:6] = tracks[:, :, 4:6] @ turn
    x, y = (np.stack([o.x, o.y], axis=1) @ turn).T
    turned = replace(o, x=x, y=y, h=o.h + 0.7, route=route, tracks=tracks)
    seen = its.observed(o, CENTRE, np.zeros(1), o.h, STILL)
    again = its.observed(turned, CENTRE, np.zeros(1), turned.h, STILL)
    assert again == pytest.approx(seen, abs=1e-6)


def test_lanes_are_those_of_the_same_direction():
    o = observation((0.0, 0.0, 10.0))
    assert isinstance(o.lanes, Lanes)
    against = o.lanes.beside.copy()
    against[:, :, 0, 2] = -1.0
    one_lane = replace(o, lanes=replace(o.lanes, beside=against))
    seen = its.observed(one_lane, CENTRE, np.zeros(1), o.h, STILL)[0]
    assert seen[:2] == pytest.approx([WIDTH / 2 / 18.0] * 2, abs=1e-6)
    seen = its.observed(o, CENTRE, np.zeros(1), o.h, STILL)[0]
    assert seen[:2] == pytest.approx([1.5 * WIDTH / 18.0, 0.5 * WIDTH / 18.0], abs=1e-6)
