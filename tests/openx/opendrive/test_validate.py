"""What is wrong with a road network is found and named: each planted fault, and nothing else."""

import contextlib
import dataclasses
import re
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.base.errors import BridgeGenError
from bridgegen.openx.opendrive import furniture
from bridgegen.openx.opendrive.model import (
    Junction,
    JunctionController,
    LaneSection,
    OpenDrive,
    RoadLink,
    Width,
)
from bridgegen.openx.opendrive.outline import outline
from bridgegen.openx.opendrive.plan_view import Geometry
from bridgegen.openx.opendrive.read import read
from bridgegen.openx.opendrive.routes import plan_route
from bridgegen.openx.opendrive.validate import problems
from bridgegen.openx.opendrive.write import to_xml


def test_town05_is_sound(town05: OpenDrive) -> None:
    assert problems(town05) == []


def test_corners_are_sound(
    corners: list[dict[str, float]], crossroads: Callable[..., OpenDrive]
) -> None:
    for values in corners:
        assert problems(crossroads(*values.values())) == []


@given(data=st.data())
def test_any_crossroads_is_sound(
    data: st.DataObject, static: Any, crossroads: Callable[..., OpenDrive]
) -> None:
    assert problems(crossroads(*data.draw(static).values())) == []


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        # Road 1's line starts at (0, -13); the way 101 leads from its lane 1 to lane -1 of road 2.
        ('<geometry s="0.0" x="0.0" y="-13.0"', '<geometry s="0.0" x="0.0" y="-13.2"',
         "junction 100, connection 0: lane -1 of road 101 after lane 1 of road 1 must begin where"),
        ('y="-13.0" hdg="-1.57', 'y="-13.0" hdg="-1.67', "got a gap of"),
        ('id="1" length="60.0"', 'id="1" length="59.0"',
         "road 1: length must be that of its geometry, 60 m, got 59"),
        ('<geometry s="0.0"', '<geometry s="0.5"', "road 1: geometry 0 must start at 0 m, got 0.5"),
        ("<line/>", '<spiral curvStart="0" curvEnd="0"/>',
         "road 1: geometry 0: a spiral's curvatures must differ, got 0 for both"),
        ('sOffset="0.0" a="3.5"', 'sOffset="0.0" a="-3.5"',
         "road 1, laneSection at s=0 m, lane 2: width must be ≥ 0 m, got -3.5"),
        ('sOffset="0.0" a="3.5" b="0.0"', 'sOffset="0.0" a="3.5" b="-0.1"',
         "lane 2: width must be ≥ 0 m, got -2.5"),
        ('sOffset="0.0" a="3.5" b="0.0"', 'sOffset="9.0" a="3.5" b="0.0"',
         "lane 2: the first width must start at sOffset=0 m, got 9"),
        ('<laneSection s="0.0"', '<laneSection s="2.0"',
         "road 1: the first laneSection must start at s=0 m, got 2"),
        ('<laneSection s="0.0"', '<laneSection s="70.0"',
         "road 1: the laneSection at s=70 m must start before the road's end, 60 m"),
        ('<successor id="-1"/>', '<successor id="-9"/>',
         "road 101, lane -1: lane -9 of road 2 at its end is not there"),
        ('<successor id="-1"/>', '<successor id="2"/>',
         "road 101, lane -1: lane 2 of road 2 at its end runs the other way"),
        ('<successor id="-1"/>', '<successor id="-2"/>',
         "road 101, lane -1: lane -2 of road 2 at its end must begin where it ends, got a gap of"),
        ('<laneLink from="1" to="-1"/>', "", "junction 100, connection 0: a laneLink is required"),
        ('<laneLink from="1" to="-1"/>', '<laneLink from="-1" to="-1"/>',
         "connection 0: lane -1 of road 1 does not lead into the junction"),
        ('connectingRoad="101" contactPoint="start"', 'connectingRoad="101" contactPoint="end"',
         "junction 100, connection 0: the end of road 101 must link to road 1, got road 2"),
        ('<predecessor elementType="road" elementId="1" contactPoint="start"/>',
         '<predecessor elementType="road" elementId="1" contactPoint="end"/>',
         "road 101: its start is at the end of road 1, which must link back to junction 100, got"),
        ('<predecessor elementType="junction" elementId="100"/>',
         '<predecessor elementType="junction" elementId="100"/>'
         '<successor elementType="road" elementId="2" contactPoint="end"/>',
         "road 1: its end is at the end of road 2, which must link back to road 1, got nothing"),
    ],
)  # fmt: skip
def test_planted_faults(
    old: str, new: str, said: str, crossroads: Callable[..., OpenDrive]
) -> None:
    text = to_xml(crossroads()).decode()
    assert old in text
    found = problems(read_unchecked(text.replace(old, new, 1)))
    assert any(said in problem for problem in found), found


def read_unchecked(text: str) -> OpenDrive:
    """Read, but let broken references through to the validator."""
    from unittest.mock import patch

    with patch("bridgegen.openx.opendrive.read.broken_references", lambda model: iter(())):
        return read(text.encode())


def test_road_and_junction_of_one_id(crossroads: Callable[..., OpenDrive]) -> None:
    text = to_xml(crossroads()).decode().replace('"100"', '"3"')
    assert problems(read(text.encode())) == [
        "a junction's id must differ from every road's, got '3' for both "
        "(CARLA then finds no way into the junction)"
    ]


def test_way_that_no_connection_enters(crossroads: Callable[..., OpenDrive]) -> None:
    model = crossroads(lanes=1)
    junction = model.junctions[0]
    fewer = dataclasses.replace(junction, connections=junction.connections[3:])
    assert problems(dataclasses.replace(model, junctions=(fewer,))) == [
        "junction 100: no connection leads into its road 101",
        "junction 100: no connection leads into its road 102",
        "junction 100: no connection leads into its road 103",
        "junction 100: no way on for lane 1 of road 1",
    ]


def test_broken_references_come_alone(crossroads: Callable[..., OpenDrive]) -> None:
    model = crossroads()
    lost = dataclasses.replace(model.roads[0], successor=RoadLink("road", "77", "start"))
    found = problems(dataclasses.replace(model, roads=(lost, *model.roads[1:])))
    assert found == ["road 1: its successor, road '77', is not in the file"]


def test_faults_within_a_road(crossroads: Callable[..., OpenDrive]) -> None:
    model = crossroads()
    road = model.roads[0]
    section = road.sections[0]
    first = dataclasses.replace(section.left[0], successors=(2, 7, -1))
    begin = dataclasses.replace(section, left=(first, *section.left[1:]))
    onward = dataclasses.replace(section, s=20.0)
    line = road.plan_view[0]
    bent = (
        dataclasses.replace(line, length=30.0),
        Geometry(30.0, line.x, line.y - 31.0, line.hdg + 0.1, 30.0, line.shape),
    )
    changed = dataclasses.replace(
        road,
        plan_view=bent,
        sections=(begin, onward, LaneSection(10.0, center=section.center)),
        signals=(furniture.Signal("5", 61.0, 0.0, "no", "+", "274"),),
        objects=(furniture.Object("6", 99.0, 0.0),),
    )
    found = problems(dataclasses.replace(model, roads=(changed, *model.roads[1:])))
    for said in (
        "road 1: geometry 1 must begin where the one before ends, got a gap of 1 m and 0.1 rad",
        "road 1: laneSections must be in order of s, got 10 after 20 m",
        "lane 2: its successor 2 must link back to it, got nothing",
        "lane 2: its successor 7 is not in the section at s=20 m",
        "lane 2: its successor -1 must link back to it, got nothing",
        "road 1: signal 5 must have s ≤ 60 m, got 61",
        "road 1: object 6 must have s ≤ 60 m, got 99",
    ):
        assert any(said in problem for problem in found), (said, found)


def test_lane_without_width_and_one_that_pinches(crossroads: Callable[..., OpenDrive]) -> None:
    model = crossroads()
    road = model.roads[0]
    section = road.sections[0]
    bare = dataclasses.replace(section.left[0], widths=())
    # 3 - 0.6·x + 0.02·x² is least, -1.5, at x = 15, within the road.
    pinched = dataclasses.replace(section.right[0], widths=(Width(0.0, 3.0, -0.6, 0.02, 0.0),))
    # From 12 m on a cubic that dips to 1 - 2·10·√10/(3·√3) … at x = √(10/3).
    cubic = (Width(0.0, 3.0, 0.0, 0.0, 0.0), Width(12.0, 1.0, -10.0, 0.0, 1.0))
    dipped = dataclasses.replace(section.right[1], widths=cubic)
    changed = dataclasses.replace(section, left=(bare, *section.left[1:]), right=(pinched, dipped))
    broken = dataclasses.replace(road, sections=(changed,))
    assert problems(dataclasses.replace(model, roads=(broken, *model.roads[1:]))) == [
        "road 1, laneSection at s=0 m, lane 2: a driving lane must have a width, got none",
        "road 1, laneSection at s=0 m, lane -1: width must be ≥ 0 m, got -1.5",
        "road 1, laneSection at s=0 m, lane -2: width must be ≥ 0 m, got -11.2",
    ]


def test_lane_ids_that_do_not_count_from_the_centre(crossroads: Callable[..., OpenDrive]) -> None:
    model = crossroads()
    road = model.roads[0]
    section = road.sections[0]
    far = dataclasses.replace(section.right[1], id=-3)
    changed = dataclasses.replace(section, center=(), right=(section.right[0], far))
    broken = dataclasses.replace(road, sections=(changed,))
    assert problems(dataclasses.replace(model, roads=(broken, *model.roads[1:]))) == [
        "road 1, laneSection at s=0 m: lanes on the right must count from -1, got [-1, -3]",
        "road 1, laneSection at s=0 m: the center must be one lane 0, got none",
    ]


def test_controllers(crossroads: Callable[..., OpenDrive]) -> None:
    model = crossroads()
    junction: Junction = dataclasses.replace(
        model.junctions[0], controllers=(JunctionController("8"), JunctionController("9"))
    )
    controller = furniture.Controller("8", controls=(furniture.Control("5"),))
    changed = dataclasses.replace(model, junctions=(junction,), controllers=(controller,))
    assert problems(changed) == [
        "controller 8: signal '5' is not in the file",
        "junction 100: controller '9' is not in the file",
    ]


@given(data=st.data())
def test_any_damaged_crossroads_is_judged(
    data: st.DataObject, crossroads: Callable[..., OpenDrive]
) -> None:
    """Whatever the reader lets through can be validated, drawn and travelled, or says why not."""
    text = to_xml(crossroads(lanes=1)).decode()
    values = list(re.finditer(r'(?<=")[^"<>]*(?=")', text[text.index("<road") :]))
    start = text.index("<road")
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.sampled_from(values))
        other = data.draw(st.sampled_from(values)).group()
        put = data.draw(st.sampled_from((other, other, "0", "-1", "2", "30.5", "1e5", "-0.3")))
        text = text[: start + at.start()] + put + text[start + at.end() :]
        values = [one for one in values if one.end() < at.start()] or values[:1]
    try:
        model = read(text.encode())
    except BridgeGenError:
        return
    for sentence in problems(model):
        assert re.search(r"road|junction|controller", sentence)
    for act in (
        lambda: outline(model),
        lambda: plan_route(model, ("1", 1, 10.0), [], ("3", -1, 10.0)).sample(0.5),
    ):
        with contextlib.suppress(BridgeGenError):
            act()
