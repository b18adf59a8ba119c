"""What other people's maps hold beside the road: a small map that has one of each."""

import pytest

from bridgegen.openx.opendrive.from_owl.furniture import ranges
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.read import read
from bridgegen.openx.opendrive.to_owl import individuals_from_opendrive
from bridgegen.openx.opendrive.to_owl.network import losses
from bridgegen.scenario.ontology.check import check
from bridgegen.scenario.ontology.graph import Individuals

WIDTH = '<width sOffset="0" a="3" b="0" c="0" d="0"/>'
LANES = f"""<lanes><laneSection s="0"><left>
<lane id="2" type="driving">{WIDTH}<roadMark sOffset="0" type="solid" color="white"/></lane>
<lane id="1" type="driving">{WIDTH}<roadMark sOffset="0" type="broken" color="white"/>
<roadMark sOffset="50" type="solid" color="white"/></lane></left>
<center><lane id="0"><roadMark sOffset="0" type="solid solid" color="yellow"/></lane></center>
<right><lane id="-1" type="driving">{WIDTH}<roadMark sOffset="0" type="wavy" color="white"/></lane>
<lane id="-2" type="sidewalk">{WIDTH}<roadMark sOffset="0" type="none" color="white"/></lane>
</right></laneSection></lanes>"""
OBJECTS = """<objects>
<object id="1" type="crosswalk" s="20" t="0" hdg="1.5707963267948966" length="9" width="4"/>
<object id="2" type="crosswalk" s="30" t="0" hdg="1.5707963267948966"><outline>
<cornerLocal u="-5" v="-1.5" z="0" height="0"/><cornerLocal u="5" v="-1.5" z="0" height="0"/>
<cornerLocal u="5" v="1.5" z="0" height="0"/><cornerLocal u="-5" v="1.5" z="0" height="0"/>
</outline></object>
<object id="3" type="crosswalk" s="40" t="0"/>
<object id="4" type="roadMark" subtype="signalLines" s="10" t="3" length="0.4" width="6" hdg="0"/>
<object id="5" type="streetLamp" s="12" t="-8"/><object id="6" type="pole" s="13" t="-8"/>
<object id="7" type="pole" name="Street_Light_3" s="14" t="-8"/>
<object id="8" type="tree" s="15" t="-9"/><object id="9" s="15" t="-9"/></objects>"""
SIGN = '<signal id="{}" s="10" t="-7" dynamic="no" orientation="+" type="{}" {}/>'
SIGNALS = f"""<signals>
<signal id="10" s="10" t="-7" dynamic="yes" orientation="+" type="1000001">
<validity fromLane="1" toLane="1"/></signal>
<signal id="11" s="10" t="-7" dynamic="yes" orientation="-" type="1000001"/>
<signal id="12" s="10" t="-7" dynamic="yes" orientation="none" type="1000001"/>
{SIGN.format(20, 206, 'country="DE"')}{SIGN.format(21, 205, "")}
{SIGN.format(22, 274, 'value="30" unit="mph"')}{SIGN.format(23, 274, 'value="50"')}
{SIGN.format(24, 274, 'subtype="55"')}{SIGN.format(25, 123, 'country="OpenDRIVE"')}
{SIGN.format(26, 206, 'country="USA"')}{SIGN.format(27, 294, "")}
<signalReference id="30" s="5" t="0" orientation="-"/>
<signalReference id="99" s="5" t="0" orientation="-"/></signals>"""
GEOMETRY = '<geometry s="{}" x="{}" y="{}" hdg="{}" length="{}">{}</geometry>'
CUBIC = '<paramPoly3 aU="0" bU="40" cU="0" dU="0" aV="0" bV="0" cV="8" dV="0" pRange="normalized"/>'
TEXT = f"""<OpenDRIVE><header revMajor="1" revMinor="7"/>
<road id="1" length="100" junction="-1"><type s="0" type="rural"/><type s="50" type="town"/>
<planView>{GEOMETRY.format(0, 0, 0, 0, 60, "<line/>")}{GEOMETRY.format(60, 60, 0, 0, 40, CUBIC)}
</planView>{LANES}{OBJECTS}{SIGNALS}</road>
<road id="2" length="50" junction="-1"><type s="0" type="alley"/>
<planView>{GEOMETRY.format(0, 0, 99, 0, 50, "<line/>")}</planView>{LANES}<signals>
<signal id="30" s="1" t="7" dynamic="yes" orientation="+" type="1000001"/></signals></road>
<controller id="7" name="group"><control signalId="10"/><control signalId="11"/></controller>
<controller id="8"><control signalId="20"/><control signalId="404"/></controller></OpenDRIVE>"""


@pytest.fixture(scope="module")
def model() -> OpenDrive:
    return read(TEXT.encode())


@pytest.fixture(scope="module")
def these(model: OpenDrive) -> Individuals:
    return individuals_from_opendrive(model, "map.xodr")


def classes(these: Individuals) -> dict[str, str]:
    found = {}
    for name in ("Crosswalk", "TrafficFacility"):
        for node in these.of_class(name):
            object_id = these.optional_text(node, "has_object_id")
            if object_id is not None:
                found[object_id] = these.describe(node).rpartition("(")[2].rstrip(")")
    return found


def lanes(these: Individuals, object_id: str, link: str) -> list[tuple[str, int]]:
    (node,) = (
        node for node in these.of_class("TrafficFacility")
        if these.optional_text(node, "has_object_id") == object_id
    )  # fmt: skip
    owners = {
        lane: these.text(road, "has_road_id")
        for road in these.of_class("Road") for lane in these.links(road, "has_lane")
    }  # fmt: skip
    return sorted(
        (owners[one], these.integer(one, "has_lane_id")) for one in these.links(node, link)
    )


def test_all_of_it_keeps_the_rules(these: Individuals) -> None:
    assert [str(one) for one in check(these)] == []


def test_each_is_what_it_is(these: Individuals) -> None:
    assert classes(these) == {
        "1": "Crosswalk", "2": "Crosswalk", "3": "Crosswalk", "4": "StopLine", "5": "StreetLight",
        "7": "StreetLight", "10": "TrafficLight", "11": "TrafficLight", "12": "TrafficLight",
        "20": "StopSign", "21": "YieldSign", "22": "SpeedLimitSign", "23": "SpeedLimitSign",
        "24": "Signage", "25": "ConstructionCard", "26": "Signage", "27": "StopLine",
        "30": "TrafficLight",
    }  # fmt: skip


def test_widths_of_crosswalks_run_along_the_road(these: Individuals) -> None:
    widths = {
        these.text(node, "has_object_id"): these.optional_number(node, "has_width")
        for node in these.of_class("Crosswalk")
    }
    assert widths == {"1": pytest.approx(4.0), "2": pytest.approx(3.0), "3": None}


def test_speed_limits_are_in_metres_per_second(these: Individuals) -> None:
    limits = [these.number(node, "has_speed_limit") for node in these.of_class("SpeedLimitSign")]
    assert sorted(limits) == pytest.approx([30 * 0.44704, 50 / 3.6])


def test_lights_govern_lanes(these: Individuals) -> None:
    """As the validity says; without one, all lanes of the orientation (OpenDRIVE 1.7, 14.2)."""
    assert lanes(these, "10", "governs_lane") == [("1", 1)]
    assert lanes(these, "11", "governs_lane") == [("1", 1), ("1", 2)]
    assert lanes(these, "12", "governs_lane") == [("1", -1), ("1", 1), ("1", 2)]
    # Its own road's, and those of the road that refers to it
    assert lanes(these, "30", "governs_lane") == [("1", 1), ("1", 2), ("2", -1)]
    assert lanes(these, "20", "governs_lane") == []


def test_a_stop_line_marks_the_lanes_that_it_crosses(these: Individuals) -> None:
    assert lanes(these, "4", "marks_lane") == [("1", 1), ("1", 2)]


def test_controllers_switch_lights(these: Individuals) -> None:
    """One that switches no light is none."""
    controller = these.one("SignalController")
    assert these.text(controller, "has_name") == "group"
    assert these.text(controller, "has_object_id") == "7"
    lights = these.links(controller, "has_light")
    assert sorted(these.text(one, "has_object_id") for one in lights) == ["10", "11"]


def test_lines(these: Individuals) -> None:
    said = sorted(
        (
            these.text(these.link(line, "on_road"), "has_road_id"),
            these.text(line, "has_marking_type"),
            these.text(line, "has_marking_color"),
            tuple(
                sorted(these.integer(one, "has_lane_id") for one in these.links(line, "marks_lane"))
            ),
        )
        for line in these.of_class("LaneMarking")
        if not these.is_a(line, "StopLine")
    )
    assert said == [
        (road, style, color, ids)
        for road in ("1", "2")
        for style, color, ids in (
            ("broken", "white", (1,)), ("solid", "white", (1, 2)), ("solid solid", "yellow", ()),
        )
    ]  # fmt: skip


def test_a_cubic_keeps_its_length_and_its_curvatures(these: Individuals) -> None:
    """v = 8 p² over u = 40 p: curvature 16/40² at the start, 16·40/(40² + 16²)^1.5 at the end."""
    cubic = max(these.of_class("GeometrySegment"), key=lambda one: these.integer(one, "has_index"))
    assert these.number(cubic, "has_length") == 40.0
    assert these.number(cubic, "has_start_curvature") == pytest.approx(0.01)
    curvature = 640.0 / (40.0**2 + 16.0**2) ** 1.5
    assert these.number(cubic, "has_end_curvature") == pytest.approx(curvature)


def test_what_is_lost_is_said(model: OpenDrive) -> None:
    assert list(losses(model)) == [
        "1 stretches of reference line are cubics: their lengths and their curvatures at both ends "
        "are kept, their course between is not",
        "objects that the ontology has no class for are left out: none (1), pole (1), tree (1)",
        "1 roads change their type or speed limit: the first is kept",
        "lines of unknown kinds are left out: wavy (2)",
        "road types that the standard does not have are left out: alley",
    ]


def test_nothing_is_lost_of_town05(town05: OpenDrive) -> None:
    assert list(losses(town05)) == []


@pytest.mark.parametrize(
    ("ids", "said"),
    [
        ([], []), ([3], [(3, 3)]), ([2, 1, 3], [(1, 3)]), ([1, 3], [(1, 1), (3, 3)]),
        ([-1, 1], [(-1, 1)]), ([-2, -1, 2], [(-2, -1), (2, 2)]), ([-3, -1], [(-3, -3), (-1, -1)]),
    ],
)  # fmt: skip
def test_lanes_as_ranges(ids: list[int], said: list[tuple[int, int]]) -> None:
    """No range holds a lane that is not meant; there is no lane 0."""
    assert [(one.from_lane, one.to_lane) for one in ranges(ids)] == said
