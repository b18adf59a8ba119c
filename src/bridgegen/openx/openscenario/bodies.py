"""A participant's body as OpenSCENARIO says it, and which kind of participant a body is."""

from collections.abc import Callable, Iterator, Mapping, Sequence

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.declarations import KIND
from bridgegen.openx.openscenario.element import Element
from bridgegen.scenario.participants import PARTICIPANTS, Body, ObjectClass, ParticipantKind

EntityBody = osc.Vehicle | osc.Pedestrian | osc.MiscObject

# An axle as on a mid-size saloon; bodies have no more of it than the wheelbase.
_MAX_STEERING = 0.6  # [rad]
_WHEEL_DIAMETER = 0.65  # [m]
_BODY_OVER_TRACK = 0.3  # [m], how much wider the body is than the track


def entity_body(
    kind: ParticipantKind,
    body: Body,
    *,
    mass: float | None,
    model: str | None = None,
    properties: Sequence[osc.Property] = (),
) -> EntityBody:
    """Return the body of an entity.

    Args:
        kind: what it is; where its category does not say so, a property does.
        body: its size, and what it can do.
        mass: [kg]; None where it is not known, of a vehicle only.
        model: name of the model; the kind's by default.
        properties: further ones.
    """
    return _MAKE[kind.written.element](kind, body, mass, model, tuple(properties))


def _vehicle(
    kind: ParticipantKind,
    body: Body,
    mass: float | None,
    model: str | None,
    properties: tuple[osc.Property, ...],
) -> osc.Vehicle:
    written = kind.written
    return osc.Vehicle(
        name=model or written.name or written.category,
        vehicle_category=osc.VehicleCategory(written.category),
        bounding_box=_box(body),
        performance=osc.Performance(body.max_speed, body.max_acceleration, body.max_deceleration),
        axles=osc.Axles(
            _axle(_MAX_STEERING, body.width, body.wheelbase), _axle(0.0, body.width, 0.0)
        ),
        properties=osc.Properties((*_stated(kind), *properties)),
        role=None if written.role is None else osc.Role(written.role),
        mass=mass,
    )


def _pedestrian(
    kind: ParticipantKind,
    body: Body,
    mass: float | None,
    model: str | None,
    properties: tuple[osc.Property, ...],
) -> osc.Pedestrian:
    name = kind.written.name or kind.written.category
    return osc.Pedestrian(
        name=model or name,
        pedestrian_category=osc.PedestrianCategory(kind.written.category),
        mass=_known(mass),
        bounding_box=_box(body),
        properties=osc.Properties((*properties, *_stated(kind))),
        model3d=name,
    )


def _object(
    kind: ParticipantKind,
    body: Body,
    mass: float | None,
    model: str | None,
    properties: tuple[osc.Property, ...],
) -> osc.MiscObject:
    return osc.MiscObject(
        name=model or kind.written.name or kind.written.category,
        misc_object_category=osc.MiscObjectCategory(kind.written.category),
        mass=_known(mass),
        bounding_box=_box(body),
        properties=osc.Properties((*properties, *_stated(kind))),
    )


_MAKE: Mapping[
    str,
    Callable[
        [ParticipantKind, Body, float | None, str | None, tuple[osc.Property, ...]], EntityBody
    ],
] = {"Vehicle": _vehicle, "Pedestrian": _pedestrian, "MiscObject": _object}


def _known(mass: float | None) -> float:
    assert mass is not None  # OpenSCENARIO asks for it
    return mass


def _stated(kind: ParticipantKind) -> tuple[osc.Property, ...]:
    """Return the property that names a kind that the category alone does not identify."""
    return () if kind.written.is_exact else (osc.Property(KIND, kind.name),)


def _box(body: Body) -> osc.BoundingBox:
    return osc.BoundingBox(
        osc.Center(body.center_ahead, 0.0, body.height / 2),
        osc.Dimensions(body.width, body.length, body.height),
    )


def _axle(max_steering: float, body_width: float, x: float) -> osc.Axle:
    return osc.Axle(
        max_steering=max_steering,
        wheel_diameter=_WHEEL_DIAMETER,
        track_width=max(round(body_width - _BODY_OVER_TRACK, 3), 0.1),
        position_x=x,
        position_z=_WHEEL_DIAMETER / 2,
    )


# --- Which kind of participant an entity's body is ---


Resolve = Callable[[str | osc.ParameterRef], str | None]
"""Function that returns the text of an attribute, at its parameter's value; None where that is
unknown."""

_EMERGENCY = PARTICIPANTS["emergency"]
_EMERGENCY_ROLES = (osc.Role.AMBULANCE, osc.Role.FIRE, osc.Role.POLICE)


def _literal(value: str | osc.ParameterRef) -> str | None:
    return None if isinstance(value, osc.ParameterRef) else value


def kind_of(body: Element, resolve: Resolve = _literal) -> ParticipantKind | None:
    """Return the kind of a body; None if no kind of ours fits.

    The property `KIND` decides; then a vehicle's role; then its category, of what stands at road
    works its name.
    """
    stated = _stated_kind(body, resolve)
    if stated is not None:
        return stated
    if isinstance(body, osc.Vehicle):
        kind = _by_category(body, body.vehicle_category, resolve)
        role = None if body.role is None else resolve(body.role)
        return _EMERGENCY if kind is not None and role in _EMERGENCY_ROLES else kind
    if isinstance(body, osc.Pedestrian):
        found = _by_category(body, body.pedestrian_category, resolve)
        return PARTICIPANTS["pedestrian"] if found is None else found
    if isinstance(body, osc.MiscObject):
        name = str(resolve(body.name)).lower()
        named = (
            participant_kind
            for participant_kind in _written_as(body)
            if participant_kind.written.name == name
        )
        return next(named, None) or _by_category(body, body.misc_object_category, resolve)
    return None


def object_class_of(body: Element) -> ObjectClass:
    """Return what sensors and drivers take a body for."""
    if isinstance(body, osc.Vehicle) and _stated_kind(body, _literal) is None:
        category = _literal(body.vehicle_category)
        alike = (
            participant_kind.seen_as
            for participant_kind in _written_as(body)
            if participant_kind.written.is_exact
            and category in (participant_kind.written.category, *participant_kind.written.also)
        )
        return next(alike, PARTICIPANTS["obstacle"].seen_as)
    kind = kind_of(body)
    return PARTICIPANTS["obstacle"].seen_as if kind is None else kind.seen_as


def _written_as(body: Element) -> Iterator[ParticipantKind]:
    tag = type(body).__name__
    return (
        participant for participant in PARTICIPANTS.values() if participant.written.element == tag
    )


def _stated_kind(body: Element, resolve: Resolve) -> ParticipantKind | None:
    properties = getattr(body, "properties", None)
    said = None if properties is None else properties.get(KIND)
    name = None if said is None else resolve(said)
    return next((kind for kind in _written_as(body) if kind.name == name), None)


def _by_category(
    body: Element, category: str | osc.ParameterRef, resolve: Resolve
) -> ParticipantKind | None:
    name = resolve(category)
    exact = (
        kind
        for kind in _written_as(body)
        if kind.takes_part and kind.written.is_exact and kind.written.role is None
    )
    return next((kind for kind in exact if kind.written.category == name), None)
