"""Scenario files in the mirror: what lies aside changes its side, twice to the last bit."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.base.errors import FileFormatError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element, declaration, walk
from bridgegen.openx.openscenario.mirror import NEGATED, SIDES, TURNS, mirrored
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.values import Expr, ParameterRef
from bridgegen.openx.openscenario.write import to_xml

numbers = st.one_of(
    st.floats(-1e3, 1e3), st.just(ParameterRef("$a")), st.just(Expr("${2*($a)-(3)}"))
)
lanes = st.sampled_from(["-2", "1", "0"])
turns = st.one_of(st.floats(0.0, 6.28), st.just(Expr("${($a)/360}")))


def of(*actions, weather=None):
    """Return a scenario in which these actions of the ego's begin at the start."""
    declared = osc.ParameterDeclaration("a", osc.ParameterType.DOUBLE, "0.5")
    body = osc.MiscObject(
        "box", osc.MiscObjectCategory.NONE, 1.0,
        osc.BoundingBox(osc.Center(0.0, 0.25, 0.5), osc.Dimensions(1.0, 1.0, 1.0)),
    )  # fmt: skip
    condition = osc.EnvironmentAction(osc.Environment("w", weather=weather))
    private = osc.Private("ego", tuple(osc.PrivateAction(item) for item in actions))
    init = osc.InitActions((osc.GlobalAction(condition),), privates=(private,))
    return osc.OpenScenario(
        osc.FileHeader(1, 2, "2026-01-01T00:00:00", "test", "test"),
        osc.RoadNetwork(osc.File("map.xodr")),
        osc.Entities((osc.ScenarioObject("ego", body),)),
        osc.Storyboard(osc.Init(init), (), osc.Trigger()),
        parameter_declarations=osc.ParameterDeclarations((declared,)),
    )


def at(position):
    return osc.TeleportAction(osc.Position(position))


@st.composite
def scenarios(draw):
    """Draw a scenario with positions, lanes, offsets and weather."""
    turned = osc.Orientation(osc.ReferenceContext.RELATIVE, h=draw(numbers))
    aside = osc.LaneOffsetAction(
        True,
        osc.LaneOffsetActionDynamics(osc.DynamicsShape.SINUSOIDAL, 1.0),
        osc.LaneOffsetTarget(osc.AbsoluteTargetLaneOffset(draw(numbers))),
    )
    return of(
        at(osc.WorldPosition(draw(numbers), draw(numbers), h=draw(numbers))),
        at(osc.LanePosition("1", draw(lanes), 3.0, draw(numbers), turned)),
        at(osc.RelativeLanePosition("ego", draw(st.integers(-2, 2)), ds=1.0)),
        osc.LateralAction(aside),
        weather=osc.Weather(sun=osc.Sun(draw(turns), 0.5), wind=osc.Wind(draw(turns), 3.0)),
    )  # fmt: skip


@given(scenarios())
def test_the_mirror_of_the_mirror_is_the_scenario(scenario):
    image = mirrored(scenario)
    assert image.left_hand
    assert repr(mirrored(image)) == repr(scenario)


@given(scenarios())
def test_a_file_is_read_as_what_was_simulated(scenario):
    simulated = replace(scenario, left_hand=True)
    text = to_xml(simulated)
    assert mirrored(read(text)) == simulated


@given(turns, st.floats(0.0, 360.0))
def test_the_sun_stands_in_the_mirror(azimuth, a):
    """It shines from (sin, cos) of its azimuth, clockwise from +y: of which y changes its sign."""
    (sun,) = (
        item
        for item in walk(mirrored(of(weather=osc.Weather(sun=osc.Sun(azimuth, 0.5)))))
        if isinstance(item, osc.Sun)
    )
    here, there = (
        float(value.resolve({"a": a})) if isinstance(value, Expr) else value
        for value in (azimuth, sun.azimuth)
    )
    assert 0.0 <= there <= 2.0 * math.pi
    assert math.sin(there) == pytest.approx(math.sin(here), abs=1e-9)
    assert math.cos(there) == pytest.approx(-math.cos(here), abs=1e-9)


def test_words_of_a_side_and_lateral_conditions_turn():
    light = osc.LightStateAction(
        osc.LightType(osc.VehicleLight(osc.VehicleLightType.INDICATOR_LEFT)),
        osc.LightState(osc.LightMode.ON),
    )
    image = [*walk(mirrored(of(osc.AppearanceAction(light))))]
    (lamp,) = (item for item in image if isinstance(item, osc.VehicleLight))
    assert lamp.vehicle_light_type is osc.VehicleLightType.INDICATOR_RIGHT
    lateral = osc.SpeedCondition(osc.Rule.GREATER_THAN, 2.0, osc.DirectionalDimension.LATERAL)
    condition = osc.ByEntityCondition(
        osc.TriggeringEntities(osc.TriggeringEntitiesRule.ANY, (osc.EntityRef("ego"),)),
        osc.EntityCondition(lateral),
    )
    asked = osc.Condition("c", 0.0, osc.ConditionEdge.NONE, condition)
    whole = of()
    board = replace(whole.storyboard, stop_trigger=osc.Trigger((osc.ConditionGroup((asked,)),)))
    found = mirrored(replace(whole, storyboard=board))
    (turned,) = (item for item in walk(found) if isinstance(item, osc.SpeedCondition))
    assert (turned.rule, turned.value) == (osc.Rule.LESS_THAN, -2.0)


def test_a_lane_that_a_parameter_names_is_refused():
    scenario = of(at(osc.LanePosition("1", ParameterRef("$a"), 3.0)))
    with pytest.raises(FileFormatError, match=r"lane_id of LanePosition .* parameter \$a \(line 0"):
        mirrored(scenario, "x.xosc")


def test_nothing_that_lies_aside_is_forgotten():
    """An attribute by such a name, in whatever element there will be, changes its side."""
    aside = {
        "t", "dt", "dy", "y", "h", "r", "offset", "lane_offset", "lane_id", "d_lane", "curvature",
        "curvature_start", "curvature_end", "target_lane_offset", "azimuth",
    }  # fmt: skip
    other = {"TrafficSwarmAction", "Timing"}  # offsets along, and of time
    todo, seen = [osc.OpenScenario], set()
    while todo:
        cls = todo.pop()
        if cls in seen:
            continue
        seen.add(cls)
        declared = declaration(cls)
        todo += [kind for child in declared.children for kind in child.tags]
        handled = {*NEGATED.get(cls, ()), SIDES.get(cls), TURNS.get(cls, ("",))[0]}
        names = {attribute.field for attribute in declared.attributes.values()}
        assert names & aside <= handled or cls.__name__ in other, cls
    assert issubclass(cls, Element)
    assert seen >= {*NEGATED, *SIDES, *TURNS}
