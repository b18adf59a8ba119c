"""OWL2OpenSCENARIO, its entities: bodies and drivers."""

from collections.abc import Callable, Mapping

from bridgegen.errors import OntologyError, UnsupportedError
from bridgegen.ontology.graph import Individuals
from bridgegen.ontology.vocabulary import Subject
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.declarations import DRIVER, IDEAL, KIND, SIREN
from bridgegen.openx.openscenario.values import format_double
from bridgegen.participants import PARTICIPANTS, ParticipantKind

MAX_SPEED = "max_speed"
"""Property of a pedestrian: the greatest speed [m/s]; the standard has it for vehicles."""

LIFTED = {"has_reason_to_exceed": "exceeds_limit", "has_siren": SIREN}
"""Properties of individuals of vehicles, and what they are called in files."""

_ESMINI_CONTROLLER = "ExternalController"
# An axle as on a mid-size saloon; the ontology has no more of it than the wheelbase.
_MAX_STEERING = 0.6  # [rad]
_WHEEL_DIAMETER = 0.65  # [m]
_BODY_OVER_TRACK = 0.3  # [m], how much wider the body is than the track


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


def scenario_object(individuals: Individuals, name: str, node: Subject) -> osc.ScenarioObject:
    """Return an entity.

    Raises:
        OntologyError: its individual lacks a property.
        UnsupportedError: it is of a class that has no counterpart.
    """
    controller = individuals.optional_link(node, "has_controller")
    controllers = () if controller is None else (_controller(individuals, controller),)
    return osc.ScenarioObject(name, _body(individuals, node), controllers)


def _body(individuals: Individuals, node: Subject) -> osc.Vehicle | osc.Pedestrian | osc.MiscObject:
    for kind in PARTICIPANTS.values():
        if individuals.is_a(node, kind.owl_class):
            return _MAKE[kind.written.element](individuals, node, kind)
    known = ", ".join(kind.owl_class for kind in PARTICIPANTS.values())
    raise UnsupportedError(f"{individuals.describe(node)} must be one of {known} to be written")


def _stated(kind: ParticipantKind) -> tuple[osc.Property, ...]:
    """Return the property that names a kind that the category alone does not identify."""
    return () if kind.written.is_exact else (osc.Property(KIND, kind.name),)


def _lifted(individuals: Individuals, node: Subject) -> tuple[osc.Property, ...]:
    """Return the properties that say which rules of the traffic are not for a vehicle."""
    found = ((name, individuals.optional_text(node, key)) for key, name in LIFTED.items())
    return tuple(osc.Property(name, text) for name, text in found if text is not None)


def _pedestrian(individuals: Individuals, node: Subject, kind: ParticipantKind) -> osc.Pedestrian:
    fastest = individuals.optional_number(node, "has_max_speed")
    said = () if fastest is None else (osc.Property(MAX_SPEED, format_double(fastest)),)
    name = kind.written.name or kind.written.category
    model = individuals.optional_text(node, "has_model")
    return osc.Pedestrian(
        name=model or name,
        pedestrian_category=osc.PedestrianCategory(kind.written.category),
        mass=individuals.number(node, "has_mass"),
        bounding_box=_box(individuals, node),
        properties=osc.Properties((*said, *_stated(kind))),
        model3d=name,
    )


def _object(individuals: Individuals, node: Subject, kind: ParticipantKind) -> osc.MiscObject:
    return osc.MiscObject(
        name=kind.written.name or kind.written.category,
        misc_object_category=osc.MiscObjectCategory(kind.written.category),
        mass=individuals.number(node, "has_mass"),
        bounding_box=_box(individuals, node),
        properties=osc.Properties(_stated(kind)),
    )


def _box(individuals: Individuals, node: Subject) -> osc.BoundingBox:
    length, width, height = (
        individuals.number(node, f"has_box_{name}") for name in ("length", "width", "height")
    )
    ahead = individuals.number(node, "has_center_ahead")
    return osc.BoundingBox(
        osc.Center(ahead, 0.0, height / 2), osc.Dimensions(width, length, height)
    )


def _vehicle(individuals: Individuals, node: Subject, kind: ParticipantKind) -> osc.Vehicle:
    width, written = individuals.number(node, "has_box_width"), kind.written
    return osc.Vehicle(
        name=individuals.optional_text(node, "has_model") or written.name or written.category,
        vehicle_category=osc.VehicleCategory(written.category),
        bounding_box=_box(individuals, node),
        performance=osc.Performance(
            individuals.number(node, "has_max_speed"),
            individuals.number(node, "has_max_acceleration"),
            individuals.number(node, "has_max_deceleration"),
        ),
        axles=osc.Axles(
            _axle(_MAX_STEERING, width, individuals.number(node, "has_wheelbase")),
            _axle(0.0, width, 0.0),
        ),
        properties=osc.Properties((*_stated(kind), *_lifted(individuals, node))),
        role=None if written.role is None else osc.Role(written.role),
        mass=individuals.optional_number(node, "has_mass"),
    )


_MAKE: Mapping[
    str,
    Callable[
        [Individuals, Subject, ParticipantKind], osc.Vehicle | osc.Pedestrian | osc.MiscObject
    ],
] = {"Vehicle": _vehicle, "Pedestrian": _pedestrian, "MiscObject": _object}


def _axle(max_steering: float, body_width: float, x: float) -> osc.Axle:
    return osc.Axle(
        max_steering=max_steering,
        wheel_diameter=_WHEEL_DIAMETER,
        track_width=max(round(body_width - _BODY_OVER_TRACK, 3), 0.1),
        position_x=x,
        position_z=_WHEEL_DIAMETER / 2,
    )


def _controller(individuals: Individuals, node: Subject) -> osc.ObjectController:
    """Return a named controller; another driver replaces it or its property.

    To esmini it is an external one, which stays idle until it is activated; a type that esmini
    does not know would be an error in its log.
    """
    driver = plain_text(individuals, node, "has_driver")
    said = [osc.Property(DRIVER, driver), osc.Property("esminiController", _ESMINI_CONTROLLER)]
    if individuals.optional_text(node, "has_ideal_stages") is not None:
        said.append(osc.Property(IDEAL, plain_text(individuals, node, "has_ideal_stages")))
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
