"""OWL2OpenSCENARIO, its entities: bodies and drivers."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

from bridgegen.base.errors import OntologyError, UnsupportedError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.bodies import EntityBody, entity_body
from bridgegen.openx.openscenario.declarations import DRIVER, GHOST, IDEAL, ODD, SIREN, TRACKER
from bridgegen.openx.openscenario.from_owl.quantities import Quantities, Quantity, quoted_element
from bridgegen.openx.openscenario.values import Double, format_double
from bridgegen.scenario.language.story import GHOST_UNITS, TRACKER_UNITS
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import Subject
from bridgegen.scenario.participants import PARTICIPANTS, Body, ParticipantKind

MAX_SPEED = "max_speed"
"""Property of a pedestrian: the greatest speed [m/s]; the standard has it for vehicles."""

LIFTED = {
    "has_reason_to_exceed": "exceeds_limit",
    "has_reason_off_crosswalk": "off_crosswalk",
    "has_siren": SIREN,
    "has_odd": ODD,
}
"""Names in files of properties of participants' individuals."""

_ESMINI_CONTROLLER = "ExternalController"


class Cast:
    """The participants of a scenario's individuals.

    Args:
        individuals: one scenario.
        by_name: its participants.
    """

    def __init__(self, individuals: Individuals, by_name: Mapping[str, Subject]) -> None:
        self._individuals = individuals
        self._names = {node: name for name, node in by_name.items()}

    def name(self, node: Subject, link: str) -> str:
        """Return the name of the participant that a property points to.

        Raises:
            OntologyError: it points to none, to several or to something else.
        """
        return self._name(node, link, self._individuals.link(node, link))

    def names(self, node: Subject, link: str) -> tuple[str, ...]:
        """Return the names of all participants that a property points to, in their order.

        Raises:
            OntologyError: it points to something else.
        """
        links = self._individuals.links(node, link)
        return tuple(self._name(node, link, target) for target in links)

    def _name(self, node: Subject, link: str, target: Subject) -> str:
        if target in self._names:
            return self._names[target]
        raise OntologyError(
            f"{link} of {self._individuals.describe(node)} must be a participant of the scenario, "
            f"got {self._individuals.describe(target)}"
        )


def scenario_object(
    individuals: Individuals, quantities: Quantities, name: str, node: Subject
) -> osc.ScenarioObject:
    """Return an entity.

    Raises:
        OntologyError: its individual lacks a property.
        UnsupportedError: it is of a class that has no counterpart.
    """
    controller = individuals.optional_link(node, "has_controller")
    controllers = () if controller is None else (_controller(individuals, quantities, controller),)
    return osc.ScenarioObject(name, _body(individuals, node), controllers)


def _body(individuals: Individuals, node: Subject) -> EntityBody:
    for kind in PARTICIPANTS.values():
        if individuals.is_a(node, kind.owl_class):
            return _body_of_kind(individuals, node, kind)
    known = ", ".join(kind.owl_class for kind in PARTICIPANTS.values())
    raise UnsupportedError(f"{individuals.describe(node)} must be one of {known} to be written")


def _body_of_kind(individuals: Individuals, node: Subject, kind: ParticipantKind) -> EntityBody:
    number = partial(individuals.number, node)
    body = Body(
        number("has_box_length"),
        number("has_box_width"),
        number("has_box_height"),
        number("has_center_ahead"),
    )
    mass = individuals.optional_number(node, "has_mass")
    model = individuals.optional_text(node, "has_model")
    lifted = tuple(_lifted(individuals, node))
    if kind.written.element == "Vehicle":
        body = replace(
            body,
            wheelbase=number("has_wheelbase"),
            max_speed=number("has_max_speed"),
            max_acceleration=number("has_max_acceleration"),
            max_deceleration=number("has_max_deceleration"),
        )
        return entity_body(kind, body, mass=mass, model=model, properties=lifted)
    mass = number("has_mass")
    if kind.written.element == "Pedestrian":
        fastest = individuals.optional_number(node, "has_max_speed")
        said = () if fastest is None else (osc.Property(MAX_SPEED, format_double(fastest)),)
        return entity_body(kind, body, mass=mass, model=model, properties=said + lifted)
    return entity_body(kind, body, mass=mass)


def _lifted(individuals: Individuals, node: Subject) -> Iterator[osc.Property]:
    """Yield the properties that say which rules are not for a participant, and its domain."""
    for key, name in LIFTED.items():
        text = individuals.optional_text(node, key)
        if text is not None:
            yield osc.Property(name, text)


def _controller(
    individuals: Individuals, quantities: Quantities, node: Subject
) -> osc.ObjectController:
    """Return a named controller; another driver replaces it or its property.

    To esmini it is an external one, which stays idle until it is activated; a type that esmini
    does not know would be an error in its log.
    """
    driver = plain_text(individuals, node, "has_driver")
    said = [osc.Property(DRIVER, driver), osc.Property("esminiController", _ESMINI_CONTROLLER)]
    if individuals.optional_text(node, "has_ideal_stages") is not None:
        said.append(osc.Property(IDEAL, plain_text(individuals, node, "has_ideal_stages")))
    for part in (*individuals.links(node, "has_ghost"), node):
        prefix, key, words = "has_tracker", TRACKER, TRACKER_UNITS
        if part != node:
            prefix, words = "has_ghost", GHOST_UNITS
            key = f"{GHOST}.{plain_text(individuals, part, 'has_name')}"
            for word in ("type", "mirrors"):
                if individuals.optional_text(part, f"has_ghost_{word}") is not None:
                    text = plain_text(individuals, part, f"has_ghost_{word}")
                    said.append(osc.Property(f"{key}.{word}", text))
        for word in words:
            if individuals.optional_number(part, f"{prefix}_{word}") is not None:
                value = quantities.get(part, f"{prefix}_{word}")
                shown = format_double(value) if isinstance(value, float) else value
                said.append(osc.Property(f"{key}.{word}", shown))
    properties = osc.Properties(tuple(said))
    name = plain_text(individuals, node, "has_name")
    return osc.ObjectController(osc.Controller(name, properties))


def plain_text(individuals: Individuals, node: Subject, name: str) -> str:
    """Return a text that reads as itself in the file, not as a reference to a parameter.

    Raises:
        OntologyError: it begins with ``$``.
    """
    text = individuals.text(node, name)
    if text.startswith("$"):
        raise OntologyError(
            f"{name} of {individuals.describe(node)} must not begin with $, got '{text}'"
        )
    return text


# --- OWL2OpenSCENARIO, its places: from a distance to the junction to a lane position ---
# An individual says on which lane of a leg, and how far from the junction. A leg may be a chain of
# roads, and a road's reference line may run towards the junction or away from it.


RADIANS = repr(math.pi / 180.0)
"""Radians per degree, as a part of a formula."""

_ALONG_LANE = osc.Orientation(osc.ReferenceContext.RELATIVE, h=0.0)


@dataclass(frozen=True)
class _Road:
    """A road of a leg; ``near`` is its end that is nearer to the junction.

    Distances count from there, or from the start of a road that meets no junction, or two; or
    from ``station`` along its reference line.
    """

    node: Subject
    road_id: str
    length: float
    near: str
    station: float


class Places:
    """The lane positions of a scenario's individuals.

    Raises:
        OntologyError: the roads lack a property, or lead back into themselves.
    """

    def __init__(self, individuals: Individuals, quantities: Quantities) -> None:
        self._individuals = individuals
        self._quantities = quantities
        self._of_lane: dict[Subject, tuple[tuple[_Road, ...], int]] = {}
        self._road_ids: dict[Subject, str] = {}
        legs = [
            leg
            for junction in individuals.of_class("Intersection")
            for leg in individuals.links(junction, "has_leg")
        ]
        everywhere = individuals.of_class("Road")
        onward = {individuals.optional_link(road, "has_continuation") for road in everywhere}
        covered: set[Subject] = set()
        for leg in legs:  # on a whole map, a leg of one junction may continue another's
            if leg not in onward:
                covered |= self._add(self._chain(leg))
        for road in everywhere:  # of no junction, within one, or between two
            if road not in covered:
                covered |= self._add(self._chain(road))

    def _add(self, roads: tuple[_Road, ...]) -> set[Subject]:
        """Take up the lanes of a leg; return its roads."""
        for index, road in enumerate(roads):
            for name in ("has_lane", "has_strip"):
                for lane in self._individuals.links(road.node, name):
                    self._of_lane[lane] = roads, index
                    self._road_ids[lane] = road.road_id
        return {road.node for road in roads}

    def road_id(self, lane: Subject) -> str | None:
        """Return the id of the road that a lane or strip is of, or None."""
        return self._road_ids.get(lane)

    def position(self, node: Subject, *, oriented: bool) -> osc.Position:
        """Return where an individual of class LanePosition or WorldPosition is.

        A distance that is bound to a parameter becomes an expression on the road that holds its
        present value.

        Args:
            node: the individual.
            oriented: whether to state the driving direction (esmini compares an orientation that
                a ReachPositionCondition states, so a destination has none).

        Raises:
            OntologyError: a property is missing, the lane belongs to no leg, or the distance lies
                beyond the leg's end.
        """
        individuals = self._individuals
        if individuals.is_a(node, "OpenScenarioPosition"):
            made = quoted_element(individuals, node, {"Position": osc.Position})
            assert isinstance(made, osc.Position)
            return made
        if individuals.is_a(node, "WorldPosition"):
            x, y = (self._quantities.get(node, f"has_world_{item}") for item in ("x", "y"))
            turned = [
                None
                if (angle := individuals.optional_number(node, name)) is None
                else math.radians(angle)
                for name in ("has_world_yaw", "has_world_pitch", "has_world_roll")
            ]
            z = individuals.optional_number(node, "has_world_z")
            return osc.Position(osc.WorldPosition(x, y, z, *turned))
        lane = individuals.link(node, "on_lane")
        try:
            roads, index = self._of_lane[lane]
        except KeyError:
            raise OntologyError(
                f"on_lane of {individuals.describe(node)} must be a lane of one of the "
                f"intersection's legs, got {individuals.describe(lane)}"
            ) from None
        distance = self._quantities.get(node, "has_distance")
        at = self._holds(node, roads, self._quantities.value(distance))
        lane = self._same_lane(lane, roads[index], roads[at])
        lane_id = individuals.integer(lane, "has_lane_id")
        position = osc.LanePosition(
            road_id=roads[at].road_id,
            lane_id=str(lane_id),
            s=self._station(roads[at], sum(road.length for road in roads[:at]), distance),
            offset=self._offset(node, lane_id),
            orientation=self._orientation(node) if oriented else None,
        )
        return osc.Position(position)

    def _orientation(self, node: Subject) -> osc.Orientation:
        if self._individuals.optional_number(node, "has_relative_heading") is None:
            return _ALONG_LANE
        heading = self._quantities.get(node, "has_relative_heading")
        h = self._quantities.apply(f"x*{RADIANS}", heading)
        return osc.Orientation(osc.ReferenceContext.RELATIVE, h=h)

    def _offset(self, node: Subject, lane_id: int) -> Double | None:
        """Return how far a place is from its lane's centre, left of the road's direction."""
        if self._individuals.optional_number(node, "has_lateral_offset") is None:
            return None
        offset = self._quantities.get(node, "has_lateral_offset")
        return offset if lane_id < 0 else self._quantities.apply("-x", offset)

    def _chain(self, leg: Subject) -> tuple[_Road, ...]:
        individuals = self._individuals
        roads: list[_Road] = []
        node: Subject | None = leg
        while node is not None:
            if any(road.node == node for road in roads):
                raise OntologyError(f"{individuals.describe(node)} must not continue itself")
            near = individuals.text(node, "has_junction_end")
            if near not in ("start", "end", "none", "both"):
                raise OntologyError(
                    f"has_junction_end of {individuals.describe(node)} must be 'start' or 'end', "
                    f"or 'none' of a road that meets no junction, got '{near}'"
                )
            road_id = individuals.text(node, "has_road_id")
            length = individuals.number(node, "has_length")
            station = individuals.optional_number(node, "has_station")
            if station is None:
                station = length if near == "end" else 0.0
            roads.append(_Road(node, road_id, length, near, station))
            node = individuals.optional_link(node, "has_continuation")
        return tuple(roads)

    def _holds(self, node: Subject, roads: tuple[_Road, ...], distance: float) -> int:
        """Return which road of a leg holds a distance from the junction [m]."""
        end = 0.0
        for index, road in enumerate(roads):
            end += road.length
            if 0.0 <= distance <= end:
                return index
        raise OntologyError(
            f"has_distance [m] of {self._individuals.describe(node)} must lie on its "
            f"leg, 0 to {end!r}, got {distance!r}"
        )

    def _same_lane(self, lane: Subject, on: _Road, other: _Road) -> Subject:
        """Return the lane of another road of the leg that continues a lane: as many further in."""
        individuals = self._individuals
        if on == other:
            return lane
        direction = individuals.text(lane, "has_direction")
        own, others = (
            sorted(
                (abs(individuals.integer(link, "has_lane_id")), link.value, link)
                for link in individuals.links(road.node, "has_lane")
                if individuals.text(link, "has_direction") == direction
            )
            for road in (on, other)
        )
        rank = next(k for k, item in enumerate(own) if item[2] == lane)
        if len(own) != len(others):
            raise OntologyError(
                f"{individuals.describe(lane)} must continue on road {other.road_id}, which has "
                f"{len(others)} lanes of that direction, not {len(own)}"
            )
        return others[rank][2]

    def _station(self, road: _Road, before: float, distance: Quantity) -> Double:
        """Return s on a road that begins ``before`` metres from the junction."""
        near = road.station
        if road.near == "end":
            low, formula = near - road.length, f"{format_double(before + near)}-x"
        elif before == near:
            return distance
        elif before > near:
            low, formula = near, f"x-{format_double(before - near)}"
        else:
            low, formula = near, f"x+{format_double(near - before)}"
        s = self._quantities.apply(formula, distance)
        return min(max(s, low), low + road.length) if isinstance(s, float) else s  # rounding
