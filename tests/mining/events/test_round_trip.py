"""The parameters of simulated scenarios come back from their traffic, whoever drives the ego."""

import numpy as np
import pytest
from tests.mining.events.simulated import compare, observed, simulated

pytestmark = pytest.mark.thorough

LENGTH = 4.6  # of a car


def ahead(rollout, one, other):
    """How far an entity's reference point is ahead of another's, along the other's heading."""
    e, o = rollout.names.index(one), rollout.names.index(other)
    dx, dy = rollout.x[:, e] - rollout.x[:, o], rollout.y[:, e] - rollout.y[:, o]
    return dx * np.cos(rollout.h[:, o]) + dy * np.sin(rollout.h[:, o])


def steps(rollout, time):
    return np.minimum(np.rint(time / rollout.time_step).astype(int), rollout.x.shape[2] - 1)


# Each returns the rows in which the event surely happens, those in which it may, and what happens.


def cut_in(P, rollout):
    """The BV is ahead of the ego when it crosses the line, and did not begin with the recording."""
    along = np.sqrt(np.maximum(P["cut_in_distance"] ** 2 - P["lane_width"] ** 2, 0.0))
    begin = np.clip((P["gap"] - along) / np.maximum(P["speed_difference"], 1e-9), 0.0, 8.0)
    crossing = steps(rollout, begin + 0.5 * P["change_time"])
    gap = ahead(rollout, "bv", "ego")[np.arange(len(crossing)), crossing] - LENGTH
    at_begin = np.hypot(P["gap"] - P["speed_difference"] * begin, P["lane_width"])
    return (gap > 0.5) & (begin > 0.2), gap > -0.5, P | {"cut_in_distance": at_begin}


def cut_out(P, rollout):
    """The lane change ends within the scenario's time."""
    begin = (P["stopped_distance"] - P["reveal_distance"]) / P["ego_speed"]
    end = begin + P["change_time"]
    return end < 19.9, end < 21.0, P


def lead_brakes(P, rollout):
    """The ego has not collided before the car ahead has braked."""
    end = P["brake_time"] + (P["ego_speed"] - P["low_speed"]) / P["deceleration"]
    released = P["deceleration"] / 12.65  # for how long brakes build up, and are let go again
    gap = ahead(rollout, "lead", "ego") - LENGTH
    last = steps(rollout, end + 0.05)
    before = np.arange(gap.shape[1]) <= last[:, None]
    least = np.where(before, gap, np.inf).min(axis=1)
    over = steps(rollout, end + released + 0.3)
    least_then = np.where(np.arange(gap.shape[1]) <= over[:, None], gap, np.inf).min(axis=1)
    return (least_then > 0.3) & (end + released < 19.0), least > -0.5, P


CASES = {
    "cut-in": ("un-r157", 350, cut_in), "cut-out": ("route-follower", 210, cut_out),
    "lead-brakes": ("route-follower", 400, lead_brakes),
}  # fmt: skip


def round_trip(name, noise, dropped, count=None, seed=1, observe=observed):
    """Return what became of the events of rows of a scenario."""
    ego, usual, happens = CASES[name]
    count = count or usual
    scenario, P, rollout, lanes = simulated(name, count, ego, seed)
    surely, maybe, P = happens(P, rollout)
    rows = np.arange(count)
    return compare(scenario, P, rows, surely, maybe, observe(rollout, rows, lanes, noise, dropped))


@pytest.mark.parametrize("name", CASES)
def test_parameters_come_back(name):
    found = round_trip(name, 0.0, 0.0)
    assert len(found.found) >= 200
    assert min(found.precision, found.recall) >= 0.99
    for key, error in found.errors().items():
        assert len(error) == len(found.true)
        # brakes that are let go before they are built up have no rate of their own
        small = key == "deceleration"
        assert np.quantile(error, 0.9 if small else 0.98) <= (0.1 if small else 0.01), key
        assert error.max() <= (0.4 if small else 0.1), key


@pytest.mark.parametrize("name", CASES)
def test_parameters_come_back_of_noisy_traffic_with_gaps(name):
    found = round_trip(name, 0.2, 0.05, count=120)
    assert min(found.precision, found.recall) >= 0.95
    for key, error in found.errors().items():
        assert np.median(error) <= 0.05, key
