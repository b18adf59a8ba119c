"""OWL2OpenDRIVE: from the static individuals of an ontology to a road network (Section IV-E).

Only the individuals count: a file that somebody edited in Protégé converts like one of ours.
"""

import math
from collections import Counter
from typing import Literal

from bridgegen.errors import InputError, OntologyError, UnsupportedError
from bridgegen.ontology.graph import Individuals
from bridgegen.ontology.vocabulary import Subject
from bridgegen.openx.opendrive.crossroads import Arm, build, dead_ends
from bridgegen.openx.opendrive.model import OpenDrive

LEGS = 4
_SLACK = 1e-9
_LEAST_ANGLE = math.radians(1.0)


def opendrive_from_owl(individuals: Individuals) -> OpenDrive:
    """Return the road network that the individuals describe: a crossroads of four legs.

    Legs may have any headings, lengths, lane widths, and numbers of lanes. Connecting roads get
    the ids after the largest one that an individual has.

    Args:
        individuals: at least one RoadNetwork with its Intersection; no Scenario is needed.

    Raises:
        OntologyError: the individuals contradict each other or describe what cannot be built.
        UnsupportedError: the intersection has not exactly four legs.
        InputError: the road network is a map that exists already.
    """
    network = individuals.one("RoadNetwork")
    name = individuals.text(network, "has_name")
    existing = individuals.optional_text(network, "has_map_file")
    if existing is not None:
        raise InputError(f"road network {name} is the file '{existing}': there is none to make")
    intersection = individuals.one("Intersection")
    legs = individuals.links(intersection, "has_leg")
    if len(legs) != LEGS:
        raise UnsupportedError(
            f"an intersection must have {LEGS} legs (has_leg) in this version, got {len(legs)}"
        )
    problems: list[str] = []
    junction_id = _id(individuals, intersection, "has_junction_id", problems)
    size = _size(individuals, intersection, problems)
    arms: list[Arm] = []
    for leg in legs:
        try:
            arms.append(_arm(individuals, leg, problems))
        except OntologyError as error:
            problems += error.problems
    if not problems:
        problems += _together(junction_id, size, arms)
    if problems:
        raise OntologyError(*problems)
    return build(name, junction_id, size, tuple(arms))


def _arm(individuals: Individuals, leg: Subject, problems: list[str]) -> Arm:
    what = individuals.describe(leg)
    if individuals.links(leg, "has_continuation"):
        problems.append(f"{what}: a generated leg must be one road, got has_continuation")
    end = individuals.text(leg, "has_junction_end")
    if end not in ("start", "end"):
        problems.append(f"{what}: has_junction_end must be start or end, got '{end}'")
    junction_end: Literal["start", "end"] = "end" if end == "end" else "start"
    limit = individuals.optional_number(leg, "has_speed_limit")
    if limit is not None and not 0.1 <= limit <= 200.0:
        problems.append(f"{what}: has_speed_limit [m/s] must be 0.1 … 200, got {limit:g}")
    heading = individuals.number(leg, "has_heading")
    if not -360.0 <= heading <= 360.0:
        problems.append(f"{what}: has_heading [deg] must be -360 … 360, got {heading:g}")
    length = individuals.number(leg, "has_length")
    if not 1.0 <= length <= 10_000.0:
        problems.append(f"{what}: has_length [m] must be 1 … 10000, got {length:g}")
    widths: dict[str, dict[int, float]] = {"in": {}, "out": {}}
    usual = individuals.optional_number(leg, "has_lane_width")
    lanes = individuals.links(leg, "has_lane")
    for lane in lanes:
        direction = individuals.text(lane, "has_direction")
        lane_id = individuals.integer(lane, "has_lane_id")
        width = individuals.number(lane, "has_width")
        name = f"{what}, lane {lane_id}"
        if direction not in widths:
            problems.append(f"{name}: has_direction must be in or out, got '{direction}'")
            continue
        if lane_id == 0 or (lane_id > 0) != ((direction == "in") == (junction_end == "start")):
            side = "> 0" if (direction == "in") == (junction_end == "start") else "< 0"
            problems.append(
                f"{name}: has_lane_id must be {side} for direction '{direction}' where the "
                f"junction is at the road's {junction_end} (right-hand traffic)"
            )
        if not 0.5 <= width <= 20.0:
            problems.append(f"{name}: has_width [m] must be 0.5 … 20, got {width:g}")
        if usual is not None and abs(usual - width) > _SLACK:
            problems.append(
                f"{name}: has_width [m] must be the leg's has_lane_width, {usual:g}, got {width:g}"
            )
        if abs(lane_id) in widths[direction]:
            problems.append(f"{name}: has_lane_id must be unique on its road")
        widths[direction][abs(lane_id)] = width
    for direction, count in (("in", "has_inbound_lanes"), ("out", "has_outbound_lanes")):
        ids = sorted(widths[direction])
        if ids != list(range(1, len(ids) + 1)):
            problems.append(f"{what}: lanes '{direction}' must be numbered from 1, got {ids}")
        said = individuals.optional_integer(leg, count)
        if said is not None and said != len(ids):
            problems.append(f"{what}: {count} must be its number of lanes, {len(ids)}, got {said}")
    return Arm(
        name=individuals.text(leg, "has_name"),
        road_id=_id(individuals, leg, "has_road_id", problems),
        heading_deg=heading,
        length=length,
        junction_end=junction_end,
        speed_limit=limit,
        inbound=tuple(widths["in"][key] for key in sorted(widths["in"])),
        outbound=tuple(widths["out"][key] for key in sorted(widths["out"])),
    )


def _size(individuals: Individuals, node: Subject, problems: list[str]) -> float:
    size = individuals.number(node, "has_size")
    if not 1.0 <= size <= 1000.0:
        what = individuals.describe(node)
        problems.append(f"{what}: has_size [m] must be 1 … 1000, got {size:g}")
    return size


def _id(individuals: Individuals, node: Subject, name: str, problems: list[str]) -> str:
    """Return an id; CARLA and SUMO read whole numbers only."""
    value = individuals.text(node, name)
    if not (value.isascii() and value.isdigit() and len(value) <= 9 and str(int(value)) == value):
        what = individuals.describe(node)
        problems.append(f"{what}: {name} must be a whole number of up to 9 digits, got '{value}'")
    return value


def _together(junction_id: str, size: float, arms: list[Arm]) -> list[str]:
    """Return what is wrong between the legs: ids that collide, arms that overlap."""
    counts = Counter([junction_id, *(arm.road_id for arm in arms)])
    problems = [
        f"road and junction ids must differ from each other, got '{value}' {count} times"
        for value, count in counts.items()
        if count > 1
    ]
    for arm, lane in dead_ends(tuple(arms)):
        problems.append(
            f"every lane in must lead across, but lane {lane} of leg {arm.name} has no leg to go to"
        )
    if not any(arm.inbound for arm in arms):
        problems.append("an intersection must have a lane in, got none")
    around = sorted(arms, key=lambda arm: arm.heading_deg % 360.0)
    for arm, following in zip(around, around[1:] + around[:1], strict=True):
        need = 2.0 * _corner(arm, following)
        if size < need - _SLACK:
            problems.append(
                f"has_size [m] must be ≥ {need:.4g}, or legs {arm.name} and {following.name} "
                f"overlap, got {size:g}"
            )
    return problems


def _corner(arm: Arm, following: Arm) -> float:
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
    cos, sin = math.cos(angle), math.sin(angle)
    return min((right + left * cos) / sin, (left + right * cos) / sin)
