"""Which kind of participant an entity's body is."""

from collections.abc import Callable, Iterator

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.declarations import KIND
from bridgegen.openx.openscenario.element import Element
from bridgegen.scenario.participants import PARTICIPANTS, ObjectClass, ParticipantKind

Resolve = Callable[[str | osc.ParameterRef], str | None]
"""Returns the text of an attribute, at its parameter's value; None where that is unknown."""

_EMERGENCY = PARTICIPANTS["emergency"]
_EMERGENCY_ROLES = (osc.Role.AMBULANCE, osc.Role.FIRE, osc.Role.POLICE)


def _literal(value: str | osc.ParameterRef) -> str | None:
    return None if isinstance(value, osc.ParameterRef) else value


def kind_of(body: Element, resolve: Resolve = _literal) -> ParticipantKind | None:
    """Return the kind of a body; None if no kind of ours fits.

    The property `KIND` decides; then a vehicle's role; then its category, of what stands at road
    works its name.
    """
    stated = _stated(body, resolve)
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
        named = (one for one in _written_as(body) if one.written.name == name)
        return next(named, None) or _by_category(body, body.misc_object_category, resolve)
    return None


def object_class_of(body: Element) -> ObjectClass:
    """Return what sensors and drivers take a body for."""
    if isinstance(body, osc.Vehicle) and _stated(body, _literal) is None:
        category = _literal(body.vehicle_category)
        alike = (
            one.seen_as
            for one in _written_as(body)
            if one.written.is_exact and category in (one.written.category, *one.written.also)
        )
        return next(alike, PARTICIPANTS["obstacle"].seen_as)
    kind = kind_of(body)
    return PARTICIPANTS["obstacle"].seen_as if kind is None else kind.seen_as


def _written_as(body: Element) -> Iterator[ParticipantKind]:
    tag = type(body).__name__
    return (one for one in PARTICIPANTS.values() if one.written.element == tag)


def _stated(body: Element, resolve: Resolve) -> ParticipantKind | None:
    properties = getattr(body, "properties", None)
    said = None if properties is None else properties.get(KIND)
    name = None if said is None else resolve(said)
    return next((one for one in _written_as(body) if one.name == name), None)


def _by_category(
    body: Element, category: str | osc.ParameterRef, resolve: Resolve
) -> ParticipantKind | None:
    name = resolve(category)
    exact = (
        one
        for one in _written_as(body)
        if one.takes_part and one.written.is_exact and one.written.role is None
    )
    return next((one for one in exact if one.written.category == name), None)
