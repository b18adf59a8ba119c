"""The parameters of simulated scenarios come back from their traffic, whoever drives the ego."""

import numpy as np
import pytest
from tests.mining.events.simulated import located, recorded, simulated

from bridgegen.mining.events.find import find_events

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
    """The BV is ahead of the ego when it crosses the line."""
    along = np.sqrt(np.maximum(P["cut_in_distance"] ** 2 - P["lane_width"] ** 2, 0.0))
    begin = np.clip((P["gap"] - along) / np.maximum(P["speed_difference"], 1e-9), 0.0, 8.0)
    crossing = steps(rollout, begin + 0.5 * P["change_time"])
    gap = ahead(rollout, "bv", "ego")[np.arange(len(crossing)), crossing] - LENGTH
    at_begin = np.hypot(P["gap"] - P["speed_difference"] * begin, P["lane_width"])
    return gap > 0.5, gap > -0.5, P | {"cut_in_distance": at_begin}


def cut_out(P, rollout):
    """The lane change ends within the scenario's time."""
    begin = (P["stopped_distance"] - P["reveal_distance"]) / P["ego_speed"]
    end = begin + P["change_time"]
    return end < 19.9, end < 21.0, P


def lead_brakes(P, rollout):
    """The ego has not collided before the car ahead has braked."""
    end = P["brake_time"] + (P["ego_speed"] - P["low_speed"]) / P["deceleration"]
    gap = ahead(rollout, "lead", "ego") - LENGTH
    last = steps(rollout, end + 0.05)
    before = np.arange(gap.shape[1]) <= last[:, None]
    least = np.where(before, gap, np.inf).min(axis=1)
    return (least > 0.3) & (end < 19.0), least > -0.5, P


CASES = {
    "cut-in": ("un-r157", 230, cut_in), "cut-out": ("route-follower", 210, cut_out),
    "lead-brakes": ("route-follower", 320, lead_brakes),
}  # fmt: skip


def round_trip(name, noise, dropped):
    """Return precision, recall, how many rows count, and the errors as shares of the ranges."""
    ego, count, happens = CASES[name]
    scenario, P, rollout, lanes = simulated(name, count, ego)
    surely, maybe, P = happens(P, rollout)
    traffic, where = located(recorded(rollout, range(count), noise, dropped), lanes)
    found = next(
        one for one in find_events(traffic, where).kinds
        if one.kind.name == scenario.recorded.event
    )  # fmt: skip
    spec = scenario.recorded
    own = [traffic.names[e].split("#")[0].endswith(" ego") for e in found.ego]
    kept = spec.counts(found.quantities) & np.array(own)
    row = np.array([int(traffic.names[e].split()[0]) for e in found.ego])[kept]
    assert len(set(row)) == len(row)
    errors = {
        key: np.abs(value[kept] - P[key][row])
        / (scenario.parameters[key].high - scenario.parameters[key].low)
        for key, value in spec.values(found.quantities).items()
    }
    found_rows = np.isin(np.flatnonzero(surely), row)
    return maybe[row].mean(), found_rows.mean(), int(surely.sum()), errors


@pytest.mark.parametrize("name", CASES)
def test_parameters_come_back(name):
    precision, recall, count, errors = round_trip(name, 0.0, 0.0)
    assert count >= 200
    assert min(precision, recall) >= 0.99
    for key, error in errors.items():
        assert np.quantile(error, 0.98) <= 0.01, key
        assert error.max() <= 0.1, key


@pytest.mark.parametrize("name", CASES)
def test_parameters_come_back_of_noisy_traffic_with_gaps(name):
    precision, recall, _, errors = round_trip(name, 0.2, 0.05)
    assert min(precision, recall) >= 0.95
    for key, error in errors.items():
        assert np.median(error) <= 0.05, key
