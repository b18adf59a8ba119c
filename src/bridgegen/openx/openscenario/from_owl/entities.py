"""OWL2OpenSCENARIO, its entities: bodies, and who drives them."""

from collections.abc import Mapping

from bridgegen.errors import OntologyError, UnsupportedError
from bridgegen.ontology.graph import Individuals
from bridgegen.ontology.vocabulary import Subject
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.declarations import DRIVER, IDEAL
from bridgegen.openx.openscenario.values import format_double

CATEGORIES = {
    "Car": osc.VehicleCategory.CAR,
    "Van": osc.VehicleCategory.VAN,
    "Truck": osc.VehicleCategory.TRUCK,
    "Bus": osc.VehicleCategory.BUS,
    "Motorcycle": osc.VehicleCategory.MOTORBIKE,
    "EmergencyVehicle": osc.VehicleCategory.VAN,
    "Bicycle": osc.VehicleCategory.BICYCLE,
}
WALKERS = {
    "Pedestrian": osc.PedestrianCategory.PEDESTRIAN,
    "Animal": osc.PedestrianCategory.ANIMAL,
}
OBJECTS = {
    "Misc": osc.MiscObjectCategory.OBSTACLE,
    "RoadCone": osc.MiscObjectCategory.OBSTACLE,
    "ConstructionCard": osc.MiscObjectCategory.POLE,
}
MAX_SPEED = "max_speed"
"""Property of somebody on foot: how fast they can go [m/s]; the standard has it for vehicles."""

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
    for name, category in CATEGORIES.items():
        if individuals.is_a(node, name):
            role = osc.Role.AMBULANCE if name == "EmergencyVehicle" else None
            return _vehicle(individuals, node, category, role)
    for name, walker in WALKERS.items():
        if individuals.is_a(node, name):
            fastest = individuals.optional_number(node, "has_max_speed")
            said = () if fastest is None else (osc.Property(MAX_SPEED, format_double(fastest)),)
            return osc.Pedestrian(
                name=walker.value,
                pedestrian_category=walker,
                mass=individuals.number(node, "has_mass"),
                bounding_box=_box(individuals, node),
                properties=osc.Properties(said),
                model3d=walker.value,
            )
    for name, kind in OBJECTS.items():
        if individuals.is_a(node, name):
            return osc.MiscObject(
                name=name.lower(),
                misc_object_category=kind,
                mass=individuals.number(node, "has_mass"),
                bounding_box=_box(individuals, node),
                properties=osc.Properties(),
            )
    known = ", ".join((*CATEGORIES, *WALKERS, *OBJECTS))
    raise UnsupportedError(f"{individuals.describe(node)} must be one of {known} to be written")


def _box(individuals: Individuals, node: Subject) -> osc.BoundingBox:
    length, width, height = (
        individuals.number(node, f"has_box_{name}") for name in ("length", "width", "height")
    )
    ahead = individuals.number(node, "has_center_ahead")
    return osc.BoundingBox(
        osc.Center(ahead, 0.0, height / 2), osc.Dimensions(width, length, height)
    )


def _vehicle(
    individuals: Individuals, node: Subject, category: osc.VehicleCategory, role: osc.Role | None
) -> osc.Vehicle:
    width = individuals.number(node, "has_box_width")
    return osc.Vehicle(
        name=category.value,
        vehicle_category=category,
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
        properties=osc.Properties(),
        role=role,
        mass=individuals.optional_number(node, "has_mass"),
    )


def _axle(max_steering: float, body_width: float, x: float) -> osc.Axle:
    return osc.Axle(
        max_steering=max_steering,
        wheel_diameter=_WHEEL_DIAMETER,
        track_width=max(round(body_width - _BODY_OVER_TRACK, 3), 0.1),
        position_x=x,
        position_z=_WHEEL_DIAMETER / 2,
    )


def _controller(individuals: Individuals, node: Subject) -> osc.ObjectController:
    """Return a named controller; who wants another driver replaces it or its property.

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
