"""Attentive participants at junctions: they give way as the map's rules have it."""

import numpy as np
import pytest

from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.adversary import with_others
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.boxes import box_distance

from .storyboards import lane, run, scenario, start

AWAY = start("ego", lane(4, -1, 99.0), 0.0)


def coming(name, leg, to, s, speed):
    return start(name, lane(leg, 1, s), speed, lane(leg, 1, s), lane(to, -1, 90.0))


def meet(*participants):
    names = ("ego", *(one[0] for one in participants))
    text = scenario(names, AWAY + "".join(coming(*one) for one in participants))
    return run(text, None, others="scripted"), run(text, None, others="attentive")


def slowed(scripted, attentive):
    return {
        name: bool(np.any(attentive.v[0, e] < scripted.v[0, e] - 0.1))
        for e, name in enumerate(attentive.names)
    }


@pytest.mark.parametrize(("leg", "to", "right", "right_to"), [(3, 1, 2, 4), (3, 1, 4, 2)])
def test_one_of_two_that_cross_gives_way_and_they_do_not_meet(leg, to, right, right_to):
    scripted, attentive = meet(("one", leg, to, 40.0, 9.0), ("two", right, right_to, 40.0, 9.0))
    assert gap(scripted) == 0.0
    assert gap(attentive) > 0.3
    found = slowed(scripted, attentive)
    assert sorted((found["one"], found["two"])) == [False, True]


def test_the_one_from_the_left_waits():
    # The rule of the right, StVO § 8: whose heading is a quarter turn to the left of the other's
    # heading is the one that comes from the right.
    scripted, attentive = meet(("one", 3, 1, 40.0, 9.0), ("two", 2, 4, 40.0, 9.0))
    turn = np.angle(np.exp(1j * (scripted.h[0, 2, 0] - scripted.h[0, 1, 0])))
    from_the_right = "two" if turn > 0.0 else "one"
    assert not slowed(scripted, attentive)[from_the_right]


def test_who_turns_left_waits_for_who_comes_towards():
    left = meet(("one", 3, 1, 40.0, 9.0), ("two", 1, 2, 40.0, 9.0))
    assert left[0].h[0, 2, -1] - left[0].h[0, 2, 0] > 1.0
    assert gap(left[0]) == 0.0
    assert gap(left[1]) > 0.3
    assert slowed(*left) == {"ego": False, "one": False, "two": True}


def test_it_stops_at_a_red_light():
    scenario_ = with_others(load("red-light-runner"), "attentive")
    space = scenario_.space()
    pipeline = Pipeline(scenario_, space, PipelineOptions(ego="route-follower"))
    X = space.decode(np.random.default_rng(0).random((30, space.n_var)))
    rollout = pipeline.rollout(X)
    scripted = Pipeline(
        with_others(scenario_, "scripted"), space, PipelineOptions(ego="route-follower")
    ).rollout(X)
    (line,) = np.flatnonzero(rollout.stop_entities == 1)
    x, y, h = rollout.stop_lines[:, line].T
    light = rollout.stop_lights[line]

    def ahead_of_line(one):
        ahead = (one.x[:, 1] - x[:, None]) * np.cos(h)[:, None]
        ahead += (one.y[:, 1] - y[:, None]) * np.sin(h)[:, None]
        return ahead + one.box[1, 2] + 0.5 * one.box[1, 0]

    def passes_at_red(one):
        reached = ahead_of_line(one) > 0.0
        at = np.argmax(reached, axis=1)
        red = one.lights[np.arange(len(X)), light, at] == 1
        return red & reached.any(axis=1)

    v, room = rollout.v[:, 1, 0], -ahead_of_line(rollout)[:, 0]
    may_stop = room - v * (0.75 + 0.2) > v**2 / (2.0 * 3.0)  # reaction, and until it looks
    assert (passes_at_red(scripted) & may_stop).sum() > 3
    assert not (passes_at_red(rollout) & may_stop).any()


def gap(rollout):
    two = [1, 2]
    distance = box_distance(
        rollout.box[two], rollout.x[:, two], rollout.y[:, two], rollout.h[:, two], rollout.n_steps
    )
    return float(distance[0, 1].min())
