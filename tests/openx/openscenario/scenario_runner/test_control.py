"""The controller that lies beside the files, with the wheel's types and a stand-in for the rest.

Its world moves vehicles by their velocities, as physics without friction does.
"""

import ast
import importlib.util
import math
import sys
from importlib.resources import files
from types import ModuleType, SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

carla = pytest.importorskip("carla")

STEP = 0.05


class BasicControl:
    """As ScenarioRunner's, what of it ours uses."""

    _waypoints: list = []  # noqa: RUF012
    _times: list = []  # noqa: RUF012
    _target_speed = 0
    _reached_goal = False
    _init_speed = False

    def __init__(self, actor):
        self._actor = actor

    def update_target_speed(self, speed):
        self._target_speed, self._init_speed = speed, False

    def update_waypoints(self, waypoints, start_time=None):
        self._waypoints = waypoints

    def set_init_speed(self):
        self._init_speed = True

    def check_reached_waypoint_goal(self):
        return self._reached_goal


class World:
    def __init__(self):
        self.time, self.said, self.weather = 0.0, [], carla.WeatherParameters(cloudiness=1.0)
        self.fixed = STEP

    def get_settings(self):
        return SimpleNamespace(fixed_delta_seconds=self.fixed)

    def freeze_all_traffic_lights(self, frozen):
        self.said.append(frozen)

    def get_weather(self):
        return self.weather

    def set_weather(self, weather):
        self.weather = weather
        self.said.append("weather")


class Body:
    is_alive = True

    def __init__(self, x=0.0, y=0.0, yaw=0.0):
        self.x, self.y, self.yaw, self.v, self.turn = x, y, yaw, carla.Vector3D(), 0.0

    def get_transform(self):
        return carla.Transform(carla.Location(self.x, self.y), carla.Rotation(yaw=self.yaw))

    def set_transform(self, there):
        self.x, self.y, self.yaw = there.location.x, there.location.y, there.rotation.yaw

    def get_velocity(self):
        return carla.Vector3D(0.0, 0.0, -0.5)

    def set_target_velocity(self, v):
        self.v = v

    def set_target_angular_velocity(self, w):
        self.turn = w.z

    def step(self, step):
        self.x, self.y = self.x + self.v.x * step, self.y + self.v.y * step
        self.yaw += self.turn * step


class Car(Body, carla.Vehicle):
    pass


class Walker(Body, carla.Walker):
    def get_control(self):
        return carla.WalkerControl()

    def apply_control(self, control):
        assert control.direction.length() == pytest.approx(1.0) or control.speed < 1e-3
        self.v = control.direction * control.speed


class Prop(Body):
    pass


def test_old_pythons_read_it():
    package = files("bridgegen.openx.openscenario.scenario_runner")
    ast.parse((package / "bridgegen_control.py").read_text(), feature_version=(3, 7))


@pytest.fixture(scope="module")
def module():
    """The module, loaded as ScenarioRunner does: by its file, beside what it imports."""
    world = World()
    stubs = {
        "srunner.scenariomanager.actorcontrols.basic_control": {"BasicControl": BasicControl},
        "srunner.scenariomanager.carla_data_provider": {
            "CarlaDataProvider": SimpleNamespace(get_world=lambda: stubs["world"])
        },
        "srunner.scenariomanager.timer": {
            "GameTime": SimpleNamespace(get_time=lambda: stubs["world"].time)
        },
        "world": world,
    }
    names = [name for name in stubs if name != "world"]
    for name in names:
        sys.modules[name] = ModuleType(name)
        sys.modules[name].__dict__.update(stubs[name])
    package = files("bridgegen.openx.openscenario.scenario_runner")
    spec = importlib.util.spec_from_file_location("c", str(package / "bridgegen_control.py"))
    made = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(made)
    made.stubs = stubs
    yield made
    for name in names:
        del sys.modules[name]


def runner(module, actor, args=None):
    """A controller in a world that begins now, and what goes on for a step."""
    world = module.stubs["world"] = World()
    control = module.BridgegenControl(actor, args)

    def step(length=STEP):
        world.time += length
        control.run_step()
        actor.step(length)

    return control, step, world


def transforms(course):
    return [carla.Transform(carla.Location(x, y), carla.Rotation(yaw=yaw)) for x, y, yaw in course]


def curve(k):
    """A turn to the right, ever faster."""
    a = 0.002 * k * k * STEP
    return 20.0 * math.sin(a), 20.0 * (1.0 - math.cos(a)), math.degrees(a)


@pytest.mark.parametrize("kind", [Car, Walker, Prop])
@pytest.mark.parametrize("times", [True, False])  # 0.9.15 does not pass them on
def test_it_is_at_each_time_where_the_trajectory_says(module, kind, times):
    course = [curve(k) for k in range(101)]
    control, step, _ = runner(module, actor := kind(), {"duration": str(100 * STEP)})
    control.update_waypoints(
        transforms(course), *([[k * STEP for k in range(101)]] if times else [])
    )
    for k in range(100):
        assert not control.check_reached_waypoint_goal()
        step()
        x, y, yaw = course[k + 1]
        assert math.dist((actor.x, actor.y), (x, y)) < 1e-3
        if kind is not Walker:  # who walks looks where they go
            assert actor.yaw == pytest.approx(yaw, abs=1e-2)
    step()
    assert control.check_reached_waypoint_goal()


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-170.0, 170.0))
def test_a_deviation_dies_away(module, x, y, yaw):
    control, step, _ = runner(module, actor := Car(x, y, yaw))
    control.update_waypoints(
        transforms([(0.5 * k, 0.0, 0.0) for k in range(41)]), [k * STEP for k in range(41)]
    )
    for _ in range(20):
        step()
    assert math.dist((actor.x, actor.y), (10.0, 0.0)) < 1e-3
    assert abs(actor.yaw) < 0.1


def test_who_is_pushed_is_let_go_until_the_end(module):
    control, step, _ = runner(module, actor := Car())
    control.update_waypoints(
        transforms([(0.5 * k, 0.0, 0.0) for k in range(41)]), [k * STEP for k in range(41)]
    )
    step()
    actor.y, actor.v = 5.0, carla.Vector3D(0.0, 7.0, 0.0)
    for _ in range(20):
        step()
    assert (actor.v.x, actor.v.y) == (0.0, 7.0)
    assert not control.check_reached_waypoint_goal()
    for _ in range(21):
        step()
    assert control.check_reached_waypoint_goal()


def test_falling_goes_on(module):
    control, step, _ = runner(module, actor := Car())
    control.update_waypoints(transforms([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)]), [0.0, 1.0])
    step()
    assert actor.v.z == -0.5


def test_two_vertices_hold_who_stands(module):
    control, step, _ = runner(module, actor := Car(3.0, 4.0, 90.0))
    control.update_waypoints(transforms([(3.0, 4.0, 90.0)] * 2), [0.0, 1.0])
    for _ in range(10):
        step()
    assert (actor.x, actor.y, actor.yaw) == (3.0, 4.0, 90.0)


def test_a_free_running_clock_is_followed(module):
    control, step, world = runner(module, actor := Car())
    world.fixed = None  # asynchronous: no step is like the other, the last is the best guess
    control.update_waypoints(
        transforms([(0.5 * k, 0.0, 0.0) for k in range(101)]), [k * STEP for k in range(101)]
    )
    for k in range(60):
        step(0.04 if k % 2 else 0.06)
        assert abs(actor.x - 10.0 * (world.time - 0.06 + (0.06 if k % 2 else 0.04))) < 0.5


def test_the_ego_is_pushed_once_and_left_alone(module):
    control, step, _ = runner(module, actor := Car(yaw=-90.0))
    control.update_target_speed(12.0)
    control.set_init_speed()
    step()
    assert (actor.v.x, actor.v.y) == (pytest.approx(0.0, abs=1e-5), pytest.approx(-12.0))
    actor.v = carla.Vector3D(1.0, 0.0, 0.0)
    for _ in range(5):
        step()
    assert actor.v.x == 1.0


def test_lights_stand_while_it_runs(module):
    control, step, world = runner(module, Car(), {"traffic_lights": "stand"})
    assert world.said == []
    step()
    step()
    assert world.said == [True]
    control.reset()
    assert world.said == [True, False]
    step()  # nothing more: it has no actor


def test_weather_replaces_scenario_runner_s_after_its_own(module):
    _, step, world = runner(module, Car(), {"weather.fog_density": "30", "module": "x"})
    step()
    assert world.said == []
    world.set_weather(carla.WeatherParameters(fog_density=100.0, wetness=7.0))
    step()
    step()
    assert world.said == ["weather", "weather"]
    assert (world.weather.fog_density, world.weather.wetness) == (30.0, 7.0)


def test_who_is_gone_is_left_alone(module):
    control, step, _ = runner(module, actor := Car())
    control.update_waypoints(transforms([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)]), [0.0, 1.0])
    actor.is_alive = False
    step()
    assert actor.v.x == 0.0
