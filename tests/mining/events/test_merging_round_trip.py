"""Mergings of simulated scenarios come back, with their parameters, from their traffic.

Where paths join is worked out from the simulation by itself, by the distances of all pieces.
"""

import numpy as np
import pytest
from tests.mining.events.simulated import compare, observed, simulated
from tests.mining.events.truth import at_time, centres, encounter, some_rows

from bridgegen.assess.metrics.times import pet

pytestmark = pytest.mark.thorough

NEAR, SHARED = 2.0, 10.0  # m
BARELY = (1.0, 11.0)  # m; rows in which the shared part is as short are left out


def distances(points, line):
    """Distance of each point from a line."""
    a, u = line[:-1], np.diff(line, axis=0)
    away = points[:, None] - a
    share = np.clip((away * u).sum(axis=2) / np.maximum((u * u).sum(axis=1), 1e-12), 0.0, 1.0)
    return np.linalg.norm(away - share[..., None] * u, axis=2).min(axis=1)


def joins_at(line, times, other, shared):
    """When a path first comes near another one for some metres; NaN if it never does."""
    apart = distances(line, other)
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
    for i in np.flatnonzero((apart[:-1] > NEAR) & (apart[1:] <= NEAR)):
        onward = np.flatnonzero(apart[i + 1 :] > NEAR)
        last = i + int(onward[0]) if len(onward) else len(way) - 1
        if way[last] - way[i] >= shared:
            share = (apart[i] - NEAR) / (apart[i] - apart[i + 1])
            return times[i] + share * (times[i + 1] - times[i])
    return np.nan


def paths_join(rollout, row, other, shared=SHARED):
    (ax, ay, at), (bx, by, bt) = (centres(rollout, row, e) for e in (0, other))
    a, b = np.column_stack([ax, ay]), np.column_stack([bx, by])
    return joins_at(a, at, b, shared), joins_at(b, bt, a, shared)


def barely_join(rollout, row, other):
    short, long = (paths_join(rollout, row, other, one) for one in BARELY)
    return bool(np.isfinite(short).all() != np.isfinite(long).all())


def crosses_line(rollout, row, other):
    """When the centre of the other is over the line to the ego's lane, and the ego beside it."""
    (ax, ay, at), (bx, by, bt) = (centres(rollout, row, e) for e in (0, other))
    line = 0.5 * (ay[0] + by[np.argmin(np.abs(bx - 70.0))])  # on the acceleration lane
    over = np.flatnonzero(by >= line)
    if not len(over):
        return np.nan, np.nan
    time = np.interp(line, by[over[0] - 1 : over[0] + 1], bt[over[0] - 1 : over[0] + 1])
    return np.interp(np.interp(time, bt, bx), ax, at, right=np.nan), time


def around(rollout, field, e, time, half):
    return np.mean([at_time(rollout, field, e, time + one)
                    for one in np.linspace(-half, half, 41)], axis=0)  # fmt: skip


def motorway(P, rollout, passes, begin):
    """The scenario as if the merging car sped up after 2 s."""
    later = 2.0 - P["bv_time"]
    moved = {"ego_start": P["ego_start"] + later * P["ego_speed"],
             "bv_start": P["bv_start"] + later * P["ramp_speed"]}  # fmt: skip
    behind = passes[1] < passes[0]
    return behind, P | moved


def roundabout(P, rollout, passes, begin):
    """The other's speed at the beginning of the event, and where it would have been at first.

    It had not entered then, and the event begins in the first 6 s.
    """
    e = rollout.names.index("bv")
    speed = around(rollout, "v", e, begin, 0.5)
    way = np.array([rollout.v[i, e, : int(one / rollout.time_step)].sum() * rollout.time_step
                    for i, one in enumerate(np.nan_to_num(begin))])  # fmt: skip
    happens = {"bv_speed": speed, "bv_start": P["bv_start"] + begin * speed - way,
               "ring_speed": around(rollout, "v", e, passes[1], 1.0)}  # fmt: skip
    outside = (happens["bv_start"] > 1.0) & (begin < 5.8)
    return outside, P | happens


def stood(P, rollout, passes, begin):
    surely, _, happens = encounter(53.91)(P, rollout, passes, "bv")
    return surely, happens


CASES = {
    "motorway-merge": (120, crosses_line, lambda *_: False, motorway),
    "roundabout-entry": (110, paths_join, barely_join, roundabout),
    "crossroads-s4": (900, paths_join, barely_join, stood),
}


def round_trip(name, noise, dropped, most):
    """Return what became of the events of some rows of a scenario."""
    count, joined, barely, what = CASES[name]
    scenario, P, rollout, lanes = simulated(name, count, "route-follower")
    e = rollout.names.index("bv")
    passes = np.array([joined(rollout, row, e) for row in range(count)]).T
    gap, first, closest = np.abs(passes[0] - passes[1]), passes.min(axis=0), pet(rollout)
    begin = np.maximum(first - 6.0, 0.0)
    counts, P = what(P, rollout, passes, begin)
    surely = counts & (gap < 5.9) & (first > 1.2) & (closest > 0.2)
    maybe = (gap < 6.1) & (first > 0.8)
    rows = some_rows(surely, maybe, most)
    rows = np.array([row for row in rows if not barely(rollout, row, e)])
    recordings = observed(rollout, rows, lanes, noise, dropped)
    return compare(scenario, P, rows, surely, maybe, recordings)


@pytest.mark.parametrize("name", CASES)
def test_parameters_come_back(name):
    found = round_trip(name, 0.0, 0.0, 40)
    assert len(found.found) >= 25
    assert min(found.precision, found.recall) >= 0.99
    for key, error in found.errors().items():
        assert len(error) >= 0.8 * len(found.found)
        # of a small change of speed, the acceleration is never at its full rate for long
        most = 0.04 if key == "bv_acceleration" else 0.01
        assert np.quantile(error, 0.95) <= most, key


@pytest.mark.parametrize("name", CASES)
def test_parameters_come_back_of_noisy_traffic_with_gaps(name):
    found = round_trip(name, 0.2, 0.05, 12)
    assert min(found.precision, found.recall) >= 0.95
    for key, error in found.errors().items():
        assert np.median(error) <= 0.05, key
