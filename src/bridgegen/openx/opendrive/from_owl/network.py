"""OWL2OpenDRIVE: from the static individuals of an ontology to a road network (Section IV-E).

Only the individuals count: a file that was edited in Protégé converts like an original one.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from bridgegen.base.errors import InputError, OntologyError, UnsupportedError
from bridgegen.openx.opendrive.from_owl import intersection, lone_road, merge, roundabout
from bridgegen.openx.opendrive.from_owl.arms import Arm
from bridgegen.openx.opendrive.from_owl.furniture import controllers_of
from bridgegen.openx.opendrive.from_owl.legs import corner, read_arm, read_id, refuse
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.user_data import UserData, user_datum
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.mirror import is_left_hand
from bridgegen.scenario.ontology.vocabulary import Subject

MOST_LEGS = 5
KINDS = ("Crossroads", "TJunction", "Roundabout", "Merge", "Intersection")
"""Classes of junctions; the most general one last."""

MEASURES = ("has_size", "has_radius", "has_ring_lane_width", "has_merge_length", "has_taper_length")
"""Properties that state the dimensions of a junction [m]."""

_SLACK = 1e-9
_LEAST_GAP = 45.0
"""Least angle between two legs of an intersection [deg]."""


def opendrive_from_owl(individuals: Individuals) -> OpenDrive:
    """Return the road network that the individuals describe.

    An intersection of two to five legs, a roundabout, a merge, or one road that meets none. Legs
    may have any headings, lengths, lane widths, and numbers of lanes. Connecting roads get the
    ids after the largest one that an individual has.

    Args:
        individuals: at least one RoadNetwork with its areas; no Scenario is needed.

    Raises:
        OntologyError: the individuals contradict each other or describe what cannot be built.
        UnsupportedError: several junctions, or none and several roads.
        InputError: the road network is a map that exists already.
    """
    network = individuals.one("RoadNetwork")
    made = _made(individuals, network)
    if (country := individuals.optional_text(network, "has_country")) is not None:
        roads = tuple(
            replace(road, types=tuple(replace(kind, country=country) for kind in road.types))
            for road in made.roads
        )
        made = replace(made, roads=roads)
    return replace(made, left_hand=is_left_hand(individuals))


def _made(individuals: Individuals, network: Subject) -> OpenDrive:
    name = individuals.text(network, "has_name")
    existing = individuals.optional_text(network, "has_map_file")
    if existing is not None:
        raise InputError(f"road network {name} is the file '{existing}': there is none to make")
    crossings = individuals.of_class("Intersection")
    if not crossings:
        return _lone_road(individuals, name)
    # Several junctions exist in imported maps only, which are files already and are not made again.
    if len(crossings) > 1:
        raise UnsupportedError(
            f"a road network is made with one intersection in this version, got {len(crossings)}"
        )
    (crossing,) = crossings
    if individuals.is_a(crossing, "DirectJunction"):
        what = f"{individuals.describe(crossing)}: a direct junction"
        raise UnsupportedError(f"{what} is read from maps, but not made in this version")
    problems: list[str] = []
    junction_id = read_id(individuals, crossing, "has_junction_id", problems)
    arms: list[Arm] = []
    for leg in individuals.links(crossing, "has_leg"):
        try:
            merges = individuals.is_a(crossing, "Merge")
            arms.append(read_arm(individuals, leg, problems, widens=merges))
        except OntologyError as error:
            problems += error.problems
    if any(arm.junction_end == "none" for arm in arms):
        problems.append("has_junction_end of an intersection's leg must be start or end, got none")
    if not problems:
        problems += _ids(junction_id, arms)
    refuse(problems)
    if individuals.is_a(crossing, "Merge"):
        return _merge(individuals, crossing, name, junction_id, arms)
    if individuals.is_a(crossing, "Roundabout"):
        return _roundabout(individuals, crossing, name, junction_id, arms)
    size = _measure(individuals, crossing, "has_size", problems)
    refuse(problems or _together(size, arms))
    controllers = controllers_of(individuals)
    about = _about(individuals, crossing)
    return intersection.build(name, junction_id, size, tuple(arms), controllers, about)


def _lone_road(individuals: Individuals, name: str) -> OpenDrive:
    roads = individuals.of_class("Road")
    if len(roads) != 1:
        raise UnsupportedError(
            f"a road network without an intersection must be one road, got {len(roads)}"
        )
    problems: list[str] = []
    arm = read_arm(individuals, roads[0], problems)
    segments = sorted(
        individuals.links(roads[0], "has_segment"),
        key=lambda node: individuals.integer(node, "has_index"),
    )
    bends = tuple(
        (
            individuals.number(node, "has_length"),
            individuals.optional_number(node, "has_start_curvature") or 0.0,
            individuals.optional_number(node, "has_end_curvature") or 0.0,
        )
        for node in segments
    )
    total = sum(length for length, _, _ in bends)
    # Relative, for the lengths are sums that another tool may have added up in another order.
    if bends and abs(total - arm.length) > 1e-6 * total:
        problems.append(
            f"has_length [m] of {individuals.describe(roads[0])} must be that of its segments, "
            f"{total:g}, got {arm.length:g}"
        )
    if arm.junction_end != "none":
        problems.append(
            f"has_junction_end of {individuals.describe(roads[0])} must be none: there is no "
            f"intersection, got '{arm.junction_end}'"
        )
    refuse(problems)
    return lone_road.build(name, arm, bends)


def _merge(
    individuals: Individuals, node: Subject, name: str, junction_id: str, arms: Sequence[Arm]
) -> OpenDrive:
    problems: list[str] = []
    length = _measure(individuals, node, "has_merge_length", problems)
    taper = _measure(individuals, node, "has_taper_length", problems)
    by_name = {arm.name: arm for arm in arms}
    if sorted(by_name) != ["after", "main", "ramp"]:
        problems.append(
            f"a merge has the legs main, ramp and after, got {', '.join(sorted(by_name))}"
        )
    refuse(problems)
    return merge.build(
        name,
        junction_id,
        by_name["main"],
        by_name["ramp"],
        by_name["after"],
        length,
        taper,
        _about(individuals, node),
    )


def _roundabout(
    individuals: Individuals, node: Subject, name: str, junction_id: str, arms: Sequence[Arm]
) -> OpenDrive:
    problems: list[str] = []
    radius = _measure(individuals, node, "has_radius", problems)
    width = individuals.optional_number(node, "has_ring_lane_width") or 5.0
    if not 3 <= len(arms) <= MOST_LEGS:
        problems.append(f"a roundabout must have 3 to {MOST_LEGS} legs, got {len(arms)}")
    problems += _headings(arms)
    taken = {str(int(junction_id) + k) for k in range(len(arms))}
    problems += [
        f"has_road_id of leg {arm.name} must not be among the junctions' ids "
        f"{', '.join(sorted(taken))}, got {arm.road_id}"
        for arm in arms
        if arm.road_id in taken
    ]
    if radius < width:
        problems.append(
            f"has_radius [m] must be at least the ring lane's width, {width:g}, got {radius:g}"
        )
    refuse(problems)
    about = _about(individuals, node)
    return roundabout.build(name, junction_id, radius, width, tuple(arms), about)


def _about(individuals: Individuals, crossing: Subject) -> tuple[UserData, ...]:
    """Return values of a junction that OpenDRIVE cannot express: its class and its measures."""
    cls = next(name for name in KINDS if individuals.is_a(crossing, name))
    measures = [(name, individuals.optional_number(crossing, name)) for name in MEASURES]
    return (
        user_datum("class", cls),
        *(user_datum(name, value) for name, value in measures if value is not None),
    )


def _measure(individuals: Individuals, node: Subject, name: str, problems: list[str]) -> float:
    value = individuals.number(node, name)
    if not 1.0 <= value <= 1000.0:
        what = individuals.describe(node)
        problems.append(f"{what}: {name} [m] must be 1 … 1000, got {value:g}")
    return value


def _ids(junction_id: str, arms: Sequence[Arm]) -> list[str]:
    """Return ids that collide: CARLA finds no way into a junction that is called like a road."""
    counts = Counter([junction_id, *(arm.road_id for arm in arms)])
    things = Counter(obj.id for arm in arms for obj in arm.objects)
    things += Counter(signal.id for arm in arms for signal in arm.signals)
    return [
        f"road and junction ids must differ from each other, got '{value}' {count} times"
        for value, count in counts.items()
        if count > 1
    ] + [
        f"has_object_id must be unique, got '{value}' {count} times"
        for value, count in things.items()
        if count > 1
    ]


def _together(size: float, arms: list[Arm]) -> list[str]:
    """Return what is wrong between the legs of an intersection: dead ends, arms that overlap."""
    problems = []
    if not 2 <= len(arms) <= MOST_LEGS:
        problems.append(
            f"an intersection must have 2 to {MOST_LEGS} legs (has_leg), got {len(arms)}"
        )
        return problems
    problems += [
        f"every lane in must lead across, but lane {lane} of leg {arm.name} has no leg to go to"
        for arm, lane in intersection.dead_ends(tuple(arms))
    ]
    if not any(arm.inbound for arm in arms):
        problems.append("an intersection must have a lane in, got none")
    if len(arms) != len(intersection.TURNS) + 1:
        problems += _headings(arms)
    around = sorted(arms, key=lambda arm: arm.heading_deg % 360.0)
    for arm, following in zip(around, around[1:] + around[:1], strict=True):
        need = 2.0 * corner(arm, following)
        if size < need - _SLACK:
            problems.append(
                f"has_size [m] must be ≥ {need:.4g}, or legs {arm.name} and {following.name} "
                f"overlap, got {size:g}"
            )
    return problems


def _headings(arms: Sequence[Arm]) -> list[str]:
    """Return legs that are too close to each other."""
    around = sorted((arm.heading_deg % 360.0, arm.name) for arm in arms)
    around.append((around[0][0] + 360.0, around[0][1]))
    return [
        f"legs must be {_LEAST_GAP:g}° apart at least, {name} and {other} are {b - a:.4g}°"
        for (a, name), (b, other) in pairwise(around)
        if b - a < _LEAST_GAP - 1e-6
    ]
