"""The reference goes round a car that has broken down, on a road with two lanes."""

from pathlib import Path

import numpy as np
import pytest

from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.rollout import Rollout

SCENARIO = """
scenario: broken-down
title: Broken-down car
description: A car has broken down in the ego's lane; another drives on the lane beside.
source: NHTSA, Pre-Crash Scenario Typology (DOT HS 810 767, 2007), lead vehicle stopped.
template: road
roads: {lanes: 2, length: 500.0, speed_limit: 16.0, road_type: town, lane_width: 3.5}
duration: 30.0 # s
time_step: 0.05 # s
axes: [participants, weather]
include: [weather]
driver: reference
participants:
  ego:
    type: car
    start: {lane: 2, distance: 40.0}
    end: {lane: 2, distance: 490.0}
    speed: ego_speed
  broken:
    type: car
    start: {lane: 2, distance: 200.0}
  other:
    type: car
    start: {lane: 1, distance: other_at}
    speed: other_speed
parameters:
  ego_speed: {axis: participants, unit: m/s, low: 5.0, high: 15.0, default: 13.0,
    description: The ego's, source: Ours.}
  other_at: {axis: participants, unit: m, low: 0.0, high: 300.0, default: 250.0,
    description: Where the other is, source: Ours.}
  other_speed: {axis: participants, unit: m/s, low: 0.0, high: 15.0, default: 13.0,
    description: The other's, source: Ours.}
objective:
  terms: [{metric: d_min, weight: 0.8297}, {metric: v_d, weight: 0.1703}]
  weights: fixed
  scale: raw
  critical: {n_collision_above: 0, d_min_below: 0.5, v_d_at_least: 1.0}
"""

LANE = 3.5
ROWS = {
    "free": {},
    "other beside": {"other_at": 25.0},
    "other stands beside": {"other_at": 195.0, "other_speed": 0.0},
    "slow": {"ego_speed": 8.0},
}


@pytest.fixture(scope="module")
def rollout(tmp_path_factory: pytest.TempPathFactory) -> Rollout:
    path: Path = tmp_path_factory.mktemp("broken-down") / "broken-down.yaml"
    path.write_text(SCENARIO)
    scenario = load(path)
    space = scenario.space()
    pipeline = Pipeline(scenario, space)
    return pipeline.rollout(np.array([space.row(values) for values in ROWS.values()]))


def of(rollout: Rollout, name: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the ego's x, speed and offset from its route in a row."""
    row = list(ROWS).index(name)
    assert rollout.status[row] == 0
    steps = slice(0, rollout.n_steps[row])
    return rollout.x[row, 0, steps], rollout.v[row, 0, steps], rollout.offset[row, 0, steps]


@pytest.mark.parametrize("name", ["free", "other beside", "slow"])
def test_it_passes_on_the_other_lane_and_comes_back(rollout: Rollout, name: str) -> None:
    x, v, offset = of(rollout, name)
    row = list(ROWS).index(name)
    assert rollout.distance[row, 1:, : len(x)].min() > 1.0
    assert x[-1] > 210.0
    beside = offset > 0.5 * LANE
    assert np.diff(beside).sum() == 2
    assert (np.abs(offset[(x > 194.0) & (x < 206.0)] - LANE) < 0.5).all()  # body beside body
    assert offset.min() > -0.3
    assert offset.max() < LANE + 0.3
    assert abs(offset[-1]) < 0.3
    across = np.diff(offset) / rollout.time_step
    assert np.abs(across).max() < 2.0  # m/s; 15/8 · 3.5 m in 4.1 s is 1.6
    assert v.min() > 2.0  # it need not stop


def test_it_lets_pass_who_comes_from_behind(rollout: Rollout) -> None:
    x, _, offset = of(rollout, "other beside")
    out = int(np.argmax(offset > 0.5 * LANE))
    assert rollout.x[list(ROWS).index("other beside"), 2, out] > x[out] + 5.0


def test_it_stops_if_both_lanes_are_blocked(rollout: Rollout) -> None:
    x, v, offset = of(rollout, "other stands beside")
    assert v[-1] == 0.0
    assert np.abs(offset).max() < 0.3
    assert 180.0 < x[-1] < 194.0
