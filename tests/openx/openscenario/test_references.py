"""Names that a scenario refers to, and the parts that must be there."""

import pytest
from tests.approval import approve

from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.validate import problems

from .files import maneuver, scenario, speed, story

WATCH = (
    "<StartTrigger><ConditionGroup><Condition name='c' delay='0' conditionEdge='none'>"
    "<ByValueCondition>{}</ByValueCondition></Condition></ConditionGroup></StartTrigger>"
)
STATE = (
    "<StoryboardElementStateCondition storyboardElementType='{}' storyboardElementRef='{}' "
    "state='completeState'/>"
)


def after(condition: str, name: str = "second") -> str:
    return speed("1", name).replace(
        "</Action></Event>", f"</Action>{WATCH.format(condition)}</Event>"
    )


def found(*events: str, init: str = "") -> list[str]:
    return problems(read(scenario(init=init, stories=story(maneuver(*events))).encode()))


@pytest.mark.parametrize(
    ("kind", "name"),
    [("event", "first"), ("action", "a"), ("maneuver", "m"), ("maneuverGroup", "g"), ("act", "a"),
     ("story", "s"), ("event", "m::first"), ("event", "s::a::g::m::first"), ("act", "s::a")],
)  # fmt: skip
def test_parts_of_the_storyboard_by_their_names(kind, name):
    assert found(speed("1", "first"), after(STATE.format(kind, name))) == []


@pytest.mark.parametrize(
    ("kind", "name", "known"),
    [("event", "third", "elements Event first, second"), ("act", "first", "elements Act a"),
     ("event", "n::first", "elements Event first, second"), ("story", "t", "elements Story s")],
)  # fmt: skip
def test_parts_that_are_not_there(kind, name, known):
    (problem,) = found(speed("1", "first"), after(STATE.format(kind, name)))
    approve(problem, known, name)


def test_parts_that_nobody_refers_to_may_share_a_name():
    assert found(speed("1", "first"), speed("2", "first")) == []
    (problem,) = found(
        speed("1", "first"), speed("2", "first"), after(STATE.format("event", "first"))
    )
    approve(problem, "first")


def test_controllers_of_lights_and_their_phases():
    ref = "<TrafficSignalControllerCondition trafficSignalControllerRef='{}' phase='{}'/>"
    lights = (
        "<RoadNetwork><TrafficSignals><TrafficSignalController name='t'><Phase name='go' "
        "duration='1'/></TrafficSignalController></TrafficSignals></RoadNetwork>"
    )

    def said(name: str, phase: str) -> list[str]:
        text = scenario(stories=story(maneuver(after(ref.format(name, phase)))))
        return problems(read(text.replace("<RoadNetwork/>", lights).encode()))

    assert said("t", "go") == []
    approve(said("t", "stop")[0], "stop", "TrafficSignalControllerCondition")
    approve(said("u", "go")[0], "u", "TrafficSignalControllerCondition")


@pytest.mark.parametrize(
    ("old", "new", "text"),
    [
        ("<LanePosition", '<RoadPosition roadId="99" s="1" t="0"/><LanePosition',
         "RoadPosition: road '99' is not in the road network"),
        ("<LanePosition", '<RoadPosition roadId="3" s="1e4" t="0"/><LanePosition',
         "must hold on road 3, got s=10000"),
    ],
)  # fmt: skip
def test_places_on_roads(individuals, s4, old, new, text):
    data = s4.decode()
    start = data.index(old)
    end = data.index("</Position>", start)
    mutant = data[:start] + new.removesuffix("<LanePosition") + data[end:]
    found = problems(read(mutant.encode()), opendrive_from_owl(individuals()))
    assert any(text in problem for problem in found), found


def test_lights_are_those_of_the_map(individuals, s4):
    action = (
        "<GlobalAction><InfrastructureAction><TrafficSignalAction>"
        '<TrafficSignalStateAction name="{}" state="off;off;on"/></TrafficSignalAction>'
        "</InfrastructureAction></GlobalAction>"
    )
    roads = opendrive_from_owl(individuals())
    data = s4.decode().replace("<Actions>", "<Actions>" + action.format("nowhere"), 1)
    (problem,) = problems(read(data.encode()), roads)
    approve(problem, "nowhere", "TrafficSignalStateAction")


def test_a_rate_may_have_a_sign_and_a_time_may_not():
    event = speed("1").replace('dynamicsShape="step"', 'dynamicsShape="linear"')
    rate = event.replace(
        'dynamicsDimension="time" value="0"', 'dynamicsDimension="rate" value="-4"'
    )
    assert found(rate) == []
    time = event.replace('value="0"', 'value="-4"')
    approve(found(time)[0], "TransitionDynamics")
