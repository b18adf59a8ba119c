"""Who waits for whom, on the catalogue's junctions and on ones with signs."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bridgegen.drivers.right_of_way import (
    BY_MAP,
    BY_SIGNS,
    FROM_THE_RIGHT,
    NO_RULE,
    OFF_ROAD,
    ONCOMING,
    SIREN,
    THEY_WAIT,
    WE_WAIT,
    claim,
    claims,
    right_of_way,
)
from bridgegen.drivers.scene import stop_signs
from bridgegen.engine.pipeline import Pipeline
from bridgegen.openx.opendrive.model import OpenDrive, Priority
from bridgegen.openx.opendrive.routes import Route
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.embedded.places.ways import Ways

CROSSING = """
scenario: signs
title: A crossroads with signs
description: The ego goes straight on from the south, another from the {leg}.
source: StVO.
template: crossroads
roads: {{lanes_per_direction: 1, legs: {legs}}}
duration: 20.0 # s
time_step: 0.05 # s
axes: [participants, weather]
include: [weather]
driver: reference
participants:
  ego:
    type: car
    start: {{leg: A, way: in, distance: 45.0}}
    end: {{leg: C, way: out, distance: 40.0}}
    speed: 9.0
  other:
    type: car
    start: {{leg: {leg}, way: in, distance: other_at}}
    end: {{leg: {to}, way: out, distance: 40.0}}
    speed: 8.0
parameters:
  other_at: {{axis: participants, unit: m, low: 5.0, high: 50.0, default: 50.0,
    description: Where the other starts., source: Ours.}}
objective:
  terms: [{{metric: d_min, weight: 1.0}}]
  weights: fixed
  scale: raw
  critical: {{n_collision_above: 0, d_min_below: 0.5, v_d_at_least: 1.0}}
"""


def crossing(folder: Path, leg: str, to: str, **signs: str) -> Pipeline:
    legs = ", ".join(
        f"{name}: {{sign: {signs[name]}}}" if name in signs else f"{name}: {{}}" for name in "ABCD"
    )
    path = folder / "signs.yaml"
    path.write_text(CROSSING.format(leg=leg, to=to, legs=f"{{{legs}}}"))
    scenario = load(path)
    return Pipeline(scenario, scenario.space())


def routes(pipeline: Pipeline) -> tuple[OpenDrive, list[Route]]:
    """Return the nominal road network, and the routes of ego and other."""
    model = pipeline.runner.concrete(pipeline.space.row({})).roads
    found = Ways(pipeline.runner.simulator.program, model).routes
    return model, [one for one in found if one is not None]


def catalogue(name: str) -> tuple[OpenDrive, list[Route]]:
    scenario = load(name)
    return routes(Pipeline(scenario, scenario.space()))


@pytest.mark.parametrize(
    ("name", "rank"),
    [
        (
            "crossroads-s1",
            WE_WAIT,
        ),  # it comes from the west, the ego from the north: from the right
        ("crossroads-s2", NO_RULE),  # it turns left towards the ego, and ought to wait
        ("crossroads-s3", WE_WAIT),  # from the east, the ego from the south
        ("crossroads-s4", WE_WAIT),
        ("left-across-path", WE_WAIT),  # the ego turns left
        ("roundabout-entry", WE_WAIT),  # a sign at each entry
        ("red-light-runner", NO_RULE),  # lights tell
        ("lead-brakes", NO_RULE),
    ],
)
def test_of_the_catalogue(name: str, rank: int) -> None:
    model, (own, other, *_) = catalogue(name)
    assert right_of_way(model, own, other) == rank


def test_of_two_routes_one_waits_at_most(tmp_path: Path) -> None:
    for signs in ({}, {"A": "yield"}, {"D": "stop"}, {"A": "stop", "D": "yield"}):
        model, (own, other) = routes(crossing(tmp_path, "D", "B", **signs))
        ranks = right_of_way(model, own, other), right_of_way(model, other, own)
        assert ranks in {(WE_WAIT, THEY_WAIT), (THEY_WAIT, WE_WAIT), (WE_WAIT, NO_RULE)}


@pytest.mark.parametrize(
    ("leg", "to", "signs", "rank"),
    [
        ("B", "D", {"A": "yield"}, WE_WAIT),  # from the left, on the road without signs
        ("D", "B", {"D": "yield"}, THEY_WAIT),
        ("D", "B", {"D": "stop", "B": "stop"}, THEY_WAIT),
        ("D", "B", {"A": "stop", "D": "stop"}, WE_WAIT),  # both wait: from the right
        ("B", "D", {}, NO_RULE),
        ("C", "A", {}, NO_RULE),  # oncoming
    ],
)
def test_of_signs(tmp_path: Path, leg: str, to: str, signs: dict[str, str], rank: int) -> None:
    model, (own, other) = routes(crossing(tmp_path, leg, to, **signs))
    assert right_of_way(model, own, other) == rank


def test_of_the_map_s_own_priorities(tmp_path: Path) -> None:
    model, (own, other) = routes(crossing(tmp_path, "D", "B"))
    inside = [
        next(one.road_id for one in each.steps if model.road(one.road_id).is_connecting)
        for each in (own, other)
    ]
    junction = replace(model.junctions[0], priorities=(Priority(inside[0], inside[1]),))
    stated = replace(model, junctions=(junction, *model.junctions[1:]))
    assert right_of_way(stated, own, other) == THEY_WAIT
    assert right_of_way(stated, other, own) == WE_WAIT


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("crossroads-s1", -FROM_THE_RIGHT),
        ("crossroads-s2", ONCOMING),  # the other turns left towards the ego
        ("left-across-path", -ONCOMING),
        ("roundabout-entry", -BY_SIGNS),
        ("red-light-runner", 0),  # lights decide who may enter
        ("lead-brakes", 0),
    ],
)
def test_who_goes_first_by_law_in_the_catalogue(name: str, expected: int) -> None:
    model, (own, other, *_) = catalogue(name)
    assert claim(model, own, other) == expected


@pytest.mark.parametrize(
    ("leg", "signs", "expected"),
    [
        ("B", {}, FROM_THE_RIGHT),  # the ego comes from the right of who comes from the west
        ("D", {}, -FROM_THE_RIGHT),
        ("B", {"A": "yield"}, -BY_SIGNS),
        ("D", {"D": "stop"}, BY_SIGNS),
        ("D", {"A": "stop", "D": "stop"}, -FROM_THE_RIGHT),
    ],
)
def test_a_claim_is_antisymmetric_and_names_its_rule(
    tmp_path: Path, leg: str, signs: dict[str, str], expected: int
) -> None:
    to = {"B": "D", "D": "B"}[leg]
    model, (own, other) = routes(crossing(tmp_path, leg, to, **signs))
    assert claim(model, own, other) == expected
    assert claim(model, other, own) == -expected
    assert claims(model, [own, None, other], [0, 0, 0]).tolist() == [
        [0, 0, expected], [0, 0, 0], [-expected, 0, 0]
    ]  # fmt: skip


def test_all_give_way_to_a_siren_wherever_they_are(tmp_path: Path) -> None:
    model, (own, other) = routes(crossing(tmp_path, "B", "D"))
    assert claims(model, [own, None, other], [0, 0, 1]).tolist() == [
        [0, 0, -SIREN], [0, 0, -SIREN], [SIREN, SIREN, 0]
    ]  # fmt: skip
    both = claims(model, [own, None, other], [0, 1, 1])
    assert both[1, 2] == both[2, 1] == 0


def test_who_comes_from_off_the_road_gives_way_to_all_on_it(tmp_path: Path) -> None:
    model, (own, other) = routes(crossing(tmp_path, "B", "D"))
    assert claims(model, [own, None, other], [0, -1, 1]).tolist() == [
        [0, OFF_ROAD, -SIREN], [-OFF_ROAD, 0, -SIREN], [SIREN, SIREN, 0]
    ]  # fmt: skip


def test_a_priority_of_the_map_overrules_the_rule_of_the_right(tmp_path: Path) -> None:
    model, (own, other) = routes(crossing(tmp_path, "D", "B"))
    inside = [
        next(one.road_id for one in each.steps if model.road(one.road_id).is_connecting)
        for each in (own, other)
    ]
    junction = replace(model.junctions[0], priorities=(Priority(inside[0], inside[1]),))
    stated = replace(model, junctions=(junction, *model.junctions[1:]))
    assert claim(stated, own, other) == BY_MAP
    assert claim(stated, other, own) == -BY_MAP


def test_a_stop_sign_has_its_line_before_the_junction(tmp_path: Path) -> None:
    model, (own, _) = routes(crossing(tmp_path, "D", "B", A="stop"))
    (line,) = stop_signs(model, own)
    first = next(one for one in own.steps if model.road(one.road_id).is_connecting)
    assert line == pytest.approx(own.station(first.road_id, first.s)[0], abs=3.0)
    assert stop_signs(*routes(crossing(tmp_path, "D", "B", A="yield"))[:1], own) == []


def test_the_reference_halts_at_a_stop_sign_and_not_at_others(tmp_path: Path) -> None:
    # Nobody comes for long: the other starts 50 m away, at a walk it would be too late.
    slowest = {}
    for sign in ("stop", "yield"):
        pipeline = crossing(tmp_path, "D", "B", A=sign)
        rollout = pipeline.rollout(pipeline.space.row({"other_at": 5.0})[np.newaxis])
        v = rollout.v[0, 0, : rollout.n_steps[0]]
        slowest[sign] = v.min()
        assert v[-1] > 3.0  # and goes on
    assert slowest["stop"] < 0.3
    assert slowest["yield"] > 1.0


def test_who_need_not_wait_goes_first_as_long_as_the_other_can_stop(tmp_path: Path) -> None:
    first = {}
    for name, signs in (("priority", {"D": "yield", "B": "yield"}), ("right", {})):
        pipeline = crossing(tmp_path, "D", "B", **signs)
        rollout = pipeline.rollout(pipeline.space.row({"other_at": 50.0})[np.newaxis])
        first[name] = rollout.v[0, 0, : round(3.0 / rollout.time_step)].min()
    assert first["right"] < first["priority"] - 0.5
