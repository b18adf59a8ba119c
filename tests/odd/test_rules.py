"""Constraints between the layers, each against what is worked by hand from its source."""

import math
from dataclasses import replace

import pytest
from tests.approval import approve

from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.language.parameters import Axis, Parameter
from bridgegen.scenario.language.roads import LegSpec, RoadsSpec, Segment, usual
from bridgegen.scenario.language.rules import (
    bend,
    bounds_between_layers,
    cap,
    speed_bounds,
    speeds_of,
)
from bridgegen.scenario.language.story import (
    Change,
    EventSpec,
    LaneChange,
    Participant,
    SpeedChange,
    Story,
    Waypoint,
    WeatherChange,
)


def junction(**headings):
    """A junction of 26 m with lanes of 3.5 m, whose legs point away from it so [deg]."""
    roads = usual("crossroads", intersection_size=26.0, lane_width=3.5)
    legs = {name: LegSpec(heading) for name, heading in headings.items()}
    return RoadsSpec("crossroads", roads.knobs, legs)


def car(end="B", lane=1, *, name="bv", kind="car", speed="bv_speed", start="A"):
    stop = None if end is None else Waypoint(end, "out", 40.0)
    return Participant(name, kind, Waypoint(start, "in", 40.0, lane), stop, speed)


def radius(roads, one=None, **values):
    """The tightest radius of a route [m]; None where it is straight."""
    formula = bend(roads, one or car())
    return None if formula is None else float(parse(formula).evaluate(values))


# -- radius of a bend ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("lane", "heading", "expected"),
    [
        # From the south to the north-south road's left: the lane's centre enters at (1.75, -13)
        # and leaves at (-13, 1.75), a quarter of a circle of 14.75 m.
        (1, 180.0, 14.75),
        # To the right: from (1.75, -13) to (13, -1.75), 11.25 m.
        (1, 0.0, 11.25),
        # The second lane is 3.5 m further out: 13 + 5.25 and 13 - 5.25.
        (2, 180.0, 18.25),
        (2, 0.0, 7.75),
    ],
)
def test_a_quarter_turn_by_hand(lane, heading, expected):
    roads = junction(A=270.0, B=heading)
    assert radius(roads, car(lane=lane)) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("turn", [60.0, -60.0, 120.0, -120.0])
def test_the_arc_is_tangent_to_both_lanes(turn):
    """Its centre is as far from either lane's centre line, and its ends are 13 m along the legs."""
    roads = junction(A=270.0, B=90.0 + turn)
    found = radius(roads)
    # The way in goes north on x = 1.75; the circle's centre is level with its beginning, y = -13.
    cx, cy = 1.75 - math.copysign(found, turn), -13.0
    out = math.radians(90.0 + turn)
    beside = math.sin(out) * cx - math.cos(out) * cy  # right of the axis of the way out [m]
    assert beside - 1.75 == pytest.approx(-math.copysign(found, turn), rel=1e-9)
    assert math.cos(out) * cx + math.sin(out) * cy == pytest.approx(13.0)


@pytest.mark.parametrize(
    ("turn", "straight"),
    [(0.0, True), (44.9, True), (-44.9, True), (45.0, False), (-45.0, False), (59.0, False)],
)
def test_a_route_that_turns_by_45_degrees_bends(turn, straight):
    assert (radius(junction(A=270.0, B=90.0 + turn)) is None) is straight


def test_headings_that_differ_by_a_whole_turn_are_one():
    assert radius(junction(A=-90.0, B=540.0)) == pytest.approx(14.75)
    assert radius(junction(A=630.0, B=-360.0)) == pytest.approx(11.25)


def test_a_radius_is_two_metres_at_least():
    """In a junction of 6 m, the third lane from the middle turns right about its own corner."""
    roads = usual("crossroads", intersection_size=6.0)
    assert radius(roads, car("D", lane=3)) == 2.0  # 3 - 8.75 < 0
    assert radius(usual("crossroads", intersection_size=9.0), car("D")) == 2.75  # 4.5 - 1.75


def test_who_starts_beside_the_lanes_is_as_on_the_first():
    assert radius(junction(A=270.0, B=180.0), car(lane="sidewalk")) == pytest.approx(14.75)


def test_measures_may_be_parameters():
    roads = usual("crossroads", intersection_size="size", lane_width="width")
    assert radius(roads, car("B"), size=30.0, width=3.0) == pytest.approx(16.5)
    assert radius(roads, car("D"), size=30.0, width=3.0) == pytest.approx(13.5)


@pytest.mark.parametrize(("start", "end"), [("A", None), ("X", "B"), ("A", "X")])
def test_no_route_between_two_legs_no_bend(start, end):
    assert radius(usual("crossroads"), car(end, start=start)) is None


def test_a_ring_is_as_wide_as_it_says():
    assert radius(usual("roundabout", radius=17.0)) == 17.0
    assert radius(usual("roundabout", radius="r"), r=20.0) == 20.0
    assert radius(usual("roundabout"), car(None)) is None


def road(*bends):
    knobs = usual("road").knobs
    segments = tuple(Segment(50.0, first, last) for first, last in bends)
    return RoadsSpec("road", knobs, {}, segments)


def test_a_road_is_as_tight_as_its_sharpest_place():
    assert radius(road()) is None
    assert radius(road((0.0, 0.0))) is None
    assert radius(road((0.0, 0.01))) == pytest.approx(100.0)
    assert radius(road((0.0, 0.01), (-0.02, -0.02), (0.005, 0.0))) == pytest.approx(50.0)
    assert radius(road((0.0, "k"), (0.01, 0.0)), k=-0.04) == pytest.approx(25.0)
    assert radius(road(("k", "k")), k=0.0) == pytest.approx(1e6)  # as good as straight


# -- what is demanded ------------------------------------------------------------------------------


def parameters(*names):
    return {one: Parameter(one, Axis.PARTICIPANTS, "m/s", 0.0, 60.0, 10.0) for one in names}


def demanded(roads, story, *names, prefixes=()):
    """Return the limits of each parameter: its formulas."""
    found = {}
    for bound in bounds_between_layers(roads, story, parameters(*names), prefixes, "made.yaml"):
        assert bound.lo is None
        assert bound.why
        assert bound.place == "made.yaml"
        found.setdefault(bound.target, []).append(bound.hi)
    return found


WEATHER = {"speed_factor": 1.0, "friction": 1.0}


def limits(found, name, **values):
    return [float(one.evaluate(WEATHER | values)) for one in found[name]]


def test_tyres_hold_0_85_g_on_a_dry_road():
    """v² = 0.85 · 9.81 m/s² · 15 m = 125.0775 m²/s²: 11.1838 m/s (Wong, table 1.3)."""
    hurried = replace(car(), exceeds_limit="late")
    found = demanded(usual("roundabout", radius=15.0), Story((hurried,)), "bv_speed")
    assert limits(found, "bv_speed") == pytest.approx([11.183805], rel=1e-6)
    # a quarter of the friction, half of the speed
    assert limits(found, "bv_speed", friction=0.25) == pytest.approx([5.5919027], rel=1e-6)


def test_without_a_reason_no_vehicle_turns_at_more_than_4_m_s2():
    """v² = 4 m/s² · 15 m: 7.74597 m/s; on ice the tyres hold less, 0.25 · 0.85 g."""
    found = demanded(usual("roundabout", radius=15.0), Story((car(),)), "bv_speed")
    assert limits(found, "bv_speed") == pytest.approx([13.9, 7.7459667], rel=1e-6)
    assert limits(found, "bv_speed", friction=0.25)[1] == pytest.approx(5.5919027, rel=1e-6)


def test_the_speed_limit_is_lower_in_bad_weather():
    assert cap(13.9) == "13.9 * speed_factor"
    approve(cap("limit"), "speed_factor")
    both = parse(cap(20.0, ("", "later_")))
    for first, later, most in ((0.5, 0.8, 10.0), (0.9, 0.4, 8.0)):
        values = {"speed_factor": first, "later_speed_factor": later}
        assert float(both.evaluate(values)) == most


def test_the_worst_of_the_weathers_counts():
    found = demanded(
        usual("roundabout", radius=15.0), Story((car(),)), "bv_speed", prefixes=("later_",)
    )
    for first, later in ((1.0, 0.25), (0.25, 1.0)):
        weather = {"friction": first, "later_friction": later}
        weather |= {"speed_factor": first, "later_speed_factor": later}
        assert limits(found, "bv_speed", **weather) == pytest.approx([3.475, 5.5919027], rel=1e-6)


def test_the_ego_and_who_drives_no_motor_vehicle_may_risk_a_bend():
    """The limit of speed holds for all motor vehicles, the ego's included; a bend's not for it."""
    story = Story(
        (
            car(name="ego", speed="ego_speed"),
            car(name="rider", kind="bicycle", speed="rider_speed"),
            car(name="walker", kind="pedestrian", speed="walker_speed"),
            car(name="lorry", kind="truck", speed="lorry_speed"),
        )
    )
    names = ("ego_speed", "rider_speed", "walker_speed", "lorry_speed")
    found = demanded(usual("roundabout"), story, *names)
    assert {name: len(one) for name, one in found.items()} == {"ego_speed": 1, "lorry_speed": 2}


def test_on_a_straight_way_nothing_but_the_limit_holds():
    found = demanded(usual("crossroads"), Story((car("C"), car("B", name="b2", speed="s"))),
                     "bv_speed", "s")  # fmt: skip
    assert {name: len(one) for name, one in found.items()} == {"bv_speed": 1, "s": 2}


def test_speeds_of_events_are_limited_too_and_constants_are_not():
    change = Change(time=2.0)
    events = (
        EventSpec("one", "bv", (SpeedChange("later", change), LaneChange(1, change)), ()),
        EventSpec("two", "bv", (SpeedChange(3.0, change),), ()),
        EventSpec("three", "other", (SpeedChange("others", change),), ()),
        EventSpec("four", None, (WeatherChange("w_"),), ()),
    )
    one, other = car(), car(name="other", speed=7.0)
    story = Story((one, other), events)
    assert speeds_of(one, story) == ["bv_speed", "later", 3.0]
    assert speeds_of(other, story) == [7.0, "others"]
    found = demanded(usual("roundabout"), story, "bv_speed", "later", "others", "elsewhere")
    assert {name: len(one) for name, one in found.items()} == {
        "bv_speed": 2, "later": 2, "others": 2,
    }  # fmt: skip
    assert "later" not in demanded(usual("roundabout"), story, "bv_speed")  # derived, say


def test_speed_bounds_alone_are_those_of_the_limit():
    (bound,) = speed_bounds("limit", Story((car(),)), parameters("bv_speed"), (), "made.yaml")
    assert str(bound) == "bv_speed <= limit * speed_factor"


def test_a_closed_road_limits_each_weather():
    roads = usual("crossroads", closing_fog_density=60.0)
    found = demanded(roads, Story(), "fog_density", "w_fog_density", "precipitation",
                     prefixes=("w_", "v_"))  # fmt: skip
    assert {name: limits(found, name) for name in found} == {
        "fog_density": [60.0], "w_fog_density": [60.0],
    }  # fmt: skip
