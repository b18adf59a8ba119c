"""The part of the operational design domain that a scenario needs, against what people see."""

import numpy as np
import pytest
from tests.approval import approve

import bridgegen as bg
from bridgegen.drivers.planners import DOMAINS
from bridgegen.engine.domain import in_words, needed, outside
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Threads
from bridgegen.jobs.benchmark.benchmark import domain_of
from bridgegen.openx.opendrive.from_owl.network import opendrive_from_owl
from bridgegen.openx.source import build_static
from bridgegen.scenario.language.reader import load


@pytest.mark.parametrize(
    ("scenario", "needs"),
    [
        ("cut-in", {"motorway"}),
        ("motorway-merge", {"motorway"}),  # ways join at an acute angle
        ("lead-brakes", {"road"}),  # a lane the other way
        ("wrong-way-driver", {"motorway", "oncoming"}),
        ("left-across-path", {"junction"}),
        ("roundabout-entry", {"junction"}),
        ("cyclist-right-turn", {"junction", "vulnerable"}),
        ("pedestrian-behind-parked", {"road", "vulnerable"}),
    ],
)
def test_it_is_read_from_the_map_and_the_actors(scenario, needs):
    assert domain_of(scenario) == needs


def test_each_needs_one_place_and_its_actors():
    """A cyclist adds "vulnerable"; somebody who comes towards the ego, "oncoming"."""
    logical = load("cut-in")
    space = logical.space()
    model = opendrive_from_owl(build_static(space.values(space.row({})), logical.roads))
    ahead = [model.roads[0].id]
    along, against = np.zeros(2), np.array([0.0, np.pi])
    assert needed(model, ahead, along, ["car"]) == {"motorway"}
    assert needed(model, ahead, along, ["car", "bicycle"]) == {"motorway", "vulnerable"}
    assert needed(model, ahead, against, ["car"]) == {"motorway", "oncoming"}
    turned = against - 7.0  # whatever the direction
    assert needed(model, ahead, turned, ["cone"]) == {"motorway", "oncoming"}


def test_words_are_in_the_order_of_their_definition():
    assert in_words({"vulnerable", "road"}) == "road, vulnerable"
    approve(in_words(DOMAINS))


@pytest.mark.parametrize(
    ("scenario", "ego", "said"),
    [
        ("crossroads-s4", "un-r157", "junctions, where others cross or turn"),
        ("wrong-way-driver", "fsm", "a vehicle that drives the wrong way"),
        ("cyclist-swings-out", "un-r157", "pedestrians and cyclists"),
        ("cut-in", "un-r157", ""),
        ("lead-brakes", "un-r157", ""),  # there is a lane the other way, and nobody on it
        ("crossroads-s4", "careful", ""),  # it states no domain
    ],
)
def test_a_driver_outside_its_domain_is_named(scenario, ego, said):
    logical = load(scenario)
    pipeline = Pipeline(logical, logical.space(), PipelineOptions(ego=ego), workers=Threads(1))
    found = outside(pipeline.runner)
    assert bool(found) == bool(said)
    assert said in found
    assert not found or found.startswith(f"outside the domain of {ego} (motorway): {scenario} has")


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("scenario", "ego", "ideal", "sees_the_truth"),
    [
        ("phantom-braking", "route-follower", (), True),
        ("phantom-braking", "careful", (), True),
        ("phantom-braking", "reference", ("perception",), True),
        ("phantom-braking", "reference", (), False),
        ("unresolved-pedestrian", "careful", (), True),
        ("unresolved-pedestrian", "reference", (), False),
    ],
)
def test_who_meets_no_errors_of_perception_is_not_said_to_pass_them(
    tmp_path, scenario, ego, ideal, sees_the_truth
):
    run = bg.run_search(
        scenario, ego=ego, ideal=ideal, algorithm="random", budget=20, keep=0,
        triage="none", out=tmp_path / "run",
    )  # fmt: skip
    assert (run.verdict == "not judged") == sees_the_truth
    errors = "ghosts" if scenario == "phantom-braking" else "late and merged tracks"
    said = f"sees what is there, and so none of the {errors} of {scenario}"
    assert (said in (run.folder / "report.html").read_text("utf-8")) == sees_the_truth
