"""Traffic participants of OSMP: a unit is built on the spot, and reads OSI by Google's library."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.approval import refuses
from tests.ego.remote.asked import observation as plain
from tests.ego.remote.asked import road_map, scene

from bridgegen.base.errors import InputError
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load

missing = any(importlib.util.find_spec(name) is None for name in ("fmpy", "pythonfmu"))
pytestmark = [pytest.mark.fmi, pytest.mark.skipif(missing, reason="the extra 'fmi' is missing")]
pytest.importorskip("google.protobuf")

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def unit(tmp_path_factory):
    """Builds a unit of ``osmp_unit``, with a text of it changed."""

    def build(old="", new=""):
        folder = tmp_path_factory.mktemp("unit")
        # Units in Python share one interpreter, and its modules.
        file = folder / f"{folder.name}.py"
        text = (Path(__file__).parent / "osmp_unit.py").read_text()
        assert old in text
        file.write_text(f"import sys; sys.path.insert(0, {str(ROOT)!r})\n{text.replace(old, new)}")
        command = [sys.executable, "-m", "pythonfmu", "build", "-f", file.name]
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        subprocess.run(command, cwd=folder, check=True, capture_output=True, env=environment)
        return folder / "Unit.fmu"

    return build


def driven(path, times=(0.0, 0.05)):
    """Drive three scenarios, of which the last one has ended, for two steps."""
    from bridgegen.drivers.fmu import fmu_driver

    driver = fmu_driver(path)
    driver.reset(3, scene(maps=(road_map(),), map_of=np.zeros(3, np.int64)))
    one = np.arange(3.0)
    track = np.array([2.0, 30.0, 5.0, 0.5, 1.0, 2.0, 4.0, 1.7, 1.0, 1.0, 0.0, 1.0, 4.0])
    return [
        driver.act(
            plain(
                running=(True, True, False), time=time, x=10.0 * one, y=one, h=0.1 * one,
                v=one + 2.0, target_speed=one + 9.0, tracks=np.tile(track, (3, 1, 1)),
            )
        )
        for time in times
    ]  # fmt: skip


def test_a_unit_is_given_what_osi_says(unit):
    path = unit()
    driven(path)
    seen = sys.modules[path.parent.name].SEEN
    assert len(seen) == 4
    view, command, lanes = seen[1]  # of the second scenario
    truth = view.global_ground_truth
    assert lanes == len(truth.lane) == 1
    assert len(truth.lane_boundary) == 2
    ego, other = truth.moving_object
    assert ego.id.value == truth.host_vehicle_id.value == view.host_vehicle_id.value
    # The box's centre is 1.4 m ahead of the rear axle's.
    assert ego.base.position.x == pytest.approx(10.0 + 1.4 * np.cos(0.1))
    assert ego.base.position.y == pytest.approx(1.0 + 1.4 * np.sin(0.1))
    assert ego.base.velocity.x == pytest.approx(3.0 * np.cos(0.1))
    assert (ego.base.dimension.length, ego.base.orientation.yaw) == (4.5, 0.1)
    assert (other.base.position.x, other.base.velocity.y) == (30.0, 2.0)
    assert other.base.dimension.width == 1.7
    path, speed = (one for action in command.action[::-1] for one in [action])
    assert speed.speed_action.absolute_target_speed == 10.0
    assert len(path.follow_path_action.path_point) == 40
    later, none, _ = seen[3]
    assert (later.timestamp.nanos, none) == (50_000_000, None)  # a command comes once a second


def test_its_update_is_the_plan_of_the_next_step(unit):
    (found, _) = driven(unit())
    assert found.time == [0.05]
    np.testing.assert_allclose(found.v[:2, 0], [2.05, 3.05])
    far = 3.025 * 0.05
    np.testing.assert_allclose(found.x[1], 10.0 + far * np.cos(0.1))
    np.testing.assert_allclose(found.y[1], 1.0 + far * np.sin(0.1))
    np.testing.assert_allclose(found.h[:2, 0], [0.0, 0.1])


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("if seen.id.value == me", "if False", "0 bytes"),
        ("self.update(seen, step).SerializeToString()", "b'\\x1a\\x7f'", "cut off"),
        ("own.CopyFrom(seen)", "own.CopyFrom(seen); own.id.value = 9", "id 1"),
        ('("OSMPSensorViewIn"', '("OSMPSensorDataIn"', "OSMPSensorViewIn"),
    ],
)
def test_a_unit_that_breaks_the_rules_is_one_clear_error(unit, old, new, message):
    with refuses(InputError, message):
        driven(unit(old, new))


def test_a_unit_drives_a_scenario_to_the_same_bits(unit):
    """It gains 1 m/s² up to the speed that it is told, and collides with the lead that brakes."""
    logical = load("lead-brakes")

    def rollout():
        pipeline = Pipeline(logical, logical.space(), PipelineOptions(ego=str(path)))
        return pipeline.rollout(pipeline.space.row({})[np.newaxis])

    path = unit()
    first, again = rollout(), rollout()
    assert first.status.tolist() == [0], first.messages
    for name in ("x", "y", "h", "v", "a"):
        np.testing.assert_array_equal(getattr(again, name), getattr(first, name))
