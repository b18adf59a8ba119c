"""OWL2OpenSCENARIO, its entities: bodies, and who drives them."""

from bridgegen.errors import OntologyError, UnsupportedError
from bridgegen.ontology.graph import Individuals
from bridgegen.ontology.vocabulary import Subject
from bridgegen.openx.openscenario import model as osc

_CATEGORIES = {
    "Car": osc.VehicleCategory.CAR,
    "Van": osc.VehicleCategory.VAN,
    "Truck": osc.VehicleCategory.TRUCK,
    "Bus": osc.VehicleCategory.BUS,
    "Motorcycle": osc.VehicleCategory.MOTORBIKE,
    "EmergencyVehicle": osc.VehicleCategory.VAN,
    "Bicycle": osc.VehicleCategory.BICYCLE,
}
_WALKERS = {
    "Pedestrian": osc.PedestrianCategory.PEDESTRIAN,
    "Animal": osc.PedestrianCategory.ANIMAL,
}
_OBJECTS = {
    "Misc": osc.MiscObjectCategory.OBSTACLE,
    "RoadCone": osc.MiscObjectCategory.OBSTACLE,
    "ConstructionCard": osc.MiscObjectCategory.POLE,
}
_ESMINI_CONTROLLER = "ExternalController"
# An axle as on a mid-size saloon; the ontology has no more of it than the wheelbase.
_MAX_STEERING = 0.6  # [rad]
_WHEEL_DIAMETER = 0.65  # [m]
_BODY_OVER_TRACK = 0.3  # [m], how much wider the body is than the track


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
    for name, category in _CATEGORIES.items():
        if individuals.is_a(node, name):
            role = osc.Role.AMBULANCE if name == "EmergencyVehicle" else None
            return _vehicle(individuals, node, category, role)
    for name, walker in _WALKERS.items():
        if individuals.is_a(node, name):
            return osc.Pedestrian(
                name=walker.value,
                pedestrian_category=walker,
                mass=individuals.number(node, "has_mass"),
                bounding_box=_box(individuals, node),
                properties=osc.Properties(),
                model3d=walker.value,
            )
    for name, kind in _OBJECTS.items():
        if individuals.is_a(node, name):
            return osc.MiscObject(
                name=name.lower(),
                misc_object_category=kind,
                mass=individuals.number(node, "has_mass"),
                bounding_box=_box(individuals, node),
                properties=osc.Properties(),
            )
    known = ", ".join((*_CATEGORIES, *_WALKERS, *_OBJECTS))
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
    properties = osc.Properties(
        (osc.Property("driver", driver), osc.Property("esminiController", _ESMINI_CONTROLLER))
    )
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
