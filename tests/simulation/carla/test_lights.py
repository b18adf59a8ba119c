"""CARLA's lights are found by where they are."""

import carla
import numpy as np
from tests.approval import refuses

from bridgegen.adapters.carla.lights import matched
from bridgegen.base.errors import InputError

WORDS = {0: "Off", 1: "Red", 2: "Red", 3: "Yellow", 4: "Green"}


def test_the_nearest_pairs_come_first_and_each_light_once():
    wanted = {"a": (0.0, 0.0), "b": (5.0, 0.0)}
    known = [[(4.0, 0.0)], [(100.0, 0.0), (-3.0, 0.0)]]
    assert matched(wanted, known) == {"b": 0, "a": 1}


def test_a_light_that_is_not_there_is_named():
    with refuses(InputError, "b", "50.0"):
        matched({"a": (0.0, 0.0), "b": (50.0, 0.0)}, [[(1.0, 0.0)]])


def test_they_show_what_the_storyboard_says(made, machine, monkeypatch):
    """At every tick, those that it drives; the others are out; all are frozen, and free again."""
    from bridgegen.adapters.carla import lights

    pipeline = made("red-light-runner", "route-follower", ego="kinematic")
    shown = []
    tick = machine.tick

    def looking():
        found = [one for one in machine.actors.values() if one.type_id == "traffic.traffic_light"]
        shown.append({one._landmark.id: one.state for one in found})
        assert found
        assert all(one.frozen for one in found)
        return tick()

    monkeypatch.setattr(machine, "tick", looking)
    rollout = pipeline.rollout(pipeline.space.row({})[np.newaxis])
    assert rollout.status[0] == 0
    n = int(rollout.n_steps[0])
    assert len(shown) == n - 1
    for i, name in enumerate(rollout.light_names):
        for k in range(n - 1):
            word = WORDS[int(rollout.lights[0, i, k])]
            assert shown[k][name] == getattr(carla.TrafficLightState, word)
    assert len({state for one in shown for state in one.values()}) >= 2
    others = shown[0].keys() - set(rollout.light_names)
    assert all(shown[5][name] == carla.TrafficLightState.Off for name in others)
    assert not any(getattr(one, "frozen", False) for one in machine.actors.values())
    assert lights.REACH < 20
