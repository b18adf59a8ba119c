"""Left-hand traffic as right-hand traffic in a mirror: a scenario file with y as −y.

See `bridgegen.openx.opendrive.mirror`, which does the same with its map.
"""

import math
from dataclasses import replace
from enum import StrEnum
from typing import Any

from bridgegen.base.errors import FileFormatError
from bridgegen.openx.opendrive.mirror import negated
from bridgegen.openx.openscenario import actions as act
from bridgegen.openx.openscenario import conditions as con
from bridgegen.openx.openscenario import environment as env
from bridgegen.openx.openscenario import movement as mov
from bridgegen.openx.openscenario import positions as pos
from bridgegen.openx.openscenario.element import Element, rewritten
from bridgegen.openx.openscenario.entities import Center, OverrideSteeringWheelAction
from bridgegen.openx.openscenario.enumerations import AngleType, DirectionalDimension, Rule
from bridgegen.openx.openscenario.storyboard import OpenScenario
from bridgegen.openx.openscenario.traffic import Lane
from bridgegen.openx.openscenario.values import Expr, ParameterRef

NEGATED: dict[type[Element], tuple[str, ...]] = {
    Center: ("y",),
    Lane: ("id",),
    OverrideSteeringWheelAction: ("value",),
    mov.AbsoluteTargetLane: ("value",),
    mov.AbsoluteTargetLaneOffset: ("value",),
    mov.LaneChangeAction: ("target_lane_offset",),
    mov.RelativeTargetLane: ("value",),
    mov.RelativeTargetLaneOffset: ("value",),
    pos.Clothoid: ("curvature", "curvature_prime", "curvature_dot"),
    pos.ClothoidSplineSegment: ("curvature_start", "curvature_end", "h_offset"),
    pos.LanePosition: ("lane_id", "offset"),
    pos.Orientation: ("h", "r"),
    pos.PositionInLaneCoordinates: ("lane_id", "lane_offset"),
    pos.PositionInRoadCoordinates: ("t",),
    pos.RelativeLanePosition: ("d_lane", "offset"),
    pos.RelativeObjectPosition: ("dy",),
    pos.RelativeRoadPosition: ("dt",),
    pos.RelativeWorldPosition: ("dy",),
    pos.RoadPosition: ("t",),
    pos.TrajectoryPosition: ("t",),
    pos.WorldPosition: ("y", "h", "r"),
}
"""The numbers that change their sign, by class; lane ids are texts."""

SIDES: dict[type[Element], str] = {
    act.PedestrianGesture: "gesture",
    act.VehicleComponent: "vehicle_component_type",
    act.VehicleLight: "vehicle_light_type",
    mov.LateralDistanceAction: "displacement",
}
"""Words that name a side."""

TURNS: dict[type[Element], tuple[str, float]] = {
    env.DomeImage: ("azimuth_offset", 2.0 * math.pi),
    env.Sun: ("azimuth", 3.0 * math.pi),  # from north (+y), which becomes south
    env.Wind: ("direction", 2.0 * math.pi),
}
"""Angles within a turn [rad], and what they add up to with those in the mirror."""

_ALONG = (con.SpeedCondition, con.RelativeSpeedCondition, con.AccelerationCondition)
_ANGLES = (con.AngleCondition, con.RelativeAngleCondition)
_REVERSED = {
    Rule.GREATER_THAN: Rule.LESS_THAN,
    Rule.LESS_THAN: Rule.GREATER_THAN,
    Rule.GREATER_OR_EQUAL: Rule.LESS_OR_EQUAL,
    Rule.LESS_OR_EQUAL: Rule.GREATER_OR_EQUAL,
}


def mirrored(scenario: OpenScenario, place: str = "scenario") -> OpenScenario:
    """Return a scenario with y as −y; that of the result is the scenario again, to the last bit.

    Args:
        scenario: any one; parameters keep their values and their signs.
        place: what to call it in messages.

    Raises:
        FileFormatError: a parameter stands for a lane's id, a side, a rule or a direction; by line.
    """
    problems: list[str] = []
    has_expressions = scenario.file_header.rev_minor != 0

    def change(element: Element) -> Element:
        try:
            return _mirrored(element, has_expressions)
        except ValueError as error:
            problems.append(f"{place}: {error} (line {element.line})")
            return element

    found = rewritten(scenario, change)
    if problems:
        raise FileFormatError(*problems)
    return replace(found, left_hand=not scenario.left_hand)


def _mirrored(element: Element, has_expressions: bool) -> Element:
    cls = type(element)
    names = NEGATED.get(cls, ())
    if isinstance(element, _ANGLES) and _known(element, "angle_type") != AngleType.PITCH:
        names = ("angle",)
    elif isinstance(element, _ALONG) and element.direction is not None:
        if _known(element, "direction") == DirectionalDimension.LATERAL:
            rule = _known(element, "rule")
            element, names = replace(element, rule=_REVERSED.get(rule, rule)), ("value",)
    elif isinstance(element, con.RelativeLaneRange):
        return replace(element, from_=_negative(element.to), to=_negative(element.from_))
    changes: dict[str, Any] = {
        name: _lane(_known(element, name)) if name == "lane_id" else _negative(value)
        for name in names
        if (value := getattr(element, name)) is not None
    }
    if cls is mov.AbsoluteTargetLane:
        changes = {"value": _lane(_known(element, "value"))}
    if cls in SIDES and (word := _known(element, SIDES[cls])) is not None:
        changes[SIDES[cls]] = type(word)(_other_side(word))
    if cls in TURNS:
        name, total = TURNS[cls]
        if (value := getattr(element, name)) is not None:
            changes[name] = _turned(value, total, has_expressions)
    return replace(element, **changes)


def _known(element: Element, name: str) -> Any:
    value = getattr(element, name)
    if isinstance(value, ParameterRef):
        raise ValueError(
            f"{name} of {type(element).__name__} must be stated where traffic drives on the left, "
            f"for it is mirrored, got the parameter {value}"
        )
    return value


def _lane(text: str) -> str:
    """Return the id of a lane in the mirror."""
    return text[1:] if text.startswith("-") else text if text in ("", "0") else f"-{text}"


def _other_side(word: StrEnum) -> str:
    for side, other in (("left", "right"), ("Left", "Right")):
        if side in word:
            return word.replace(side, other)
        if other in word:
            return word.replace(other, side)
    return word


def _negative(value: Any) -> Any:
    """Return −value; of what parameters give, an expression, and of that one again the value."""
    if not isinstance(value, ParameterRef | Expr):
        return negated(value)
    return _inverse(value, "-(", "-({})")


def _turned(value: Any, total: float, has_expressions: bool) -> Any:
    """Return ``total`` − value within a turn, as an expression, of which the value is read again.

    As a number it may lose its last bits; if it does not, it is one.
    """
    turn = 2.0 * math.pi
    if isinstance(value, float):
        other = (total - value) % turn
        if not has_expressions or (total - other) % turn == value:
            return other
    rest = f"{total!r}-({{}})"
    return _inverse(value, f"{total!r}-(", f"{rest}-floor(({rest})/{turn!r})*{turn!r}")


def _inverse(value: Any, start: str, form: str) -> Any:
    """Return an expression of a form with the value in it; or what stands in one of that form."""
    body = str(value)[2:-1] if isinstance(value, Expr) else str(value)
    inside = _first_bracket(body[len(start) :]) if body.startswith(start) else None
    if inside is None or form.format(inside, inside) != body:
        return Expr(f"${{{form.format(body, body)}}}")
    if inside.startswith("$") and inside[1:].isidentifier():
        return ParameterRef(inside)
    try:
        return float(inside)
    except ValueError:
        return Expr(f"${{{inside}}}")


def _first_bracket(text: str) -> str | None:
    """Return a text up to the bracket that closes the one before it."""
    depth = 1
    for i, sign in enumerate(text):
        depth += (sign == "(") - (sign == ")")
        if depth == 0:
            return text[:i]
    return None
