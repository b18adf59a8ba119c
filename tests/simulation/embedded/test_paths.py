"""Vehicles off the lanes: on a smooth curve, by hand-worked numbers, and there and back again."""

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.assess.conflict.analysis import analyse
from bridgegen.assess.conflict.plausibility import plausibility
from bridgegen.assess.conflict.types import Rule
from bridgegen.base.errors import ScenarioError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.openx.openscenario.from_owl import openscenario_from_owl
from bridgegen.openx.openscenario.to_owl import individuals_from_openscenario
from bridgegen.openx.openscenario.write import to_xml
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.ontology.check import check

DRIVEWAY = """
scenario: driveway
title: A car leaves a driveway
description: It comes from the right.
source: ours
template: road
roads: {lanes: 1, lane_width: 4.0, sidewalk_width: 2.0, length: 300.0, speed_limit: 20}
duration: 12.0
time_step: 0.05
axes: [participants]
include: [weather]
driver: route-follower
participants:
  ego:
    type: car
    start: {distance: 20.0}
    end: {distance: 290.0}
    speed: 10.0
  bv:
    type: car
    path:
      - {distance: at, offset: -12.0}
      - {distance: at, offset: 0.0}
      - {distance: at, offset: 0.0}
      - {distance: onwards, offset: 0.0}
    speed: bv_speed
parameters:
  at: {axis: participants, unit: m, low: 40, high: 150, default: 100, description: W., source: o}
  bv_speed: {axis: participants, unit: m/s, low: 0, high: 5, default: 4, description: V., source: o}
derived:
  onwards: {axis: participants, unit: m, value: at + 12, why: T., source: o, description: T.}
"""


@pytest.fixture
def made(tmp_path):
    def make(*edits: tuple[str, str]) -> Pipeline:
        text = DRIVEWAY
        for old, new in edits:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "driveway.yaml"
        path.write_text(text, "utf-8")
        scenario = load(path)
        return Pipeline(scenario, scenario.space())

    return make


def test_a_car_leaves_a_driveway_on_a_cubic_curve(made):
    """Four places make a Bézier curve: its middle is (P0 + 3 P1 + 3 P2 + P3) / 8."""
    pipeline = made()
    rollout = pipeline.rollout(np.stack([pipeline.space.row({"at": at}) for at in (100.0, 130.0)]))
    lane = -2.0  # its middle
    for row, at in enumerate((100.0, 130.0)):  # the places are searched
        x, y, h = (getattr(rollout, key)[row, 1] for key in "xyh")
        assert (x[0], y[0]) == pytest.approx((at, lane - 12.0), abs=1e-9)
        assert h[0] == pytest.approx(np.pi / 2, abs=1e-3)
        middle = at + 12.0 / 8.0, lane - 12.0 / 8.0
        nearest = np.argmin(np.hypot(x - middle[0], y - middle[1]))
        assert np.hypot(x - middle[0], y - middle[1])[nearest] < 0.1 + 1e-3  # half a step of 0.2 m
        assert h[nearest] == pytest.approx(np.pi / 4, abs=0.05)
        after = x > at + 12.0
        assert after.any()
        assert y[after] == pytest.approx(lane, abs=1e-3)  # where it ends, its lane goes on
        assert h[after] == pytest.approx(0.0, abs=1e-3)


def test_it_is_a_spline_in_the_files_and_back(made):
    pipeline = made()
    concrete = pipeline.runner.concrete(pipeline.space.row({}), "roads.xodr")
    assert not list(check(concrete.individuals, pipeline.runner.source.constraints))
    text = to_xml(concrete.storyboard)
    assert b'<Nurbs order="4">' in text
    found, lost = individuals_from_openscenario(
        concrete.storyboard, concrete.roads, "roads.xodr", ""
    )[:2]
    assert not lost
    assert to_xml(openscenario_from_owl(found, "roads.xodr")) == text


def test_who_comes_from_beside_the_road_gives_way(made):
    """StVO § 10. The ego, from the left of it, would else have to."""
    pipeline = made(("duration: 12.0", "duration: 9.0"))
    space = pipeline.space
    rows = np.stack([space.row({"at": at}) for at in np.linspace(40.0, 80.0, 81)])
    found = analyse(pipeline.rollout(rows))
    rules = {Rule(int(one)) for one in found.rule[:, 1]}
    assert Rule.FROM_OFF_ROAD in rules
    assert Rule.ASSUMED_RIGHT_BEFORE_LEFT not in rules
    on_it = made(("offset: -12.0", "offset: -1.0"))
    assert made().rollout(rows[:1]).claims[0, 0, 1] > 0
    assert on_it.rollout(rows[:1]).claims[0, 0, 1] == 0


def test_a_curve_too_tight_for_the_steering_is_implausible(made):
    pipeline = made(("value: at + 12", "value: at + 3"))
    rollout = pipeline.rollout(pipeline.space.row({})[np.newaxis])
    assert "turn" in plausibility(rollout).labels[0]
    wide = made()
    rollout = wide.rollout(wide.space.row({"bv_speed": 2.0})[np.newaxis])
    assert plausibility(rollout).labels == [""]


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("  bv:\n    type: car", "  bv:\n    type: tram",
         "path"),
        ("  bv:\n    type: car", "  bv:\n    type: obstacle",
         "obstacle"),
        ("    speed: bv_speed", "    speed: bv_speed\n    driver: attentive",
         "attentive"),
        ("    speed: bv_speed", "    speed: bv_speed\n    end: {distance: 200}",
         "bv"),
        ("    start: {distance: 20.0}\n    end: {distance: 290.0}",
         "    path: [{distance: 20.0}, {distance: 290.0}]",
         "driver"),
    ],
)  # fmt: skip
def test_who_has_no_path_is_told(made, old, new, problem):
    with refuses(ScenarioError, problem):
        made((old, new))
