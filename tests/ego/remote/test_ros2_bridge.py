"""The example of a bridge to ROS 2, with a stack and an rclpy that are the tests' own."""

import importlib.util
import math
import threading
from pathlib import Path

import numpy as np
import pytest
from tests.approval import refuses
from tests.ego.remote import ros2_stub
from tests.ego.remote.asked import observation, scene

from bridgegen.drivers.remote import serve
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load

TESTS = Path(__file__).parents[2]
BRIDGE = TESTS.parent / "docs" / "examples" / "ros2_bridge.py"


@pytest.fixture
def stack(monkeypatch):
    return ros2_stub.install(monkeypatch)


@pytest.fixture
def bridge(stack):
    spec = importlib.util.spec_from_file_location("ros2_bridge", BRIDGE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def seen(**changed):
    return observation(**changed).take(np.array([1]))


def test_an_instant_is_published_before_its_clock(stack, bridge):
    driver = bridge.Ros2Driver()
    driver.reset(1, scene())
    tracks = np.zeros((3, 1, 13))
    tracks[1, 0, :6] = 2.0, 30.0, 4.0, math.pi / 2.0, 0.0, 8.0
    acceleration, curvature = driver.act(seen(time=0.05, tracks=tracks))
    assert (acceleration, curvature) == ([1.0], [0.0])
    assert [topic for topic, _ in stack.heard] == [
        "/bridgegen/reset", "/bridgegen/target_speed", "/bridgegen/stop_distance",
        "/bridgegen/route", "/bridgegen/tracks", "/bridgegen/ego", "/clock", "/bridgegen/command",
    ]  # fmt: skip
    ego, track = stack.last("/bridgegen/ego"), stack.last("/bridgegen/tracks")
    assert (ego.pose.pose.position.x, ego.pose.pose.position.y) == (1.0, 1.0)
    assert 2.0 * math.atan2(ego.pose.pose.orientation.z, ego.pose.pose.orientation.w) == 1.0
    assert track.child_frame_id == "bv"
    assert (track.pose.pose.position.x, track.pose.pose.position.y) == (30.0, 4.0)
    assert track.twist.twist.linear.x == pytest.approx(8.0)
    assert track.twist.twist.linear.y == pytest.approx(0.0)
    assert len(stack.last("/bridgegen/route").poses) == 40


@pytest.mark.parametrize(("state", "far"), [(1, 9.0), (2, 9.0), (3, 9.0), (4, math.inf)])
def test_a_stop_line_is_told_unless_its_light_is_green(stack, bridge, state, far):
    driver = bridge.Ros2Driver()
    driver.reset(1, scene())
    driver.act(seen(stop_distance=np.full(3, 9.0), light=np.full(3, state, np.int8)))
    assert stack.last("/bridgegen/stop_distance").data == far


def test_the_clock_never_goes_back(stack, bridge):
    driver = bridge.Ros2Driver()
    for _ in range(2):
        driver.reset(1, scene())
        for k in range(3):
            driver.act(seen(time=0.05 * k))
    times = [m.clock.sec + 1e-9 * m.clock.nanosec for topic, m in stack.heard if topic == "/clock"]
    assert times == pytest.approx([1.0, 1.05, 1.1, 2.1, 2.15, 2.2])


def test_a_stack_that_says_nothing_is_an_error(stack, bridge, monkeypatch):
    monkeypatch.setattr(bridge, "ANSWER", 0.0)
    driver = bridge.Ros2Driver()
    driver.reset(1, scene())
    stack.is_mute = True
    with refuses(TimeoutError):
        driver.act(seen())


def test_a_stack_drives_as_the_same_law_in_python(bridge, tmp_path):
    address = f"unix:{tmp_path / 'socket'}"
    threading.Thread(target=serve, args=(bridge.Ros2Driver, address), daemon=True).start()
    logical = load("crossroads-s1")
    drivers = TESTS / "ego" / "drivers.py"
    here, there = (
        Pipeline(logical, logical.space(), PipelineOptions(ego=ego))
        for ego in (f"{drivers}:Cruises", address)
    )
    X = here.space.decode(np.random.default_rng(4).random((2, here.space.n_var)))
    one, two = here.rollout(X), there.rollout(X)
    assert (two.status == 0).all()
    np.testing.assert_allclose(two.x, one.x, atol=1e-4)  # commands have single precision
