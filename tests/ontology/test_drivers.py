"""Drivers of participants: as individuals, checked, and in the file that follows."""

import pytest

from bridgegen.openx.openscenario.declarations import DRIVER
from bridgegen.openx.openscenario.from_owl import openscenario_from_owl
from bridgegen.scenario.language.adversary import with_others
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.ontology.check import check
from bridgegen.scenario.ontology.individuals import build


def concrete(name, others):
    scenario = with_others(load(name), others)
    space = scenario.space()
    return scenario, build(scenario, space.values(space.row({})), driver="reference")


@pytest.mark.parametrize(("others", "expected"), [("attentive", ["attentive"]), ("scripted", [])])
def test_who_has_a_driver_has_a_controller_that_names_it(others, expected):
    _, individuals = concrete("cut-in", others)
    file = openscenario_from_owl(individuals, "cut-in.xodr")
    found = {
        str(one.name): [
            str(each.controller.properties.get(DRIVER)) for each in one.object_controllers
        ]
        for one in file.entities.scenario_objects
    }
    assert found == {"ego": ["reference"], "bv": expected}


def test_individuals_with_drivers_keep_the_shapes():
    scenario, individuals = concrete("cut-in", "attentive")
    assert check(individuals, scenario) == []
