"""What a kind of event in recorded traffic is: its rule, and the quantities that each has."""

from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class EventQuantity:
    """A quantity of an event.

    Attributes:
        name: as expressions name it.
        unit: one of `bridgegen.scenario.language.parameters.UNITS`.
        description: what it is.
    """

    name: str
    unit: str
    description: str


@dataclass(frozen=True)
class EventKind:
    """A kind of event.

    Attributes:
        name: as scenario files name it.
        roles: of the participants besides the ego.
        rule: what counts as one.
        source: of the rule.
        quantities: by name.
        needs_lanes: whether only driving on lanes can hold one.
        needs_lights: whether only recordings with traffic lights can hold one.
        of_lights: the quantities that only such recordings say.
    """

    name: str
    roles: tuple[str, ...]
    rule: str
    source: str
    quantities: Mapping[str, EventQuantity]
    needs_lanes: bool = True
    needs_lights: bool = False
    of_lights: tuple[str, ...] = ()


EGO_SPEED = ("ego_speed", "m/s", "speed of the ego at the beginning")


def event_kind(
    name: str,
    roles: tuple[str, ...],
    rule: str,
    source: str,
    rows: tuple[tuple[str, str, str], ...],
    needs_lanes: bool = True,
    needs_lights: bool = False,
    of_lights: tuple[str, ...] = (),
) -> EventKind:
    """Return a kind of the rows of its quantities: name, unit, description."""
    quantities = {row[0]: EventQuantity(*row) for row in rows}
    return EventKind(name, roles, rule, source, quantities, needs_lanes, needs_lights, of_lights)
