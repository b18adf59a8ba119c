"""The part of the operational design domain that a scenario needs, against what people see."""

import numpy as np
import pytest

from bridgegen.campaign.domain import domain_of, in_words, needed
from bridgegen.ego.planners.planner import DOMAINS
from bridgegen.odd.reader import load
from bridgegen.openx.opendrive.from_owl.network import opendrive_from_owl
from bridgegen.openx.source import build_static


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
    assert in_words(DOMAINS) == "motorway, road, junction, oncoming, vulnerable"
