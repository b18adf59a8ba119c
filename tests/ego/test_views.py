"""What a driver is shown that wants lanes, the map, conflicts and the last second."""

from dataclasses import replace

import numpy as np
import pytest

from bridgegen.drivers import interface
from bridgegen.drivers.polylines import ATTRIBUTES, gather
from bridgegen.drivers.road_map import road_map
from bridgegen.drivers.views import History, MapSender

from .roads import network_of
from .wanting import watched

SCENARIOS = ["crossroads-s4", "cut-in", "red-light-runner"]


@pytest.fixture(scope="module", params=SCENARIOS)
def shown(request):
    return watched(request.param, interface.WANTS, n=3)


@pytest.mark.thorough
def test_the_lanes_are_those_of_the_map(shown):
    """The lane beside is where the map has it, and its marking allows what the map says."""
    for o in shown.seen[::40]:
        for i in np.flatnonzero(o.running):
            roads = shown.scene.maps[shown.scene.map_of[i]]
            by_id = {lane.id: lane for lane in roads.lanes}
            for p in range(0, 40, 5):
                x, y, h, _ = o.route[i, p]
                own = min(
                    (by_id[one] for one in roads.route),
                    key=lambda lane: np.hypot(*(lane.centre[:, :2] - (x, y)).T).min(),
                )
                if np.hypot(*(own.centre[:, :2] - (x, y)).T).min() > 1.1:
                    continue  # beyond the route's end, or where it begins
                inner = np.hypot(*(own.centre[1:-1, :2] - (x, y)).T).min(initial=np.inf)
                if inner > 1.1:
                    continue  # at the border of two lanes
                assert o.lanes.junction[i, p] == bool(own.junction)
                for side, name in enumerate(("left", "right")):
                    offset, width, way, may = o.lanes.beside[i, p, side]
                    beside = by_id.get(getattr(own, f"{name}_lane"))
                    if beside is None or beside.kind != "driving":
                        assert way == 0
                        continue
                    if way == 0:
                        assert width == 0.0
                        continue
                    same = getattr(own, f"{name}_is_same_way")
                    assert way == (1 if same else -1)
                    if same:
                        assert may == getattr(own, f"may_change_{name}")
                    there = (x - offset * np.sin(h), y + offset * np.cos(h))
                    assert np.hypot(*(beside.centre[:, :2] - there).T).min() < 1.1
                    assert (offset > 0.0) == (name == "left")


def test_the_goal_is_where_the_route_ends(shown):
    for o in shown.seen[::40]:
        s, c = np.sin(o.lanes.goal[:, 2]), np.cos(o.lanes.goal[:, 2])
        away = np.hypot(o.lanes.goal[:, 0] - o.x, o.lanes.goal[:, 1] - o.y)
        assert (away[o.running] <= o.lanes.ends[o.running] + 2.0).all()
        near = o.running & (o.lanes.ends < 70.0) & (o.lanes.ends > 10.0)
        for i in np.flatnonzero(near):
            p = o.lanes.ends[i] / interface.ROUTE_STEP
            at = o.route[i, int(p), :2] + (p - int(p)) * interface.ROUTE_STEP * np.array(
                [c[i], s[i]]
            )
            assert np.hypot(*(at - o.lanes.goal[i, :2])) < 0.2


def test_near_are_the_nearest_pieces(shown):
    """The oracle measures all of them."""
    for o in shown.seen[::25]:
        for i in np.flatnonzero(o.running):
            points = shown.scene.maps[shown.scene.map_of[i]].pieces[:, :, :2]
            middles = 0.5 * (points.min(axis=1) + points.max(axis=1))
            d2 = ((middles - (o.x[i], o.y[i])) ** 2).sum(axis=1)
            nearest = np.lexsort((np.arange(len(d2)), d2))[: interface.NEAR_PIECES]
            found = o.map.near[i][: len(nearest)]
            np.testing.assert_allclose(d2[found], d2[nearest], rtol=1e-12)
            assert len(set(found.tolist())) == len(found)
            assert (o.map.near[i][len(nearest) :] == -1).all()


def test_the_ego_is_on_a_lane_of_its_route(shown):
    on = 0
    for o in shown.seen[::10]:
        for i in np.flatnonzero(o.running):
            roads = shown.scene.maps[shown.scene.map_of[i]]
            lane = o.map.lane[i]
            if lane >= 0:
                on += 1
                assert roads.lanes[lane].id in roads.route
    assert on > 50


def test_all_lights_are_shown(shown):
    for k in range(0, len(shown.seen), 30):
        o = shown.seen[k]
        i = np.flatnonzero(o.running)
        np.testing.assert_array_equal(o.map.lights[i], shown.rollout.lights[i, :, k])
    n = {len(one.lights) for one in shown.scene.maps}
    assert n == {shown.rollout.lights.shape[1]}


def test_history_is_what_the_tracks_were(shown):
    step = round(interface.HISTORY_STEP / shown.scene.time_step)
    for k in (0, 5, 47, len(shown.seen) - 1):
        o = shown.seen[k]
        for j in range(interface.HISTORY):
            then = k - j * step
            expected = shown.seen[then].tracks if then >= 0 else np.zeros_like(o.tracks)
            np.testing.assert_array_equal(o.history[:, :, j], expected)


def test_conflicts_are_ahead_until_they_are_passed(shown):
    """A zone comes nearer by what the ego travels; an untracked participant has none."""
    before = None
    met = 0
    for o in shown.seen:
        zones = o.conflicts.zones
        assert np.isnan(zones[o.tracks[:, :, 0] < 2]).all()
        first = zones[..., 0]
        known = ~np.isnan(first)
        met += known.sum()
        ordered = np.where(known, first, np.inf)
        assert (np.diff(np.nan_to_num(ordered, posinf=1e9), axis=-1) >= 0.0).all()
        lengths = zones[..., 1] - zones[..., 0]
        assert (lengths[known] >= shown.scene.length - 1e-9).all()
        assert set(np.unique(zones[..., 4][known])) <= {-1.0, 0.0, 1.0}
        assert set(np.unique(zones[..., 5][known])) <= {0.0, 1.0, 2.0}
        if before is not None:
            one_way = (known.sum(axis=-1) == 1) & ((~np.isnan(before[..., 0])).sum(axis=-1) == 1)
            same = one_way & (
                np.abs(lengths[..., 0] - before[..., 0, 1] + before[..., 0, 0]) < 1e-9
            )
            same &= o.running[:, None]
            moved = (before[..., 0, 0] - first[..., 0])[same]
            travelled = np.broadcast_to(o.v[:, None] * shown.scene.time_step, same.shape)[same]
            np.testing.assert_allclose(moved, travelled, atol=0.1)
        before = zones
    assert met > 0


def test_polylines_are_the_near_pieces_seen_from_the_ego(shown):
    o = shown.seen[20]
    found = gather(shown.scene, o)
    n = len(o.x)
    assert found.points.shape == (n, interface.NEAR_PIECES, interface.PIECE_POINTS, 4)
    assert found.attributes.shape == (n, interface.NEAR_PIECES, ATTRIBUTES)
    assert found.points.dtype == found.attributes.dtype == np.float32
    for i in range(n):
        roads = shown.scene.maps[shown.scene.map_of[i]]
        for q in (0, 1, 17):
            piece = o.map.near[i, q]
            count = roads.piece_points[piece]
            assert found.mask[i, q].sum() == count
            points = found.points[i, q, :count].astype(np.float64)
            c, s = np.cos(o.h[i]), np.sin(o.h[i])
            x = o.x[i] + c * points[:, 0] - s * points[:, 1]
            y = o.y[i] + s * points[:, 0] + c * points[:, 1]
            np.testing.assert_allclose(x, roads.pieces[piece, :count, 0], atol=1e-4)
            np.testing.assert_allclose(y, roads.pieces[piece, :count, 1], atol=1e-4)
            assert found.attributes[i, q, roads.piece_kind[piece]] == 1.0
            assert found.attributes[i, q, :4].sum() == 1.0
    assert not found.points[~found.mask].any()


def test_polylines_do_not_depend_on_the_batch(shown):
    o = shown.seen[20]
    whole = gather(shown.scene, o)
    part = gather(replace(shown.scene, map_of=shown.scene.map_of[1:2]), o.take(np.array([1])))
    np.testing.assert_array_equal(part.points[0], whole.points[1])
    np.testing.assert_array_equal(part.attributes[0], whole.attributes[1])


def test_a_history_stays_as_it_was_when_more_follows():
    history = History(0.05)
    frames = np.random.default_rng(1).random((500, 2, 3, 13))
    kept = [(k, history.remember(frames[k])) for k in range(500)]
    for k, seen in kept:
        np.testing.assert_array_equal(seen[:, :, 0], frames[k])
        if k >= 20:
            np.testing.assert_array_equal(seen[:, :, 10], frames[k - 20])
        with pytest.raises(ValueError, match="read-only"):
            seen[:] = 0.0


@pytest.mark.parametrize("step", [0.01, 0.03, 0.04, 0.1])
def test_a_history_takes_the_nearest_instants(step):
    history = History(step)
    for k in range(150):
        seen = history.remember(np.full((1, 1, 13), float(k + 1)))
    times = (150 - seen[0, 0, :, 0]) * step
    np.testing.assert_allclose(times, np.arange(11) * 0.1, atol=0.5 * step + 1e-9)


def test_a_map_is_sent_once():
    one, other = (road_map(*network_of(name), ()) for name in SCENARIOS[:2])
    sender = MapSender()
    first, second = sender.send([one]), sender.send([other, one])
    assert (first.kept, len(first.new), first.numbers) == (0, 1, (0,))
    assert (second.kept, len(second.new), second.numbers) == (1, 1, (1, 0))
    assert sender.send([one, other]).new == ()
