"""Leaders and followers: those that a plain search over all pairs finds."""

import numpy as np
import pytest
from tests.mining.lanes.planted import BOX, recorded

from bridgegen.recordings.lanes.lanelets import lanes_of_lanelets
from bridgegen.recordings.lanes.neighbours import HORIZON, Neighbours
from bridgegen.recordings.lanes.placing import place
from bridgegen.recordings.readers.table import Lanelet

PIECE, PIECES, LANES, WIDTH = 60.0, 5, 3, 3.5


def road():
    """Return lanelets of a road along x: 5 pieces one after the other, 3 lanes from the right."""
    found = []
    for i in range(PIECES):
        x = np.array([i * PIECE, (i + 1) * PIECE])
        for k in range(LANES):
            found.append(Lanelet(
                f"{i}.{k}", np.column_stack([x, np.full(2, (k + 1) * WIDTH)]),
                np.column_stack([x, np.full(2, k * WIDTH)]),
                left_same=f"{i}.{k + 1}" if k + 1 < LANES else "",
                right_same=f"{i}.{k - 1}" if k else "",
                successors=(f"{i + 1}.{k}",) if i + 1 < PIECES else (),
            ))  # fmt: skip
    return found


@pytest.fixture(scope="module")
def scene():
    rng = np.random.default_rng(8)
    tracks = []
    for _ in range(60):
        time = np.arange(0, 40) * 0.1
        x = rng.uniform(0.0, 280.0) + rng.uniform(-1.0, 4.0) * time
        y = (rng.integers(LANES) + rng.uniform(0.3, 0.7)) * WIDTH + np.zeros(40)
        tracks.append({"time": time, "x": x, "y": y, "heading": np.zeros(40),
                       "vx": np.full(40, 3.0), "vy": np.zeros(40)})  # fmt: skip
    traffic = recorded(tracks)
    lanes = lanes_of_lanelets(road())
    return traffic, lanes, place(traffic, lanes)


@pytest.mark.parametrize("side", ["left", "own", "right"])
@pytest.mark.parametrize("is_ahead", [True, False])
def test_the_nearest_in_each_lane_is_that_of_all_pairs(scene, side, is_ahead):
    traffic, lanes, placed = scene
    neighbours = Neighbours(traffic, placed, lanes)
    found = neighbours.ahead(side) if is_ahead else neighbours.behind(side)
    row = np.floor(traffic.y / WIDTH).astype(int)
    wanted = row + {"left": 1, "own": 0, "right": -1}[side]
    step = np.rint(traffic.time / 0.1).astype(int)
    for i in range(0, len(step), 7):
        others = np.flatnonzero((step == step[i]) & (row == wanted[i]) & placed.on_lane)
        others = others[others != i]
        dx = traffic.x[others] - traffic.x[i]
        good = ((dx >= 0) if is_ahead else (dx < 0)) & (np.abs(dx) <= HORIZON)
        if not placed.on_lane[i] or not good.any():
            assert found.state[i] == -1
            assert found.gap[i] == np.inf
            continue
        best = others[good][np.argmin(np.abs(dx[good]))]
        assert found.state[i] == best
        distance = abs(traffic.x[best] - traffic.x[i])
        assert found.gap[i] == pytest.approx(distance - BOX[0], abs=1e-6)


def test_who_leads_is_followed(scene):
    traffic, lanes, placed = scene
    neighbours = Neighbours(traffic, placed, lanes)
    ahead, behind = neighbours.ahead(), neighbours.behind()
    has = np.flatnonzero(ahead.state >= 0)
    np.testing.assert_array_equal(behind.state[ahead.state[has]], has)
    np.testing.assert_allclose(behind.gap[ahead.state[has]], ahead.gap[has], atol=1e-9)


def test_those_that_do_not_count_are_no_neighbours(scene):
    traffic, lanes, placed = scene
    among = np.arange(60) % 2 == 0
    found = Neighbours(traffic, placed, lanes, among).ahead("right")
    states = found.state[found.state >= 0]
    assert len(states)
    assert (traffic.participant[states] % 2 == 0).all()
