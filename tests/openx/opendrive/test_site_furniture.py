"""What stands and lies at a place of a map becomes part of the scenario that takes place there."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve

from bridgegen.engine.pipeline import Pipeline
from bridgegen.openx.on_map import on_map
from bridgegen.openx.opendrive.furniture import Signal, SignalReference
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.road_map import load_map
from bridgegen.openx.opendrive.site_adapted import adapted
from bridgegen.openx.opendrive.site_fit import missing, site_for
from bridgegen.openx.opendrive.write import to_xml
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.ontology.site import Site


@pytest.fixture
def lit() -> OpenDrive:
    """Return the map of red-light-runner, as if it came from elsewhere."""
    scenario = load("red-light-runner")
    pipeline = Pipeline(scenario, scenario.space())
    return pipeline.runner.concrete(pipeline.space.row({})).roads


def lights(site: Site) -> set[tuple[str, str | None]]:
    return {(one.leg, one.object_id) for one in site.facilities if one.cls == "TrafficLight"}


def as_carla(model: OpenDrive) -> OpenDrive:
    """Return a map whose lights are said to hold on the junction's roads, as CARLA says it.

    The signals stand on the legs, valid for no lane there.
    """
    held: dict[str, list[SignalReference]] = {}
    roads = []
    for road in model.roads:
        signals = []
        for one in road.signals:
            signals.append(replace(one, validity=(nowhere(one),)))
            for inside in model.roads:
                if (
                    inside.is_connecting
                    and inside.predecessor
                    and (inside.predecessor.element_id == road.id)
                ):
                    held.setdefault(inside.id, []).append(
                        SignalReference(s=2.0, t=0.0, id=one.id, orientation="+")
                    )
        roads.append(replace(road, signals=tuple(signals)))
    return replace(
        model,
        roads=tuple(
            replace(road, signal_references=tuple(held.get(road.id, ()))) for road in roads
        ),
    )


def nowhere(signal: Signal) -> object:
    from bridgegen.openx.opendrive.furniture import Validity

    assert signal.id
    return Validity(0, 0)


@pytest.mark.parametrize("told", [lambda model: model, as_carla])
def test_a_map_s_lights_are_those_of_its_legs(
    lit: OpenDrive, told: Callable[[OpenDrive], OpenDrive]
) -> None:
    """Each leg has its own, whether they hold on the leg or on the junction's roads."""
    site = site_for(load("red-light-runner"), told(lit))
    own = {(leg.name, f"{leg.roads[0].road_id}03") for leg in site.legs}
    assert {leg for leg, _ in lights(site)} == {"A", "B", "C", "D"}
    assert len(lights(site)) == len(own) == 4
    assert [phase.green for phase in site.phases if phase.green] == [("A", "C"), ("B", "D")]


@pytest.mark.parametrize("told", [lambda model: model, as_carla])
def test_a_scenario_with_lights_is_on_their_map_what_it_is_at_home(
    lit: OpenDrive, told: Callable[[OpenDrive], OpenDrive], tmp_path: Path
) -> None:
    """The reference driver stops at red; on CARLA's kind of map before the junction."""
    scenario = load("red-light-runner")
    assert isinstance(scenario, LogicalScenario)
    path = tmp_path / "town.xodr"
    path.write_bytes(to_xml(told(lit)))
    home = Pipeline(scenario, scenario.space())
    roads = load_map(path, scenario=scenario)
    there = on_map(scenario, roads)
    away = Pipeline(there, there.space(), road_map=roads)
    one = home.rollout(home.space.row({})[None])
    other = away.rollout(away.space.row({})[None])
    assert not other.messages
    names = {light.object_id for light in roads.site.facilities if light.cls == "TrafficLight"}
    assert set(other.light_names) == names
    np.testing.assert_array_equal(np.sort(one.lights, axis=1), np.sort(other.lights, axis=1))
    if told is not as_carla:
        np.testing.assert_allclose(other.x, one.x, atol=1e-6)
        np.testing.assert_allclose(other.v, one.v, atol=1e-6)


def test_lights_of_a_map_are_off_where_the_scenario_has_none(lit: OpenDrive) -> None:
    scenario = load("crossroads-s4")
    site = site_for(scenario, lit)
    assert site.phases == ()
    notes = adapted(scenario, lit, site)[1]
    approve(notes, "100")


def test_a_scenario_with_lights_needs_them() -> None:
    scenario = load("red-light-runner")
    dark = replace(scenario, roads=replace(scenario.roads, signals="none"))
    pipeline = Pipeline(dark, dark.space())
    model = pipeline.runner.concrete(pipeline.space.row({})).roads
    site = site_for(dark, model)
    assert missing(scenario, model, site) == [
        "a traffic light on leg A", "a traffic light on leg D"
    ]  # fmt: skip


def test_pedestrians_need_a_crosswalk() -> None:
    scenario = load("pedestrian-at-night")
    pipeline = Pipeline(scenario, scenario.space())
    model = pipeline.runner.concrete(pipeline.space.row({})).roads
    site = site_for(scenario, model)
    assert ("D", 3.0) in {(one.leg, one.distance) for one in site.facilities}
    bare = replace(model, roads=tuple(replace(road, objects=()) for road in model.roads))
    lacks = missing(scenario, bare, replace(site, facilities=()))
    approve(lacks, "3.0 m")


def test_more_lanes_count_from_the_outermost() -> None:
    """The bus of bus-pulls-out stands beside the ego's lane on a road of three lanes, too."""
    scenario = load("bus-pulls-out")
    wide = replace(
        scenario,
        roads=replace(scenario.roads, knobs=dict(scenario.roads.knobs) | {"lanes": 3.0}),
    )
    pipeline = Pipeline(wide, wide.space())
    model = pipeline.runner.concrete(pipeline.space.row({})).roads
    site = site_for(scenario, model, "1")
    there, notes = adapted(scenario, model, site)
    assert [one.start.lane for one in there.participants] == [3, "shoulder"]
    assert notes == ["lanes out count from the outermost one: there are 3, not 1"]


def test_a_lane_that_is_not_there_is_the_outermost_one() -> None:
    scenario = load("crossroads-s4")
    narrow = replace(
        scenario,
        roads=replace(
            scenario.roads, knobs=dict(scenario.roads.knobs) | {"lanes_per_direction": 1.0}
        ),
    )
    pipeline = Pipeline(narrow, narrow.space())
    model = pipeline.runner.concrete(pipeline.space.row({})).roads
    first, *others = scenario.story.participants
    outside = replace(first, start=replace(first.start, lane=2))
    story = replace(scenario.story, participants=(outside, *others))
    site = site_for(scenario, model)
    there, notes = adapted(replace(scenario, story=story), model, site)
    assert there.participants[0].start.lane == 1
    approve(notes, first.name, "lane 1")
