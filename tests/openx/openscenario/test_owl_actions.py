"""Every action and condition of the ontology is written, and what is written is the standard's."""

from typing import Any

import pytest
from lxml import etree
from tests.approval import refuses

from bridgegen.base.errors import OntologyError
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import walk
from bridgegen.openx.openscenario.from_owl import openscenario_from_owl
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.write import to_xml
from bridgegen.scenario.ontology.vocabulary import bg, local_name, tbox
from bridgegen.simulation.embedded.compiler import compile_storyboard

from . import stories

AT_TWO = [[("SimulationTimeCondition", {"has_value": 2.0})]]


def story(source: Any, *actions: stories.Thing, who: tuple[str, ...] = ("bv",)) -> osc.OpenScenario:
    stage = stories.Stage(source)
    stage.event("event", who, actions, AT_TWO)
    return openscenario_from_owl(stage.individuals(), "road.xodr")


def only(scenario: osc.OpenScenario, cls: type) -> Any:
    (found,) = [element for element in walk(scenario) if isinstance(element, cls)]
    return found


def test_a_lane_offset(individuals):
    values = {"has_target_offset": 0.75, "has_max_lateral_acceleration": 2.0}
    action = only(story(individuals(), ("LaneOffsetAction", values)), osc.LaneOffsetAction)
    assert action.continuous is False
    assert action.dynamics == osc.LaneOffsetActionDynamics("linear", 2.0)
    assert action.lane_offset_target.target == osc.AbsoluteTargetLaneOffset(0.75)


def test_a_synchronisation(individuals):
    action = only(story(individuals(), stories.ACTIONS[-1]), osc.SynchronizeAction)
    assert action.master_entity_ref == "ego"
    # leg C is road 3, leg B road 2; outbound lanes are negative
    there, master = action.target_position.position, action.target_position_master.position
    assert (there.road_id, there.lane_id, there.s) == ("3", "-1", 5.0)
    assert (master.road_id, master.lane_id, master.s) == ("2", "1", 1.0)


def test_who_comes_and_goes(individuals):
    scenario = story(individuals(), *stories.PRESENCE, who=())
    come, go = [one for one in walk(scenario) if isinstance(one, osc.EntityAction)]
    assert (come.entity_ref, go.entity_ref) == ("bv", "bv")
    assert come.action.position.position.s == 9.0
    assert go.action == osc.DeleteEntityAction()


def test_all_classes_are_in_these_stories():
    """So nothing of the ontology is forgotten here, nor in the tests of the way back."""
    seen = {cls for cls, _ in (*stories.ACTIONS, *stories.PRESENCE, *stories.CONDITIONS)}
    elsewhere = {  # in test_to_owl, each with individuals of its own
        "AssignRouteAction", "EnvironmentAction", "FollowTrajectoryAction",
        "TrafficSignalStateAction", "TrafficSignalCondition",
        "OpenScenarioAction", "OpenScenarioCondition",  # in test_quoted
    }  # fmt: skip
    for top in ("Action", "Condition"):
        known = {local_name(one) for one in tbox().subclasses[bg(top)]} - {top}
        assert known <= seen | elsewhere


@pytest.mark.parametrize("number", range(len(stories.ACTIONS)))
def test_what_is_said_of_an_entity_can_be_run(individuals, number):
    compile_storyboard(story(individuals(), stories.ACTIONS[number]), "s.xosc")


def test_who_comes_and_goes_can_be_run(individuals):
    compile_storyboard(story(individuals(), *stories.PRESENCE), "s.xosc")


@pytest.mark.parametrize("condition", stories.CONDITIONS, ids=lambda one: one[0])
def test_every_condition_can_be_run(individuals, condition):
    stage = stories.Stage(individuals())
    stage.event("event", ("bv",), [stories.ACTIONS[0]], [[condition]])
    compile_storyboard(openscenario_from_owl(stage.individuals(), "road.xodr"), "s.xosc")


@pytest.mark.parametrize(
    ("action", "text"),
    [
        (("SynchronizeAction", {"has_entity_ref": "<ego>"}), "has_position"),
        (("SynchronizeAction", {"has_entity_ref": "<leg_A>",
                                "has_position": stories.on_lane("leg_A_in_1", 1.0),
                                "has_master_position": stories.on_lane("leg_A_in_1", 1.0)}),
         "participant"),
        (("LaneOffsetAction", {}), "has_target_offset"),
        (("LongitudinalDistanceAction", {"has_entity_ref": "<ego>"}), "has_kept"),
        (("DeleteEntityAction", {}), "has_entity_ref"),
    ],
)  # fmt: skip
def test_what_they_lack_is_named(individuals, action, text):
    with refuses(OntologyError, text):
        story(individuals(), action)


def test_it_does_not_rain_and_snow_at_once(individuals):
    source = individuals()
    stage = stories.Stage(source)
    weather = source.link(source.one("Scenario"), "has_weather")
    stage.put(weather, "has_snow", stage.thing("snow", "Snow", {"has_snowfall": 1.0}))
    with refuses(OntologyError, "has_rain", "has_snow"):
        openscenario_from_owl(stage.individuals(), "road.xodr")


@pytest.mark.checkers
def test_they_are_valid_by_the_schema_and_by_the_checkers(checkers, individuals, tmp_path):
    source = individuals()
    stage = stories.Stage(source)
    for k, action in enumerate((*stories.ACTIONS, *stories.PRESENCE)):
        stage.event(f"e{k}", ["bv"], [action], [[one] for one in stories.CONDITIONS])
    path = tmp_path / "all.xosc"
    path.write_bytes(to_xml(openscenario_from_owl(stage.individuals(), "road.xodr")))
    (tmp_path / "road.xodr").write_bytes(_road(source))
    schema = checkers.schema("qc_openscenario", "1.3.0/OpenSCENARIO.xsd")  # for lights
    assert schema.validate(etree.parse(path)), schema.error_log
    (report,) = checkers.qc_openscenario(path)
    assert report.clean, report
    assert read(path)


def _road(source: Any) -> bytes:
    from bridgegen.openx.opendrive.write import to_xml as roads_to_xml

    return roads_to_xml(opendrive_from_owl(source))
