"""Scenarios of any number of actors: how a rollout's cost grows with them.

    .venv/bin/python benchmarks/traffic.py

The ego is in the middle lane of a motorway. The others drive at about its speed in all three lanes,
25 m apart, half of them behind it: the longer the column, the more of it is out of range.
"""

import tempfile
from functools import cache
from pathlib import Path

import numpy as np
from rates import Rate, rate_of

from bridgegen.assess import metrics
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.adversary import with_others
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.scenario import LogicalScenario

ALL = tuple(metrics.METRICS)

GAP = 25.0  # m, between two in a lane
LANES = 3
LENGTH = 4000.0  # m
KINDS = ("car", "van")

_HEAD = """
scenario: traffic
title: Traffic
description: The ego drives in the middle of a motorway's traffic.
source: Ours, to measure.
template: road
roads: {{lanes: 3, length: {length}, shoulder_width: 2.5, speed_limit: 36.1, road_type: motorway,
  closing_fog_density: 90.0, closing_precipitation: 95.0}}
duration: 20.0
time_step: 0.05
axes: [participants, weather]
include: [motorway, weather]
driver: reference
parameters:
  ego_speed: {{axis: participants, unit: m/s, low: 20.0, high: 30.0, default: 25.0,
    description: Speed at which the ego starts., source: Ours.}}
  flow: {{axis: participants, unit: m/s, low: 18.0, high: 28.0, default: 24.0,
    description: Speed of the others., source: Ours.}}
objective:
  terms: [{{metric: d_min, weight: 1.0}}]
  weights: fixed
  scale: raw
  critical: {{n_collision_above: 0, d_min_below: 1.0, v_d_at_least: 1.0}}
participants:
  ego:
    {{type: car, start: {{lane: 2, distance: {middle}}}, end: {{lane: 2, distance: {end}}},
    speed: ego_speed}}
"""


@cache
def traffic(actors: int) -> LogicalScenario:
    """Return a scenario of so many actors, the ego among them."""
    middle = 0.4 * LENGTH
    text = _HEAD.format(length=LENGTH, middle=middle, end=LENGTH - 20.0)
    for i in range(actors - 1):
        lane, place = i % LANES + 1, i // LANES
        away = GAP * (place // 2 + 1) * (1 if place % 2 else -1) + (8.0 * lane)
        text += (
            f"  actor_{i}:\n    {{type: {KINDS[i % 2]}, start: {{lane: {lane}, "
            f"distance: {middle + away}}}, speed: flow}}\n"
        )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "traffic.yaml"
        path.write_text(text, encoding="utf-8")
        return load(path)


def traffic_rate(
    actors: int, ego: str, rows: int, also: tuple[str, ...] = (), others: str = "scripted"
) -> Rate:
    """Return how fast scenarios of so many actors are evaluated, with more metrics or the usual."""
    scenario = with_others(traffic(actors), others)
    space = scenario.space()
    pipeline = Pipeline(scenario, space, PipelineOptions(ego=ego, metrics=also))
    pipeline.choose_objective()
    X = space.decode(np.random.default_rng(0).random((rows, space.n_var)))
    return rate_of(pipeline, X)


if __name__ == "__main__":
    for number in (2, 4, 8, 15, 30, 60, 120):
        rows = max(4, 2000 // number)
        for ego, others in (
            ("route-follower", "scripted"), ("route-follower", "attentive"),
            ("reference", "scripted"),
        ):  # fmt: skip
            rate = traffic_rate(number, ego, rows, ALL if ego == "reference" else (), others)
            print(
                f"{number:>4} actors, {ego:<14} others {others:<9} "
                f"{rate.per_second:>8,.0f} scenarios/s, "
                f"{1e6 * rate.cpu_seconds:>8,.0f} µs of CPU each, "
                f"{1e6 * rate.cpu_seconds / number:>6,.0f} µs an actor"
            )
