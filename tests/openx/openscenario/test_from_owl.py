import math
import random

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import OntologyError, UnsupportedError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario import parameters
from bridgegen.openx.openscenario.element import references, walk
from bridgegen.openx.openscenario.from_owl import openscenario_from_owl
from bridgegen.openx.openscenario.from_owl import signals as weather
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.values import Expr, resolve
from bridgegen.openx.openscenario.write import to_xml
from bridgegen.scenario import weather as laws
from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.ontology.graph import Individuals


def only(scenario, cls):
    (found,) = [element for element in walk(scenario) if isinstance(element, cls)]
    return found


def convert(source):
    return openscenario_from_owl(source, "crossroads.xodr")


def positions(scenario):
    """Road, lane and s now of each participant's start and of the ego's destination."""
    numbers = parameters.numbers(scenario)

    def plain(position):
        lane = position.position
        return lane.road_id, lane.lane_id, float(resolve(lane.s, numbers))

    starts = {
        private.entity_ref: plain(private.private_actions[0].action.position)
        for private in scenario.storyboard.init.actions.privates
    }
    return starts | {"destination": plain(only(scenario, osc.ReachPositionCondition).position)}


# -- laws ------------------------------------------------------------------------------------------


def test_it_reads_back(individuals, scenario_name):
    scenario = convert(individuals(scenario_name))
    assert read(to_xml(scenario)) == scenario


def test_every_dynamic_parameter_is_declared_and_used(individuals, scenario_name):
    scenario = convert(individuals(scenario_name))
    logical = load(scenario_name)
    space = logical.space()
    static = set(logical.space(axes=["static"]).variables)
    values = parameters.values(scenario)
    texts = {weather.CLOUD_COVER, weather.ROAD_WETNESS, weather.TIME_OF_DAY}
    assert values.keys() - texts == set(space.names) - static - {"speed_factor"}  # only limits
    assert references(scenario) == values.keys()


def test_its_values_are_the_row_to_the_bit(individuals):
    u = np.random.default_rng(1).random(load("crossroads-s4").space().n_var)
    space = load("crossroads-s4").space()
    row = dict(zip(space.names, space.decode(u[None])[0].tolist(), strict=True))
    numbers = parameters.numbers(read(to_xml(convert(individuals(u=u)))))
    assert numbers == {name: row[name] for name in numbers}
    assert len(numbers) == 16


def test_nothing_depends_on_static_parameters(individuals):
    one = individuals(lane_width=3.0, lanes_per_direction=1, arm_length=50, intersection_size=20)
    other = individuals(lane_width=4.0, lanes_per_direction=3, arm_length=99, intersection_size=44)
    assert to_xml(convert(one)) == to_xml(convert(other))


def test_the_order_of_statements_does_not_matter(individuals):
    source = individuals()
    quads = list(source.quads)
    random.Random(7).shuffle(quads)
    assert to_xml(convert(Individuals(quads))) == to_xml(convert(source))


def test_the_date_is_given_not_taken(individuals):
    source = individuals()
    assert convert(source).file_header.date == "2025-01-01T00:00:00"
    dated = openscenario_from_owl(source, "x.xodr", date="2020-02-29T10:00:00")
    assert dated.file_header.date == "2020-02-29T10:00:00"
    assert dated.road_network.logic_file == osc.File("x.xodr")


# -- S4 by hand (spec.md: P5→P8, P3→P8) ------------------------------------------------------------


def test_where_s4_starts_and_ends(individuals):
    # A..D are roads 1..4, whose reference lines run outwards: inbound lanes are positive
    scenario = convert(individuals(bv_start=21.5))
    assert positions(scenario) == {
        "ego": ("3", "1", 40.0),
        "bv": ("2", "1", 21.5),
        "destination": ("4", "-1", 40.0),
    }


def test_who_takes_part(individuals):
    scenario = convert(individuals())
    ego, bv = scenario.entities.scenario_objects
    assert (ego.name, bv.name) == ("ego", "bv")
    (driver,) = ego.object_controllers
    assert driver.controller.name == "ego_driver"
    assert driver.controller.properties.get("driver") == "route-follower"
    (driver,) = bv.object_controllers
    assert driver.controller.properties.get("driver") == "insistent"
    box = ego.entity_object.bounding_box
    assert (box.center.x, box.dimensions.length, box.dimensions.width) == (1.4, 4.6, 1.9)


def test_the_event_fires_at_the_earlier_of_two_conditions_even_from_the_start(individuals):
    scenario = convert(individuals())
    event = only(scenario, osc.Event)
    assert event.priority is osc.Priority.OVERRIDE
    assert event.maximum_execution_count == 1
    time, distance = [group.conditions for group in event.start_trigger.condition_groups]
    assert [c.condition_edge for c in (*time, *distance)] == [osc.ConditionEdge.NONE] * 2
    assert time[0].condition.condition == osc.SimulationTimeCondition(
        osc.ParameterRef("$bv_trigger_time"), osc.Rule.GREATER_OR_EQUAL
    )
    relative = distance[0].condition.entity_condition.condition
    assert relative.value == osc.ParameterRef("$bv_trigger_distance")
    assert (relative.entity_ref, relative.freespace, relative.rule) == ("ego", False, "lessOrEqual")
    action = event.actions[0].action.action.action
    assert action.entries == (osc.SpeedProfileEntry(osc.ParameterRef("$bv_speed")),)
    assert action.following_mode is osc.FollowingMode.FOLLOW
    assert action.dynamic_constraints == osc.DynamicConstraints(3.0, 3.0, None, 5.0, 5.0)


def test_it_ends_after_the_duration_or_on_arrival(individuals):
    stop = convert(individuals()).storyboard.stop_trigger
    (duration,), (arrival,) = [group.conditions for group in stop.condition_groups]
    assert duration.condition.condition == osc.SimulationTimeCondition(20.0, "greaterOrEqual")
    assert arrival.condition.entity_condition.condition.tolerance == 2.0
    # esmini compares an orientation that is stated here
    lane = arrival.condition.entity_condition.condition.position.position
    assert lane.orientation is None


# -- a map that was made elsewhere -----------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "start", "expected"),
    [
        # ego from C, 40 m: road 17 is 11.614 m and ends at the junction, 47 continues it
        ("crossroads-s1", 10.0, {"ego": ("47", "-1", 26.028), "bv": ("1", "1", 10.0),
                                 "destination": ("0", "-1", None)}),
        # BV from A: road 18 to 21.697 m, then road 40, both running outwards
        ("crossroads-s2", 10.0, {"bv": ("18", "1", 10.0)}),
        ("crossroads-s2", 23.0, {"bv": ("40", "1", 1.303)}),
        # BV from D, which ends at the junction
        ("crossroads-s3", 7.0, {"bv": ("0", "-1", 47.907)}),
    ],
)  # fmt: skip
def test_places_on_town05(individuals, town, name, start, expected):
    scenario = convert(individuals(name, site=town(), bv_start=start))
    found = positions(scenario)
    for who, (road_id, lane_id, s) in expected.items():
        if s is not None:
            assert found[who][:2] == (road_id, lane_id)
            assert found[who][2] == pytest.approx(s, abs=1e-9)
    assert read(to_xml(scenario)) == scenario


def test_a_bound_place_stays_bound(individuals, town):
    bv = {
        start: only_start(convert(individuals("crossroads-s2", site=town(), bv_start=start)))
        for start in (10.0, 23.0)
    }
    assert bv[10.0] == osc.ParameterRef("$bv_start")
    assert bv[23.0] == Expr("${($bv_start)-21.697}")
    reverse = only_start(convert(individuals("crossroads-s3", site=town(), bv_start=7.0)))
    assert reverse == Expr("${54.907-($bv_start)}")


def only_start(scenario):
    private = next(p for p in scenario.storyboard.init.actions.privates if p.entity_ref == "bv")
    return private.private_actions[0].action.position.position.s


def test_an_edited_distance_moves_on_to_the_road_that_holds_it(individuals, town, edited):
    source = individuals("crossroads-s1", site=town())
    near = edited(source, "ego_start", "has_distance", 5.0)  # still on road 47's lane
    assert positions(convert(near))["ego"] == ("17", "-1", pytest.approx(6.614, abs=1e-9))
    lane = edited(near, "ego_start", "on_lane", "leg_C_in_2")
    far = edited(lane, "ego_start", "has_distance", 11.614 + 54.414)
    assert positions(convert(far))["ego"] == ("47", "-2", 0.0)


# -- weather ---------------------------------------------------------------------------------------


def at(formula, x):
    return float(parse(formula).evaluate({"x": x}))


@pytest.mark.parametrize(
    ("formula", "x", "value"),
    [
        (laws.RAIN.formula, 0.0, 0.0),
        (laws.RAIN.formula, 50.0, 0.1 * math.sqrt(500)),
        (laws.RAIN.formula, 100.0, 50.0),
        (laws.VISIBILITY.formula, 0.0, 10_000.0),
        (laws.VISIBILITY.formula, 100.0, 50.0),
        (laws.WIND.formula, 0.0, 0.0),
        (laws.WIND.formula, 100.0, 20.0),  # Beaufort 8, a gale: 17.2 to 20.7 m/s
        (laws.ELEVATION.formula, -90.0, -math.pi / 2),
        (laws.AZIMUTH.formula, 90.0, math.pi / 2),
        (laws.AZIMUTH.formula, -31.25, 2 * math.pi - math.radians(31.25)),
        (laws.AZIMUTH.formula, 360.0, 0.0),
        (laws.ILLUMINANCE, 90.0, 100_000.0),
        (laws.ILLUMINANCE, 30.0, 50_000.0),
        (laws.ILLUMINANCE, 0.0, 0.0),
        (laws.ILLUMINANCE, -0.1, 0.0),
        (laws.ILLUMINANCE, -90.0, 0.0),
    ],
)
def test_conversions_by_hand(formula, x, value):
    assert at(formula, x) == pytest.approx(value, rel=1e-12, abs=1e-12)


@given(st.floats(0, 90))
def test_illuminance_is_the_sine(degrees):
    assert at(laws.ILLUMINANCE, degrees) == pytest.approx(
        1e5 * math.sin(math.radians(degrees)), abs=170
    )


@given(st.floats(-90, 90))
def test_an_azimuth_is_a_turn(degrees):
    radians = at(laws.AZIMUTH.formula, degrees)
    assert 0.0 <= radians <= 2 * math.pi
    assert math.cos(radians) == pytest.approx(math.cos(math.radians(degrees)), abs=1e-9)
    assert math.sin(radians) == pytest.approx(math.sin(math.radians(degrees)), abs=1e-9)


@pytest.mark.parametrize(
    ("percent", "oktas"),
    [(0, "zero"), (0.1, "one"), (12.5, "one"), (50, "four"), (99.9, "seven"), (100, "eight")],
)
def test_cloud_cover_in_oktas(percent, oktas):
    assert weather.COVER.text(percent) == f"{oktas}Oktas"


@pytest.mark.parametrize(
    ("percent", "wetness"), [(0, "dry"), (39.9, "moist"), (40, "wetWithPuddles")]
)
def test_wetness_classes(percent, wetness):
    assert weather.WETNESS.text(percent) == wetness


@pytest.mark.parametrize(
    ("altitude", "time"),
    [(-90, "00:00:00"), (-20, "06:00:00"), (15, "08:00:00"), (50, "12:00:00"), (51, "12:00:00")],
)
def test_the_time_of_day_follows_the_sun(altitude, time):
    assert weather.TIME.text(altitude).endswith(f"T{time}")


def test_weather_in_the_file_is_what_the_formulas_say(individuals):
    changed = {"precipitation": 50.0, "fog_density": 100.0, "sun_altitude_angle": -20.0}
    changed |= {"cloudiness": 100.0, "wetness": 10.0, "friction": 0.95, "wind_intensity": 80.0}
    scenario = read(to_xml(convert(individuals(**changed))))
    numbers = parameters.numbers(scenario)
    sky = only(scenario, osc.Weather)

    def now(value):
        return float(resolve(value, numbers))

    assert now(sky.precipitation.precipitation_intensity) == pytest.approx(2.2360679775)
    assert now(sky.fog.visual_range) == pytest.approx(50.0)
    assert now(sky.wind.speed) == pytest.approx(16.0)
    assert now(sky.sun.elevation) == pytest.approx(-math.pi / 9)
    assert now(sky.sun.illuminance) == 0.0
    texts = parameters.values(scenario)
    assert texts[sky.fractional_cloud_cover.name] == "eightOktas"
    road = only(scenario, osc.RoadCondition)
    assert now(road.friction_scale_factor) == 0.95
    assert texts[road.wetness.name] == "moist"
    assert road.properties.get("precipitation") == osc.ParameterRef("$precipitation")
    assert len(road.properties.properties) == 11


def test_expressions_hold_only_what_the_standard_has_in_1_2(individuals):
    allowed = {"floor", "ceil", "pow", "sqrt", "round"}
    scenario = convert(individuals())
    expressions = [
        value for e in walk(scenario) for value in vars(e).values() if isinstance(value, Expr)
    ]
    assert len(expressions) == 6
    for expression in expressions:
        words = set(
            "".join(c if c.isalpha() or c in "_$" else " " for c in expression.text).split()
        )
        assert {w for w in words if not w.startswith("$")} <= allowed


def test_an_edit_within_the_range_is_an_edit_like_any_other(individuals, edited):
    source = edited(individuals(), "ego_init_speed", "has_target_speed", 5.0)
    assert parameters.numbers(read(to_xml(convert(source))))["ego_speed"] == 5.0


def test_numbers_that_are_bound_to_nothing_are_literals(individuals, edited):
    source = individuals(fog_density=100.0)
    for node in ("weather_fog", "weather_rain", "bv_start"):
        source = edited(source, node, "has_parameter")
    kept = [
        q.object
        for q in source.quads
        if q.predicate.value.endswith("has_parameter_declaration")
        and not any(w in q.object.value for w in ("fog", "precipitation", "bv_start"))
    ]
    quads = [q for q in source.quads if not q.predicate.value.endswith("parameter_declaration")]
    quads += [
        q
        for q in source.quads
        if q.predicate.value.endswith("parameter_declaration") and q.object in kept
    ]
    scenario = convert(Individuals(quads))
    sky = only(scenario, osc.Weather)
    assert sky.fog.visual_range == pytest.approx(50.0)
    assert only(scenario, osc.RoadCondition).properties.get("fog_density") == "100.0"
    assert only_start(scenario) == 16.0
    assert read(to_xml(scenario)) == scenario


def test_a_scenario_without_weather_or_events(individuals, edited):
    source = edited(edited(individuals(), "scenario", "has_weather"), "scenario", "has_event")
    # what nobody carries now carries its value itself: parameters of weather and event
    names = [q.object.value.rpartition("#")[2] for q in source.quads
             if q.predicate.value.endswith("has_parameter_declaration")]  # fmt: skip
    assert "p_bv_speed" in names
    scenario = convert(source)
    assert scenario.storyboard.init.actions.global_actions == ()
    assert scenario.storyboard.stories == ()
    assert read(to_xml(scenario)) == scenario


# -- what individuals may lack or contradict -------------------------------------------------------


@pytest.mark.parametrize(
    ("edits", "text"),
    [
        ([("ego_start", "on_lane")], "must have on_lane, and has none"),
        ([("ego_start", "on_lane", "scenario")], "must be a lane of one of the intersection's"),
        ([("ego_start", "has_distance", 60.1)], "must lie on its leg, 0 to 60.0"),
        ([("ego_start", "has_distance", -1.0)], "must lie on its leg"),
        ([("ego_start", "has_distance", "far")], "finite number"),
        (
            [("leg_C", "has_junction_end", "middle")],
            "must be 'start' or 'end', or 'none' of a road that meets no junction, got 'middle'",
        ),
        ([("leg_C", "has_continuation", "leg_C")], "must not continue itself"),
        ([("leg_C", "has_road_id")], "must have has_road_id"),
        ([("ego_init_speed", "has_target_speed", 3.0)], "ego_speed [m/s] must be 4.9 to 8.9"),
        ([("bv_start", "has_distance", 40.1)], "bv_start [m] must be 7.0 to 25.0"),
        ([("p_bv_start", "binds_property", "has_length")], "bv_start must have a value"),
        ([("bv_init_speed", "has_parameter", "p_ego_speed")], "must have one value, got 0.0 on"),
        ([("p_ego_speed", "has_axis", "static")], "bound to a dynamic parameter"),
        ([("p_ego_speed", "has_name", "ego speed")], "an identifier of its own, got 'ego speed'"),
        ([("p_ego_speed", "has_name", "floor")], "an identifier of its own, got 'floor'"),
        ([("p_ego_speed", "has_name", "lambda")], "an identifier of its own, got 'lambda'"),
        ([("p_ego_speed", "has_name", "bv_speed")], "parameter bv_speed is declared twice"),
        ([("p_ego_speed", "has_name", "road_wetness")], "reserved name road_wetness"),
        ([("scenario", "has_participant", "bv")], "must have the name ego, got bv"),
        ([("scenario", "has_participant")], "got none"),
        ([("bv", "has_name", "=ego")], "participants must have different names, got ego twice"),
        ([("bv", "has_name", "$bv")], "must not begin with $, got '$bv'"),
        ([("scenario", "has_participant", "ego")], "has_who of"),
        ([("ego", "has_init_action", "ego_init_speed")], "must have one TeleportAction"),
        ([("ego", "has_init_action", "ego_teleport", "ego_init_speed", "bv_init_speed")],
         "at most one SpeedAction"),
        ([("ego", "has_wheelbase")], "must have has_wheelbase"),
        ([("bv_sets_off", "has_what")], "must have has_what"),
        ([("bv_sets_off_trigger", "has_condition")], "must have has_condition"),
        ([("bv_sets_off_condition_2", "has_entity_ref", "leg_C")], "must be a participant"),
        ([("p_precipitation", "has_high", 1e7), ("weather_rain", "has_precipitation", 1e6)],
         "must have a finite value"),
        ([("weather_wind", "has_wind_intensity")], "wind_intensity must have a value"),
    ],
)  # fmt: skip
def test_contradictions_are_named(individuals, edited, edits, text):
    source = individuals()
    for edit in edits:
        source = edited(source, *edit)
    with pytest.raises(OntologyError) as caught:
        convert(source)
    assert text in str(caught.value)


@pytest.mark.parametrize(
    ("node", "cls", "text"),
    [
        ("bv", "TrafficParticipant", "bv (TrafficParticipant) must be one of Car, Van, "),
        ("bv_sets_off_action", "Action", "must be one of SpeedAction, LaneChangeAction"),
        ("bv_sets_off_condition_1", "Condition", "must be a condition that can be written"),
    ],
)
def test_what_cannot_be_written_yet_is_named(individuals, retyped, node, cls, text):
    with pytest.raises(UnsupportedError) as caught:
        convert(retyped(individuals(), node, cls))
    assert text in str(caught.value)


def test_two_events_need_two_names(individuals, edited):
    source = individuals()
    again = edited(source, "scenario", "has_event", "bv_sets_off", "bv_sets_off_action")
    again = edited(again, "bv_sets_off_action", "has_name", "=bv_sets_off")
    again = edited(again, "bv_sets_off_action", "has_who", "bv")
    again = edited(again, "bv_sets_off_action", "has_what", "bv_sets_off_action")
    again = edited(again, "bv_sets_off_action", "has_when", "bv_sets_off_trigger")
    with refuses(OntologyError, "events"):
        convert(again)


def test_lanes_must_go_on_along_the_leg(individuals, town, road, edited):
    narrow = town(C=(road("17", 11.614, "end", lanes=1), road("47", 54.414, "end")))
    source = individuals("crossroads-s1", site=narrow)
    near = edited(source, "ego_start", "has_distance", 5.0)
    with refuses(OntologyError, "road 17"):
        convert(near)
