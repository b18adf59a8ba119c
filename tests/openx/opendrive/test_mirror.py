"""Road networks in the mirror: geometry with y as −y, twice the same to the last bit."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.base.errors import FileFormatError
from bridgegen.openx.opendrive.declaration import plan
from bridgegen.openx.opendrive.furniture import CornerLocal, Object, Outline, Signal, Validity
from bridgegen.openx.opendrive.lanes import lane_pose
from bridgegen.openx.opendrive.mirror import NEGATED, as_written, mirrored, right_hand
from bridgegen.openx.opendrive.model import (
    Header,
    Lane,
    LaneSection,
    OpenDrive,
    Road,
    RoadMark,
    Width,
)
from bridgegen.openx.opendrive.outline import outline_of
from bridgegen.openx.opendrive.plan_view import (
    Arc,
    Cubic,
    Geometry,
    Line,
    ParamPoly3,
    Spiral,
)
from bridgegen.openx.opendrive.read import read
from bridgegen.openx.opendrive.write import to_xml

number = st.floats(-50.0, 50.0)
small = st.floats(-0.05, 0.05)
shapes = st.one_of(
    st.just(Line()),
    st.builds(Arc, small),
    st.builds(Spiral, small, small),
    st.builds(
        ParamPoly3,
        *map(st.just, (0.0, 60.0, 0.0, 0.0)),  # so long that its curve has the road's length
        *(st.floats(-1e-3, 1e-3) for _ in "abcd"),
    ),
)  # fmt: skip


@st.composite
def roads(draw):
    """Draw a road with two lanes to its left and one to its right, with what stands beside it."""
    lanes = [Lane(k, "driving", widths=(Width(0.0, 3.0 + k / 4, 0.0, 0.0, 0.0),)) for k in (1, 2)]
    right = Lane(
        -1, "driving", widths=(Width(0.0, 3.5, draw(small) / 9, 0.0, 0.0),),
        road_marks=(RoadMark(0.0, "solid", lane_change="increase"),),
    )  # fmt: skip
    centre = Lane(0, "none", road_marks=(RoadMark(0.0, "solid broken"),))
    corners = tuple(CornerLocal(u, v, 0.0, 0.0) for u, v in ((-1.0, -2.0), (1.0, -2.5), (1.0, 2.0)))
    return Road(
        "1",
        60.0,
        plan_view=(Geometry(0.0, draw(number), draw(number), draw(number), 60.0, draw(shapes)),),
        superelevations=(Cubic(0.0, draw(small), 0.0, 0.0, 0.0),),
        lane_offsets=(Cubic(0.0, draw(small), draw(small) / 9, 0.0, 0.0),),
        sections=(LaneSection(0.0, left=(lanes[1], lanes[0]), center=(centre,), right=(right,)),),
        objects=(
            Object(
                "o", 30.0, draw(number), hdg=draw(small), outline=Outline(corners_local=corners)
            ),
        ),
        signals=(Signal("s", 50.0, draw(number), "no", "+", "205", validity=(Validity(-1, 2),)),),
    )


def bits(model):
    """Return all that a network holds, so that 0.0 and -0.0 differ."""
    return repr(model)


@given(roads())
def test_the_mirror_of_the_mirror_is_the_network(road):
    model = OpenDrive(Header(1, 7, north=3.0, south=-7.0), (road,))
    image = mirrored(model)
    assert image.left_hand
    assert image.roads[0].rule == "LHT"
    assert bits(mirrored(image)) == bits(model)


@given(roads(), st.floats(0.0, 59.0), st.sampled_from([-1, 1, 2]))
def test_lanes_lie_at_minus_y_and_run_the_same_way(road, s, lane):
    image = mirrored(road)
    here, there = lane_pose(road, lane, s), lane_pose(image, -lane, s)
    assert (there.x, there.y) == (here.x, -here.y)
    assert math.remainder(there.h + here.h, math.tau) == pytest.approx(0.0, abs=1e-12)
    assert image.direction(-lane) == road.direction(lane)
    corners, others = outline_of(road, road.objects[0]), outline_of(image, image.objects[0])
    np.testing.assert_array_equal(others, corners * (1.0, -1.0))


@given(roads())
def test_a_file_drives_on_the_left_and_is_read_as_it_was(road):
    image = dataclasses.replace(OpenDrive(Header(1, 7), (road,)), left_hand=True)
    text = to_xml(image)
    assert b'rule="LHT"' in text
    assert bits(right_hand(read(text), "map")) == bits(image)
    assert as_written(image) == dataclasses.replace(read(text), left_hand=False)


def test_marks_of_two_lines_and_lane_changes_turn():
    section = LaneSection(
        0.0,
        center=(Lane(0, road_marks=(RoadMark(0.0, "solid broken"),)),),
        right=(Lane(-1, road_marks=(RoadMark(0.0, "solid broken", lane_change="increase"),)),),
    )
    image = mirrored(section)
    assert image.center[0].road_marks[0].type == "broken solid"  # from left to right
    assert image.left[0].road_marks[0].type == "solid broken"  # outwards
    assert image.left[0].road_marks[0].lane_change == "decrease"


def test_nothing_that_lies_aside_is_forgotten():
    """A number by such a name, in whatever class there will be, changes its sign."""
    seen, todo = set(), [OpenDrive]
    while todo:
        cls = todo.pop()
        seen.add(cls)
        fields = plan(cls)
        todo += [kind for f in fields for kind in f.types if dataclasses.is_dataclass(kind)]
        todo = [cls for cls in todo if cls not in seen]
        aside = {"t", "v", "y", "hdg", "roll", "h_offset", "curvature", "from_lane", "to_lane"}
        names = {f.name for f in fields} & aside
        assert names <= {*NEGATED.get(cls, ())} or cls is Validity, cls


@pytest.mark.parametrize("rules", [("LHT", "RHT"), ("RHT", "LHT")])
def test_a_map_with_both_rules_is_refused(rules):
    road = Road("1", 10.0, plan_view=(Geometry(0.0, 0.0, 0.0, 0.0, 10.0, Line()),))
    two = [dataclasses.replace(road, id=str(k), rule=rule) for k, rule in enumerate(rules)]
    with pytest.raises(FileFormatError, match=r"town\.xodr: all roads must have the same rule"):
        right_hand(OpenDrive(Header(1, 7), tuple(two)), "town.xodr")
