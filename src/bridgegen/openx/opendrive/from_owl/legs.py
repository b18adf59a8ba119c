"""OWL2OpenDRIVE, its legs: from a road's individuals to an arm, with all that is wrong with it."""

import math
from collections.abc import Iterator
from typing import Literal

from bridgegen.base import elementary
from bridgegen.base.errors import OntologyError
from bridgegen.openx.opendrive.from_owl.arms import Arm, Strips
from bridgegen.openx.opendrive.from_owl.furniture import objects_on, signals_on
from bridgegen.openx.opendrive.user_data import UserData, user_datum
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import Subject

_SLACK = 1e-9
_CLOSES = ("closes_above_fog_density", "closes_above_precipitation")
_LATER = ("road", "marking")
_STRIPS = {"Shoulder": "shoulder", "Sidewalk": "sidewalk"}


def read_arm(
    individuals: Individuals, leg: Subject, problems: list[str], *, widens: bool = False
) -> Arm:
    """Return a leg to be built.

    Args:
        individuals: the road network.
        leg: a Road.
        problems: takes what is wrong.
        widens: it may have more lanes near the junction than are stated here (a merge's), so that
            of several lane sections the one farthest from there counts.

    Raises:
        OntologyError: a property is missing.
    """
    what = individuals.describe(leg)
    if individuals.links(leg, "has_continuation"):
        problems.append(f"{what}: a generated leg must be one road, got has_continuation")
    end = individuals.text(leg, "has_junction_end")
    if end not in ("start", "end", "none"):
        problems.append(f"{what}: has_junction_end must be start, end or none, got '{end}'")
    junction_end: Literal["start", "end", "none"] = (
        "end" if end == "end" else "none" if end == "none" else "start"
    )
    limit = individuals.optional_number(leg, "has_speed_limit")
    if limit is not None and not 0.1 <= limit <= 200.0:
        problems.append(f"{what}: has_speed_limit [m/s] must be 0.1 … 200, got {limit:g}")
    heading = 0.0
    if junction_end != "none":
        heading = individuals.number(leg, "has_heading")
    if not -360.0 <= heading <= 360.0:
        problems.append(f"{what}: has_heading [deg] must be -360 … 360, got {heading:g}")
    length = individuals.number(leg, "has_length")
    if not 1.0 <= length <= 10_000.0:
        problems.append(f"{what}: has_length [m] must be 1 … 10000, got {length:g}")
    bent = junction_end != "none" and any(
        individuals.optional_number(segment, name)
        for segment in individuals.links(leg, "has_segment")
        for name in ("has_start_curvature", "has_end_curvature")
    )
    if bent:
        problems.append(f"{what}: a generated leg must be straight, got a bend (has_segment)")
    grade = individuals.optional_number(leg, "has_grade") or 0.0
    if grade and junction_end != "none":
        problems.append(f"{what}: a generated leg must be level, got has_grade {grade:g}")
    lanes = _Lanes(individuals, leg, junction_end, problems, widens)
    arm = Arm(
        name=individuals.text(leg, "has_name"),
        road_id=read_id(individuals, leg, "has_road_id", problems),
        heading_deg=heading,
        length=length,
        junction_end=junction_end,
        speed_limit=limit,
        inbound=lanes.driving("in"),
        outbound=lanes.driving("out"),
        strips_in=lanes.strips("in"),
        strips_out=lanes.strips("out"),
        turns=lanes.turns(),
        road_type=individuals.optional_text(leg, "has_road_type") or "town",
        grade=grade,
        change=_change(individuals, leg, length, problems),
        objects=tuple(objects_on(individuals, leg, lanes.reach, length, problems)),
        signals=tuple(signals_on(individuals, leg, lanes.reach, junction_end, problems)),
        user_data=tuple(_about(individuals, leg, heading, junction_end)),
    )
    if junction_end == "end" and (arm.objects or arm.signals):
        problems.append(
            f"{what}: lights, signs and crosswalks are built on legs whose junction is at the "
            "road's start, or on a road that meets none"
        )
    return arm


def _change(
    individuals: Individuals, leg: Subject, length: float, problems: list[str]
) -> tuple[float, str, str] | None:
    """Return from where on a road is different [m], and its type and markings there."""
    at = individuals.optional_number(leg, "has_change_at")
    if at is not None and not 0.0 < at < length:
        what = individuals.describe(leg)
        problems.append(f"{what}: has_change_at [m] must lie on it, 0 to {length:g}, got {at:g}")
    kind, marking = (individuals.optional_text(leg, f"has_later_{x}_type") for x in _LATER)
    return None if at is None else (at, kind or "", marking or "")


def _about(
    individuals: Individuals, leg: Subject, heading: float, junction_end: str
) -> Iterator[UserData]:
    """Yield values of a road that OpenDRIVE cannot express, or only with rounding."""
    if junction_end != "none":
        yield user_datum("has_heading", heading)
    for name in _CLOSES:
        limit = individuals.optional_number(leg, name)
        if limit is not None:
            yield user_datum(name, limit)


class _Lanes:
    """The lanes of a road by direction, with all that is wrong with them.

    Attributes:
        reach: how far the road reaches to its left and to its right [m]: driving lanes, then all.
    """

    def __init__(
        self,
        individuals: Individuals,
        leg: Subject,
        junction_end: str,
        problems: list[str],
        widens: bool,
    ) -> None:
        self._individuals, self._what = individuals, individuals.describe(leg)
        self._end, self._problems = junction_end, problems
        self._lanes: dict[str, dict[int, tuple[str, float, frozenset[str]]]] = {"in": {}, "out": {}}
        usual = individuals.optional_number(leg, "has_lane_width")
        lanes, strips = individuals.links(leg, "has_lane"), individuals.links(leg, "has_strip")
        starts = {
            node: individuals.optional_number(node, "has_section_start") or 0.0
            for node in (*lanes, *strips)
        }
        if len(set(starts.values())) > 1 and not widens:
            problems.append(
                f"{self._what}: a generated road must have one lane section, got "
                f"{len(set(starts.values()))} (has_section_start)"
            )
        far = (min if junction_end == "end" else max)(starts.values(), default=0.0)
        for lane in (node for node in lanes if starts[node] == far):
            self._take(lane, "driving", usual)
        for strip in (node for node in strips if starts[node] == far):
            kind = next((k for name, k in _STRIPS.items() if individuals.is_a(strip, name)), None)
            self._take(strip, kind or individuals.text(strip, "has_lane_type"), None)
        for direction, count in (("in", "has_inbound_lanes"), ("out", "has_outbound_lanes")):
            self._check(direction, count, individuals.optional_integer(leg, count))
        left, right = ("out", "in") if junction_end == "end" else ("in", "out")
        self.reach = tuple(
            (sum(self.driving(side)), sum(w for _, w, _ in self._lanes[side].values()))
            for side in (left, right)
        )

    def _take(self, lane: Subject, kind: str, usual: float | None) -> None:
        individuals, problems = self._individuals, self._problems
        direction = individuals.text(lane, "has_direction")
        lane_id = individuals.integer(lane, "has_lane_id")
        width = individuals.number(lane, "has_width")
        name = f"{self._what}, lane {lane_id}"
        if direction not in self._lanes:
            problems.append(f"{name}: has_direction must be in or out, got '{direction}'")
            return
        positive = (direction == "in") == (self._end != "end")
        if lane_id == 0 or (lane_id > 0) != positive:
            where = f"the junction is at the road's {self._end}"
            if self._end == "none":
                where = "the road meets no junction"
            problems.append(
                f"{name}: has_lane_id must be {'> 0' if positive else '< 0'} for direction "
                f"'{direction}' where {where} (right-hand traffic)"
            )
        if not 0.5 <= width <= 20.0:
            problems.append(f"{name}: has_width [m] must be 0.5 … 20, got {width:g}")
        if usual is not None and abs(usual - width) > _SLACK:
            problems.append(
                f"{name}: has_width [m] must be the leg's has_lane_width, {usual:g}, got {width:g}"
            )
        if abs(lane_id) in self._lanes[direction]:
            problems.append(f"{name}: has_lane_id must be unique on its road")
        turns = frozenset(individuals.texts(lane, "allows_turn")) if kind == "driving" else None
        self._lanes[direction][abs(lane_id)] = kind, width, turns or frozenset()

    def _check(self, direction: str, count: str, stated: int | None) -> None:
        lanes = self._lanes[direction]
        ids = sorted(lanes)
        driving = [number for number in ids if lanes[number][0] == "driving"]
        if ids != list(range(1, len(ids) + 1)):
            self._problems.append(
                f"{self._what}: lanes '{direction}' must be numbered from 1, got {ids}"
            )
        elif driving != ids[: len(driving)]:
            self._problems.append(
                f"{self._what}: driving lanes '{direction}' must lie inside all strips"
            )
        if stated is not None and stated != len(driving):
            self._problems.append(
                f"{self._what}: {count} must be its number of lanes, {len(driving)}, got {stated}"
            )

    def driving(self, direction: str) -> tuple[float, ...]:
        """Return the widths of the driving lanes, innermost first [m]."""
        lanes = self._lanes[direction]
        return tuple(lanes[k][1] for k in sorted(lanes) if lanes[k][0] == "driving")

    def strips(self, direction: str) -> Strips:
        """Return type and width [m] of what lies outside them."""
        lanes = self._lanes[direction]
        return tuple(lanes[k][:2] for k in sorted(lanes) if lanes[k][0] != "driving")

    def turns(self) -> tuple[frozenset[str], ...]:
        """Return each inbound lane's allowed turns, innermost first; empty if none are stated."""
        lanes = self._lanes["in"]
        found = tuple(lanes[k][2] for k in sorted(lanes) if lanes[k][0] == "driving")
        return found if any(found) else ()


def read_id(individuals: Individuals, node: Subject, name: str, problems: list[str]) -> str:
    """Return an id; CARLA and SUMO read whole numbers only."""
    value = individuals.text(node, name)
    if not (value.isascii() and value.isdigit() and len(value) <= 9 and str(int(value)) == value):
        what = individuals.describe(node)
        problems.append(f"{what}: {name} must be a whole number of up to 9 digits, got '{value}'")
    return value


def corner(arm: Arm, following: Arm) -> float:
    """Return how far from the centre two neighbouring legs stop overlapping [m].

    The left edge of one leg, seen outwards, and the right edge of the next one cross at a point;
    the legs overlap as long as both begin before it.
    """
    angle = math.radians((following.heading_deg - arm.heading_deg) % 360.0)
    left, right = sum(arm.inbound), sum(following.outbound)
    if angle < _LEAST_ANGLE:
        return math.inf
    if angle > math.pi - _LEAST_ANGLE:
        return 0.0
    cos, sin = elementary.cos(angle), elementary.sin(angle)
    return min((right + left * cos) / sin, (left + right * cos) / sin)


_LEAST_ANGLE = math.radians(1.0)


def refuse(problems: list[str]) -> None:
    """Raise, if anything is wrong.

    Raises:
        OntologyError: all of it.
    """
    if problems:
        raise OntologyError(*problems)
