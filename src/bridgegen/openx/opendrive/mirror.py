"""Left-hand traffic as right-hand traffic in a mirror: a road network with y as −y.

What is simulated and judged drives on the right. A network with left-hand traffic is mirrored when
it is read for that, which `OpenDrive.left_hand` remembers, and mirrored again when it is written.
The mirror of the mirror is the network again, to the last bit.
"""

from dataclasses import replace
from typing import Any

from bridgegen.base.errors import FileFormatError
from bridgegen.openx.opendrive.declaration import plan
from bridgegen.openx.opendrive.furniture import (
    CornerLocal,
    CornerRoad,
    Object,
    Signal,
    SignalReference,
    Validity,
)
from bridgegen.openx.opendrive.model import (
    Border,
    Header,
    Lane,
    LaneLink,
    LaneSection,
    Offset,
    OpenDrive,
    Road,
    RoadMark,
)
from bridgegen.openx.opendrive.plan_view import Arc, Cubic, Geometry, ParamPoly3, Poly3, Spiral
from bridgegen.openx.opendrive.user_data import PREFIX, UserData

NEGATED: dict[type, tuple[str, ...]] = {
    Arc: ("curvature",),
    Border: ("a", "b", "c", "d"),
    CornerLocal: ("v",),
    CornerRoad: ("t",),
    Geometry: ("y", "hdg"),
    Lane: ("id", "predecessors", "successors"),
    LaneLink: ("from_lane", "to_lane"),
    Object: ("t", "hdg", "roll"),
    Offset: ("y", "hdg"),
    ParamPoly3: ("a_v", "b_v", "c_v", "d_v"),
    Poly3: ("a", "b", "c", "d"),
    Signal: ("t", "h_offset", "roll"),
    SignalReference: ("t",),
    Spiral: ("curv_start", "curv_end"),
}
"""The numbers that change their sign, by class."""

_WORDS = {"left": "right", "right": "left", "increase": "decrease", "decrease": "increase"}
_RULES = {"RHT": "LHT", "LHT": "RHT"}
_DOUBLE = {"solid broken": "broken solid", "broken solid": "solid broken"}
"""Marks of two lines, whose names go outwards; on a road's centre from left to right."""


def negated(value: Any) -> Any:
    """Return −value of a number or a tuple of them; None, and zero with its sign, stay."""
    if isinstance(value, tuple):
        return tuple(map(negated, value))
    # A zero keeps its sign: 0.0 in a file of either traffic is the same number here.
    return -value if value else value


def mirrored(record: Any) -> Any:
    """Return a road network, or a part of it, with y as −y and the other rule of traffic."""
    cls: type = type(record)
    changes = {name: negated(getattr(record, name)) for name in NEGATED.get(cls, ())}
    for field in plan(cls):
        value = getattr(record, field.name)
        if field.form.role == "children":
            changes[field.name] = tuple(map(mirrored, value))
        elif field.form.role in ("child", "choice") and value is not None:
            changes[field.name] = mirrored(value)
    record = replace(record, **changes)
    match record:
        case Road():
            return replace(
                record,
                rule=_RULES[record.rule],
                superelevations=tuple(map(_negative, record.superelevations)),
                lane_offsets=tuple(map(_negative, record.lane_offsets)),
            )
        case LaneSection():
            centre = tuple(replace(lane, road_marks=_turned(lane)) for lane in record.center)
            return replace(record, left=record.right[::-1], center=centre, right=record.left[::-1])
        case RoadMark(lane_change=change) if change is not None:
            return replace(record, lane_change=_WORDS.get(change, change))
        case Validity():
            return Validity(negated(record.to_lane), negated(record.from_lane))
        case Header():
            return replace(record, north=negated(record.south), south=negated(record.north))
        case UserData():
            return replace(record, value=_stated(record))
        case OpenDrive():
            return replace(record, left_hand=not record.left_hand)
    return record


def _negative(cubic: Cubic) -> Cubic:
    return Cubic(cubic.s, *(negated(getattr(cubic, name)) for name in "abcd"))


def _turned(lane: Lane) -> tuple[RoadMark, ...]:
    return tuple(replace(mark, type=_DOUBLE.get(mark.type, mark.type)) for mark in lane.road_marks)


def _stated(datum: UserData) -> str:
    """Return what a statement of ours says in the mirror."""
    if datum.code == f"{PREFIX}has_heading":
        return repr(negated(float(datum.value)))
    return _WORDS.get(datum.value, datum.value)


def right_hand(model: OpenDrive, place: str) -> OpenDrive:
    """Return a network that was read as it is simulated: with right-hand traffic.

    Args:
        model: as read.
        place: what to call it in messages.

    Raises:
        FileFormatError: some of its roads have left-hand traffic, some right-hand.
    """
    left = [road.id for road in model.roads if road.rule == "LHT"]
    if not left:
        return model
    right = [road.id for road in model.roads if road.rule == "RHT"]
    if right:
        raise FileFormatError(
            f"{place}: all roads must have the same rule to be simulated, got LHT (left-hand "
            f"traffic) of road {_few(left)} and RHT of road {_few(right)}"
        )
    image: OpenDrive = mirrored(model)
    return image


def as_written(model: OpenDrive) -> OpenDrive:
    """Return a network as it stands in its file."""
    image: OpenDrive = mirrored(model) if model.left_hand else model
    return image


def _few(ids: list[str]) -> str:
    return ", ".join(ids[:3]) + (f" and {len(ids) - 3} more" if len(ids) > 3 else "")
