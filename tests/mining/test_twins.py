"""Recorded events beside their parameterised twins: which verdicts change, and by what."""

from collections import Counter
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from tests.mining.events.simulated import located, recorded, simulated

from bridgegen.recordings.events.find import find_events
from bridgegen.recordings.events.scene import Scene
from bridgegen.recordings.twins import compare, met_of
from bridgegen.scenario.language.reader import load

ROWS, DRIVER = 60, "un-r157"


def moved(rollout, other, along=None, across=None):
    """The rollout with another's motion changed by a function of the time since its event [s]."""
    e, n = rollout.names.index(other), rollout.x.shape[2]
    x, y, v = rollout.x.copy(), rollout.y.copy(), rollout.v.copy()
    for row in range(len(x)):
        u = (np.arange(n) - rollout.began[row, 0]) * rollout.time_step
        if along is not None:
            x[row, e] = np.maximum.accumulate(x[row, e] + along(u))
            v[row, e] = np.gradient(x[row, e], rollout.time_step)
        if across is not None:
            y[row, e] += across(u)
    return replace(rollout, x=x, y=y, v=v)


def met(name, rollout, lanes):
    traffic, where = located(recorded(rollout, range(len(rollout.x))), lanes)
    scenario, left_out = load(name), Counter()
    (events,) = (
        kind for kind in find_events(traffic, where).kinds
        if kind.kind.name == scenario.recorded.event
    )  # fmt: skip
    return met_of(scenario, Scene(traffic, where), events, left_out), left_out


@lru_cache
def agreement(name, ego, change, drivers=(DRIVER,)):
    _, _, rollout, lanes = simulated(name, ROWS, ego)
    changed = CHANGES[change]
    events, left_out = met(name, moved(rollout, *changed) if changed else rollout, lanes)
    return compare(load(name), events, drivers, "simulated", left_out)


def pulling_away(u):
    """It accelerates by 2 m/s² from 1.2 s before the lane change on, for 5 s."""
    t = np.clip(u + 1.2, 0.0, 5.0)
    return t * t + 10.0 * np.maximum(u - 3.8, 0.0)


def late_braking(u):
    """It brakes by 6 m/s² for 2 s, a second after the lane change began."""
    t = np.clip(u - 1.0, 0.0, 2.0)
    return -3.0 * t * t - 12.0 * np.maximum(u - 3.0, 0.0)


CHANGES = {"none": None, "pulling away": ("bv", pulling_away), "late braking": ("bv", late_braking)}


def test_the_parameterised_form_itself_agrees_with_its_twin():
    found = agreement("cut-in", DRIVER, "none")
    assert found.events >= 50
    assert found.pooled("contact").both >= 10
    for verdict in ("failure", "contact", "collision course"):
        assert (found.pooled(verdict).replay, found.pooled(verdict).twin) == (0, 0)
    assert found.figures() | {"f1": 1.0, "changed": 0.0, "costs_most": None} == found.figures()
    assert "changes none of the verdicts" in found.figures()["says"]


def test_an_acceleration_that_no_parameter_has_is_named():
    figures = agreement("cut-in", DRIVER, "pulling away").figures()
    assert figures["events"] >= 40
    assert figures["changed"] > 0.1
    assert figures["recall"] == 1.0  # who pulls away is less of a danger than its twin
    assert figures["precision"] < 0.7
    assert figures["costs_most"] == "initial acceleration"
    assert figures["changed_with_it"] < 0.3 * figures["changed"]
    assert "Leaving out the initial acceleration costs most" in figures["says"]


def test_hard_braking_after_the_begin_is_named():
    figures = agreement("cut-in", DRIVER, "late braking").figures()
    assert figures["changed"] > 0.1
    assert figures["costs_most"] == "shape of braking"


@pytest.mark.parametrize(
    ("name", "ego"), [("cut-out", "route-follower"), ("lead-brakes", "route-follower")]
)
def test_other_events_agree_with_their_twins(name, ego):
    figures = agreement(name, ego, "none").figures()
    assert figures["events"] >= 40
    assert figures["f1"] > 0.9
    assert figures["changed"] < 0.1  # at the edge of a collision course
