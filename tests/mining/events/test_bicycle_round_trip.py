"""Simulated bicycles on a right turn, or swinging out, come back with their parameters."""

import numpy as np
import pytest
from tests.mining.events.simulated import compare, observed, simulated
from tests.mining.events.truth import at_time, crossing_of, some_rows

from bridgegen.assess.metrics.times import pet

FEW = 5
"""Changes of pace that are recorded from before."""


def first(holds):
    """Number of the first step at which something holds, by row; -1 if it never does."""
    return np.where(holds.any(axis=1), holds.argmax(axis=1), -1)


def swings_out(P, rollout):
    """It has swung out by 3 s later; the ego comes within 6 s."""
    e, van = (rollout.names.index(name) for name in ("cyclist", "van"))
    apart = np.hypot(rollout.x[:, van] - rollout.x[:, e], rollout.y[:, van] - rollout.y[:, e])
    begin = first(apart <= P["swings_before"][:, None])
    rows = np.arange(len(begin))
    gap = (rollout.x[rows, e, begin] + 0.5) - (rollout.x[rows, 0, begin] + 1.4) - 0.5 * (4.6 + 1.8)
    time = gap / P["ego_speed"]
    recorded = (begin > 100) & (begin < rollout.n_steps - 400)
    surely = recorded & (gap > 0.3) & (time < 5.8)
    maybe = (begin > 0) & (gap > -0.3) & (time < 6.2)
    return surely, maybe, P


def turns_right(P, rollout):
    """Speeds are averaged over 0.5 s; where it changes pace, the ego is so near."""
    e, count = rollout.names.index("cyclist"), len(rollout.x)
    passes = np.array([crossing_of(rollout, row, e) for row in range(count)]).T
    gap, soonest = np.abs(passes[0] - passes[1]), passes.min(axis=0)
    begin = np.maximum(soonest - 6.0, 0.0)
    at_begin = np.mean([at_time(rollout, "v", e, one)
                        for one in np.linspace(np.maximum(begin - 0.5, 0.0), begin + 0.5, 41)],
                       axis=0)  # fmt: skip
    at_point = np.mean([at_time(rollout, "v", e, passes[1] + one)
                        for one in np.linspace(-1.0, 1.0, 41)], axis=0)  # fmt: skip
    go = first(rollout.v[:, e] != rollout.v[:, e, :1]) * rollout.time_step
    near = np.where(go > 1.0, P["trigger_distance"], np.nan)
    happens = {"cyclist_speed": at_begin, "later_speed": at_point, "trigger_distance": near}
    ends = rollout.n_steps * rollout.time_step
    surely = (
        (gap < 5.9) & (soonest > 1.2) & (pet(rollout) > 0.2) & (passes.max(axis=0) < ends - 0.3)
    )
    return surely, (gap < 6.1) & (soonest > 0.8), P | happens


CASES = {"cyclist-swings-out": (130, swings_out), "cyclist-right-turn": (260, turns_right)}


def round_trip(name, noise, dropped, most):
    """Return what became of the events of some rows of a scenario."""
    count, what = CASES[name]
    scenario, P, rollout, lanes = simulated(name, count, "route-follower")
    surely, maybe, P = what(P, rollout)
    rows = some_rows(surely, maybe, most)
    recordings = observed(rollout, rows, lanes, noise, dropped)
    return compare(scenario, P, rows, surely, maybe, recordings)


@pytest.mark.parametrize("name", CASES)
def test_parameters_come_back(name):
    found = round_trip(name, 0.0, 0.0, 50)
    assert len(found.found) >= 30
    assert min(found.precision, found.recall) >= 0.99
    for key, error in found.errors().items():
        assert len(error) >= (FEW if key == "trigger_distance" else 0.99 * len(found.found)), key
        # the ramp that is fitted to a change of pace begins a/(2·j) = 0.1 s later
        most = 0.1 if key == "trigger_distance" else 0.01
        assert np.quantile(error, 0.95) <= most, key


@pytest.mark.parametrize("name", CASES)
def test_parameters_come_back_of_noisy_traffic_with_gaps(name):
    found = round_trip(name, 0.2, 0.05, 20)
    assert min(found.precision, found.recall) >= 0.95
    for key, error in found.errors().items():
        if len(error) >= FEW:
            assert np.median(error) <= 0.05, key
