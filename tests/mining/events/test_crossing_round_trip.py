"""Crossing paths of simulated scenarios come back, with their parameters, from their traffic.

What happens is worked out from the simulation by itself: paths that cross by solving for all pairs
of their pieces, lines of sight by points on them.
"""

from dataclasses import replace

import numpy as np
import pytest
from tests.mining.events.simulated import compare, observed, simulated
from tests.mining.events.truth import at_time, crossing_of, encounter, some_rows

from bridgegen.assess.metrics.times import pet


def sees_through(rollout, other, van, last, lately):
    """Return in which rows a parked body is on the line of sight lately before an instant [s]."""
    found = np.zeros(len(last), bool)
    share = np.linspace(0.0, 1.0, 200)
    for back in np.arange(0.0, lately, 0.05):
        x, y, h = (at_time(rollout, f, 0, last - back) for f in ("x", "y", "h"))
        front = rollout.box[0, 2] + 0.5 * rollout.box[0, 0]
        ends = [(x + front * np.cos(h), at_time(rollout, "x", other, last - back)),
                (y + front * np.sin(h), at_time(rollout, "y", other, last - back))]  # fmt: skip
        px, py = (a[:, None] + share * (b - a)[:, None] for a, b in ends)
        length, width, ahead = rollout.box[van]  # along x, as the road
        found |= ((np.abs(px - rollout.x[:, van, :1] - ahead) < 0.5 * length)
                  & (np.abs(py - rollout.y[:, van, :1]) < 0.5 * width)).any(axis=1)  # fmt: skip
    return found


def behind_parked(P, rollout, passes, name):
    """The parked car behind the van may hide the pedestrian, too."""
    van, van_perhaps, parked = (
        sees_through(
            rollout, rollout.names.index(name), rollout.names.index(one), passes[1], lately
        )
        for one, lately in (("van", 1.9), ("van", 2.1), ("parked", 2.1))
    )
    return van, van_perhaps | parked, P


def hidden_car(P, rollout, passes, name):
    every = np.ones(len(passes[0]), bool)
    return every, every, P


def runs_red(P, rollout, passes, name):
    """Its light is red all the time. It changes pace by enough, and after it has begun."""
    e = rollout.names.index(name)
    assert (rollout.lights[:, rollout.light_names.index("403")] == 1).all()
    changes = rollout.v[:, e] != rollout.v[:, e, :1]
    go = changes.argmax(axis=1) * rollout.time_step
    much = changes.any(axis=1) & (np.abs(P["crossing_speed"] - P["runner_speed"]) > 0.7)
    surely = much & (go > 0.5) & (go < passes[1] - 1.0)
    return surely, np.ones(len(go), bool), P


CASES = {
    "crossroads-s1": (400, "bv", encounter(53.35)),
    "crossroads-s3": (220, "bv", encounter(48.23)),
    "left-across-path": (120, "bv", hidden_car),
    "pedestrian-behind-parked": (120, "walker", behind_parked),
    "pedestrian-at-night": (220, "walker", encounter(56.18, trigger="trigger",
                                                     speed="walker_speed")),
    "red-light-runner": (160, "runner", runs_red),
}  # fmt: skip
SMALL = {("red-light-runner", "trigger_distance"): 0.03}
"""Errors by reason of small changes of pace, which build up no full rate: their ramps begin less
than 0.3 s later."""
NOISY = ("crossroads-s1", "pedestrian-behind-parked", "red-light-runner")


def round_trip(name, noise, dropped, most, count=None, seed=1, observe=observed):
    """Return what became of the events of some rows of a scenario."""
    usual, other, what = CASES[name]
    count = count or usual
    scenario, P, rollout, lanes = simulated(name, count, "route-follower", seed)
    e = rollout.names.index(other)
    passes = np.array([crossing_of(rollout, row, e) for row in range(count)]).T
    surely, maybe, P = what(P, rollout, passes, other)
    gap, first = np.abs(passes[0] - passes[1]), passes.min(axis=0)
    closest = pet(rollout)
    surely = surely & (gap < 5.5) & (first > 1.3) & (closest > 0.2)
    maybe = maybe & (gap < 6.1) & (first > 0.7)
    if scenario.recorded.event == "vru-crossing":
        surely, maybe = (
            surely & (passes[1] < passes[0] - 0.1),
            maybe & (passes[1] < passes[0] + 0.1),
        )
    rows = some_rows(surely, maybe, most)
    until = np.where(np.isfinite(gap), passes.max(axis=0) + 3.0, 12.0) / rollout.time_step
    cut = replace(rollout, n_steps=np.minimum(rollout.n_steps, until.astype(int)))
    recordings = observe(cut, rows, lanes, noise, dropped)
    return compare(scenario, P, rows, surely, maybe, recordings, other)


@pytest.mark.parametrize("name", CASES)
def test_parameters_come_back(name):
    found = round_trip(name, 0.0, 0.0, 40)
    assert len(found.found) >= 30
    assert min(found.precision, found.recall) >= 0.99
    for key, error in found.errors().items():
        assert len(error) >= 0.8 * len(found.found)
        assert np.quantile(error, 0.95) <= SMALL.get((name, key), 0.01), key


@pytest.mark.parametrize("name", NOISY)
def test_parameters_come_back_of_noisy_traffic_with_gaps(name):
    found = round_trip(name, 0.2, 0.05, 20)
    assert min(found.precision, found.recall) >= 0.95
    for key, error in found.errors().items():
        assert np.median(error) <= 0.05, key
