from dataclasses import replace

import numpy as np
import pytest
from gymnasium.spaces import Box
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.drivers.interface import ROUTE_POINTS, Observation, Scene
from bridgegen.drivers.policy import NEAREST, SIZE, PolicyDriver, control, vectors

ANGLE = st.floats(-np.pi, np.pi)
PLACE = st.floats(-1000.0, 1000.0)


def observation(seed=0, n=2, m=3):
    rng = np.random.default_rng(seed)
    tracks = rng.uniform(-20.0, 20.0, (n, m, 12))
    tracks[:, :, 0] = rng.integers(0, 4, (n, m))
    return Observation(
        0.0, np.ones(n, bool), *rng.uniform(-20.0, 20.0, (5, n)), rng.uniform(0.0, 20.0, n),
        rng.uniform(-1.0, 1.0, n), rng.uniform(-20.0, 20.0, (n, ROUTE_POINTS, 4)), tracks,
        np.array([np.inf, 12.0])[:n], np.array([0, 1], np.int8)[:n],
    )  # fmt: skip


def moved(o, dx, dy, turn):
    c, s = np.cos(turn), np.sin(turn)

    def point(x, y):
        return c * x - s * y + dx, s * x + c * y + dy

    x, y = point(o.x, o.y)
    route, tracks = o.route.copy(), o.tracks.copy()
    route[..., 0], route[..., 1] = point(o.route[..., 0], o.route[..., 1])
    route[..., 2] += turn
    tracks[..., 1], tracks[..., 2] = point(o.tracks[..., 1], o.tracks[..., 2])
    tracks[..., 3] += turn
    vx, vy = o.tracks[..., 4], o.tracks[..., 5]
    tracks[..., 4], tracks[..., 5] = c * vx - s * vy, s * vx + c * vy
    return replace(o, x=x, y=y, h=o.h + turn, route=route, tracks=tracks)


@given(PLACE, PLACE, ANGLE)
def test_a_policy_does_not_know_where_north_is(dx, dy, turn):
    before = observation()
    np.testing.assert_allclose(vectors(moved(before, dx, dy, turn)), vectors(before), atol=1e-5)


@given(st.integers(0, 10_000), st.integers(0, 9))
def test_an_observation_is_in_its_space(seed, m):
    found = vectors(observation(seed, m=m))
    box, _ = PolicyDriver.spaces()
    assert isinstance(box, Box)
    assert found.shape == (2, SIZE)
    assert all(box.contains(one) for one in found)


def test_the_order_of_the_others_does_not_matter():
    one = observation(m=5)
    other = replace(one, tracks=one.tracks[:, ::-1])
    np.testing.assert_array_equal(vectors(one), vectors(other))


def test_nobody_is_zeros_and_the_nearest_come_first():
    o = observation(n=1, m=2)
    o.tracks[0, :, 0] = 2.0
    o.x[0] = o.y[0] = o.h[0] = 0.0
    o.tracks[0, :, 1:3] = [[30.0, 0.0], [10.0, 2.0]]
    told = vectors(o)[0, -NEAREST * 8 :].reshape(NEAREST, 8)
    assert told[0, :3].tolist() == pytest.approx([1.0, 0.1, 0.02])
    assert told[1, :3].tolist() == pytest.approx([1.0, 0.3, 0.0])
    assert not told[2:].any()


class Full:
    """Pedal to the floor, wheel to the left; counts its calls in its state."""

    def predict(self, seen, state=None, episode_start=None, deterministic=False):
        assert deterministic
        assert episode_start.all() == (state is None)
        return np.tile([1.0, -2.0], (len(seen), 1)), (state or 0) + 1


class Drives(PolicyDriver):
    def load(self):
        return Full()


def test_actions_are_shares_of_the_vehicles_limits():
    scene = Scene(0.05, 9, ("bv",), np.zeros(1, np.int64), 4.5, 1.8, 1.4, 50.0, 3.0, 8.0, 0.2)
    driver = Drives()
    driver.reset(2, scene)
    for _ in range(2):
        answer = driver.act(observation())
    assert answer.acceleration.tolist() == [3.0, 3.0]
    assert answer.curvature.tolist() == [-0.2, -0.2]
    assert control(np.array([[-1.0, 0.5]]), scene).acceleration.tolist() == [-8.0]


class Counts:
    """Steers by how often its state has been handed on: each block has a state of its own."""

    def predict(self, seen, state=None, episode_start=None, deterministic=False):
        assert len(seen) == len(episode_start) == 64
        state = np.zeros(len(seen)) if state is None else state + seen[:, 0]
        return np.stack([state, state], axis=1), state


class Recurs(PolicyDriver):
    def load(self):
        return Counts()


def test_each_block_of_scenarios_has_its_own_state():
    scene = Scene(0.05, 9, ("bv",), np.zeros(1, np.int64), 4.5, 1.8, 1.4, 50.0, 1.0, 1.0, 1.0)
    one = observation(n=2)
    many = one.take(np.arange(130) % 2)
    driver = Recurs()
    driver.reset(130, scene)
    answers = [driver.act(many).curvature for _ in range(3)]
    for k, answer in enumerate(answers):
        expected = k * vectors(one)[:, 0].astype(float)
        np.testing.assert_allclose(answer, np.clip(expected, -1.0, 1.0)[np.arange(130) % 2])


def test_a_block_that_cuts_vectors_is_refused():
    class Cut(Recurs):
        block = 50

    with refuses(InputError, "50", "64"):
        Cut()
