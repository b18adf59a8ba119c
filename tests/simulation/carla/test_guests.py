"""Egos that CARLA drives."""

import sys
import types

import carla
import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.adapters.carla import carla_drivers as guests
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.drivers import DRIVERS, GUESTS, get
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load

from . import stand_in
from .stand_in_actors import TrafficManager, Vehicle


def rows(pipeline, n=1):
    return pipeline.space.decode(np.random.default_rng(1).random((n, pipeline.space.n_var)))


def test_the_autopilot_goes_our_way(made, machine):
    pipeline = made("crossroads-s4", "carla-autopilot", seed=7)
    X = rows(pipeline, 2)
    rollout = pipeline.rollout(X)
    assert pipeline.runner.embedded.driver == "carla-autopilot"
    assert (rollout.status == 0).all()
    (manager,) = machine.managers.values()
    assert manager.seed == 7
    assert not manager.vehicles
    assert not manager.synchronous
    assert np.abs(rollout.offset[:, 0]).max() < 1.5
    n = int(rollout.n_steps[0])
    assert np.hypot(*(np.ptp(one[0, 0, :n]) for one in (rollout.x, rollout.y))) > 20.0
    again = pipeline.rollout(X)
    np.testing.assert_array_equal(again.x, rollout.x)


def test_the_oldest_traffic_manager_is_told_shares_of_the_limit(made, machine, monkeypatch):
    """At 8 m/s where 30 km/h are allowed: 4 % less."""
    told = []

    class Oldest(TrafficManager):
        def vehicle_percentage_speed_difference(self, actor, percentage):
            told.append(percentage)
            self.speeds[actor.id] = 30.0 / 3.6 * (1.0 - percentage / 100.0)

    monkeypatch.delattr(TrafficManager, "set_desired_speed")
    monkeypatch.setattr(stand_in, "TrafficManager", Oldest)
    monkeypatch.setattr(Vehicle, "get_speed_limit", lambda self: 30.0, raising=False)
    pipeline = made("crossroads-s1", "carla-autopilot")
    X = pipeline.space.row({"ego_speed": 8.0})[np.newaxis]
    rollout = pipeline.rollout(X)
    assert rollout.status[0] == 0
    assert told == [pytest.approx(4.0)]
    assert rollout.v[0, 0, 60] == pytest.approx(8.0, abs=0.6)


@pytest.fixture
def agents(monkeypatch):
    """A package like CARLA's: what is told to its agents is noted, and they follow the plan."""
    told = []

    class BasicAgent:
        def __init__(self, vehicle, target_speed=20, opt_dict=None, map_inst=None, grp_inst=None):
            self._vehicle, self._speed = vehicle, target_speed
            told.append(("made", type(self).__name__))

        def set_target_speed(self, speed):
            self._speed = speed
            told.append(("speed", speed))

        def set_global_plan(self, plan, stop_waypoint_creation=True, clean_queue=True):
            self._plan = plan
            told.append(("plan", plan))

        def run_step(self):
            from .stand_in_actors import _pursue

            velocity = self._vehicle.get_velocity()
            v = np.hypot(velocity.x, velocity.y)
            path = [(one.transform.location.x, one.transform.location.y) for one, _ in self._plan]
            return carla.VehicleControl(
                throttle=float(np.clip(0.3 * (self._speed / 3.6 - v), 0.0, 1.0)),
                steer=_pursue(self._vehicle, path, v),
            )

    class BehaviorAgent(BasicAgent):
        def __init__(self, vehicle, behavior="normal", opt_dict=None, map_inst=None, grp_inst=None):
            super().__init__(vehicle)
            told.append(("behavior", behavior))

    names = ("agents", "agents.navigation", "agents.navigation.basic_agent",
             "agents.navigation.behavior_agent", "agents.navigation.local_planner")  # fmt: skip
    modules = {name: types.ModuleType(name) for name in names}
    modules["agents.navigation.basic_agent"].BasicAgent = BasicAgent
    modules["agents.navigation.behavior_agent"].BehaviorAgent = BehaviorAgent
    modules["agents.navigation.local_planner"].RoadOption = types.SimpleNamespace(LANEFOLLOW=4)
    for name, module in modules.items():
        monkeypatch.setitem(sys.modules, name, module)
    return told


@pytest.mark.parametrize("agent", ["basic", "cautious"])
def test_an_agent_goes_our_way(made, machine, agents, agent):
    pipeline = made("crossroads-s1", "carla-agent", agent=agent)
    rollout = pipeline.rollout(rows(pipeline))
    assert (rollout.status == 0).all()
    assert ("made", "BasicAgent" if agent == "basic" else "BehaviorAgent") in agents
    assert agent == "basic" or ("behavior", agent) in agents
    assert next(one for name, one in agents if name == "speed") == pytest.approx(
        3.6 * float(rollout.v[0, 0, 0]), rel=0.5
    )
    (plan,) = [one for name, one in agents if name == "plan"]
    assert len(plan) > 20
    assert np.abs(rollout.offset[0, 0]).max() < 1.0


def test_without_the_agents_it_says_where_they_are(made, machine):
    pipeline = made("crossroads-s1", "carla-agent")
    with refuses(InputError, "agents"):
        pipeline.rollout(rows(pipeline))
    left = [one for one in machine.actors.values() if one.type_id != "traffic.traffic_light"]
    assert not left


def test_a_client_takes_the_ego_over(made, machine, monkeypatch):
    """It comes after 30 ticks; the scenario waits for it, and begins as it should."""
    tick, first = machine.tick, []

    def driven():
        found = [one for one in machine.actors.values()
                 if one.attributes.get("role_name") == "hero"]  # fmt: skip
        if found and machine.ticks > 60:
            first.append(machine.ticks)
            found[0].apply_control(carla.VehicleControl(throttle=0.4))
        return tick()

    monkeypatch.setattr(machine, "tick", driven)
    monkeypatch.setattr(guests, "TIME_STEP", 0.0)
    pipeline = made("crossroads-s1", "carla-external")
    X = rows(pipeline)
    rollout = pipeline.rollout(X)
    assert rollout.status[0] == 0
    assert first[0] == 61
    expected = embedded_start(X)
    np.testing.assert_allclose(rollout.x[0, 0, 0], expected.x[0, 0, 0], atol=1e-3)
    np.testing.assert_allclose(rollout.v[0, 0, 1], expected.v[0, 0, 0], atol=0.4)
    assert rollout.v[0, 0].max() > expected.v[0, 0, 0] + 0.5


def embedded_start(X):
    logical = load("crossroads-s1")
    return Pipeline(logical, logical.space(), PipelineOptions(ego="route-follower")).rollout(X)


def test_a_client_that_does_not_come_fails_the_row(made, machine, monkeypatch):
    monkeypatch.setattr(guests, "WAIT_SECONDS", 0.0)
    monkeypatch.setattr(guests, "TIME_STEP", 0.0)
    pipeline = made("crossroads-s1", "carla-external")
    rollout = pipeline.rollout(rows(pipeline))
    assert rollout.status[0] == 42
    approve(rollout.messages[0], "hero")


@pytest.mark.parametrize("name", GUESTS)
def test_they_drive_nowhere_else(name):
    logical = load("crossroads-s1")
    with refuses(InputError, name):
        Pipeline(logical, logical.space(), PipelineOptions(ego=name))


def test_they_are_not_offered_where_a_name_is_wrong():
    assert not GUESTS.keys() & DRIVERS.keys()
    with pytest.raises(UnknownNameError) as caught:
        get("carla-autopilott")
    assert "known" not in str(caught.value) or "carla-agent" not in str(caught.value)


def test_the_points_of_a_route_reach_its_end():
    way = np.column_stack((np.arange(0.0, 10.3, 0.5), np.zeros(21)))
    points = guests.spaced(way)
    assert points[0] == (0.0, 0.0)
    assert points[-1] == (10.0, 0.0)
    assert np.diff([x for x, _ in points]).min() >= 1.9
