"""The markings between lanes, and which changes of lane they allow.

Source: ASAM OpenDRIVE 1.7, section 9.6 (road markings): a lane's record describes its outer
border, lane 0's the line between both sides; of a double line the inner one is named first, of
lane 0's the left one.
"""

from itertools import pairwise

from bridgegen.openx.opendrive.lanes import section_end
from bridgegen.openx.opendrive.model import LaneSection, Road, RoadMark

NONE = "none"

CROSSED = frozenset(("none", "broken", "botts dots", "custom"))
"""Types of line that one may cross."""

UPWARDS, DOWNWARDS = ("increase", "both"), ("decrease", "both")
"""Values of laneChange that allow a change to a lane of a higher id, and of a lower one."""


def neighbour(road: Road, lane_id: int, side: int) -> int:
    """Return the id that a lane beside another has, whether or not there is one.

    Args:
        road: the road.
        lane_id: of the other, not 0.
        side: 1: to the left of its traffic, -1: to the right.
    """
    found = lane_id + side * road.direction(lane_id)
    return found if found else found + side * road.direction(lane_id)


def between(lane_id: int, other: int) -> int:
    """Return the lane whose outer border lies between two lanes beside each other; 0: the centre.

    The lanes are neighbours, see `neighbour`.
    """
    return 0 if lane_id * other < 0 else min(lane_id, other, key=abs)


def marking(section: LaneSection, lane_id: int, s: float) -> RoadMark | None:
    """Return the marking of a lane's outer border, if there is one.

    Args:
        section: of lanes.
        lane_id: the lane; 0: the centre.
        s: from the start of the section [m].
    """
    lane = section.lane(lane_id) if lane_id else next(iter(section.center), None)
    held = None
    for one in sorted(lane.road_marks if lane else (), key=lambda each: each.s):
        if one.s <= s or held is None:
            held = one
    return held


def changes(section: LaneSection) -> list[float]:
    """Return where any marking of a section changes [m from its start]."""
    lanes = (*section.lanes, *section.center)
    return sorted({one.s for lane in lanes for one in lane.road_marks if one.s > 0.0})


def allows_change(mark: RoadMark | None, border: int, lane_id: int, other: int) -> bool:
    """Return whether a marking allows to change from a lane to the one beside it.

    The attribute ``laneChange`` decides where the file has it, else the type: one may cross a line
    that is not solid, and of a double line if the one on one's own side is not.

    Args:
        mark: between both lanes; None: there is none.
        border: the lane whose outer border it marks, see `between`.
        lane_id: the lane.
        other: the lane beside it.
    """
    if mark is None:
        return True
    if mark.lane_change is not None:
        return mark.lane_change in (UPWARDS if other > lane_id else DOWNWARDS)
    lines = mark.type.split() if mark.type not in CROSSED else [mark.type]
    is_first = lane_id > other if border == 0 else lane_id == border
    return lines[0 if is_first else -1] in CROSSED


def marked_stretches(road: Road, number: int) -> list[tuple[float, float]]:
    """Return the stretches of a lane section on which no marking changes [m along the road]."""
    section, end = road.sections[number], section_end(road, number)
    cuts = [section.s, *(section.s + s for s in changes(section) if section.s + s < end), end]
    return list(pairwise(cuts))
