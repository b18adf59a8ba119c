"""What CARLA notices, in a rollout's incidents."""

from dataclasses import replace

import numpy as np

from bridgegen.adapters.carla.simulator import red_lights
from bridgegen.assess import metrics
from bridgegen.openx.openscenario.read import read
from bridgegen.simulation.choice import SimulatorChoice

from ..embedded.storyboards import after, crossroads, events, lane, lateral, scenario, start


def hit(pipeline):
    """Return a row in which the ego hits somebody."""
    X = pipeline.space.decode(np.random.default_rng(0).random((200, pipeline.space.n_var)))
    rollout = pipeline.runner.embedded.run(
        pipeline.runner.roads_of(X)[0].network, pipeline.runner.roads_of(X)[1],
        {name: X[:, i] for i, name in enumerate(pipeline.space.names)},
    )  # fmt: skip
    contacts = metrics.evaluate(rollout, ("n_collision",))[:, 0]
    return X[np.argmax(contacts > 0)][np.newaxis]


def test_a_contact_is_told_once_with_its_time_and_whom(made, machine):
    pipeline = made("crossroads-s4", "route-follower", ego="kinematic")
    rollout = pipeline.rollout(hit(pipeline))
    (incidents,) = rollout.incidents.values()
    contacts = [one for one in incidents if one.kind == "collision"]
    assert [one.what for one in contacts] == ["bv"]
    first = int(np.argmax(rollout.distance[0, 1] == 0.0))
    assert abs(contacts[0].step - first) <= 8  # the models are larger than the scenario's boxes


def test_red_lights_are_those_of_the_metric(made, machine):
    """With all lights red, as the embedded simulator's metric counts them."""
    pipeline = made("red-light-runner", "route-follower", ego="kinematic")
    X = pipeline.space.decode(np.random.default_rng(3).random((1, pipeline.space.n_var)))
    rollout = pipeline.rollout(X)
    assert red_lights(rollout) == []
    red = replace(rollout, lights=np.ones_like(rollout.lights))
    told = red_lights(red)
    counted = metrics.evaluate(red, ("r_red",))[0, 0]
    assert len({one.what for one in told}) == counted == 1.0
    front = rollout.box[0, 2] + 0.5 * rollout.box[0, 0]
    x, y, h = (one[0, 0, told[0].step] for one in (rollout.x, rollout.y, rollout.h))
    spot = np.array([x + front * np.cos(h), y + front * np.sin(h)])
    assert np.hypot(*(spot - rollout.stop_lines[0, 0, :2])) < 1.0


def test_a_change_of_lanes_invades_one(machine):
    """The storyboard moves the ego one lane to the right."""
    text = scenario(
        ("ego",), start("ego", lane(1, 1, 90.0), 8.0),
        events(("change", "ego", lateral(1, "sinusoidal time 3", "ego"), after(1.0))),
    )  # fmt: skip
    chosen = SimulatorChoice("carla", {}, {"--port": machine.port})
    simulator = chosen.simulator(read(text.encode(), "x.xosc"), "x.xosc")
    rollout = simulator.run(simulator.roads([crossroads()]), np.array([0]), {})
    assert rollout.status[0] == 0
    (told,) = rollout.incidents[0]
    assert told.kind == "lane invasion"
    assert abs(told.step - (1.0 + 1.5) / 0.05) < 6  # half-way, in the middle of the change
