"""What all parts of the compiler share: the slots, the entities' numbers, and the complaints."""

from collections.abc import Sequence
from enum import StrEnum
from typing import TypeVar

import numpy as np

from bridgegen.base.arrays import Int
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.parameters import numbers, values
from bridgegen.openx.openscenario.values import Expr, Value
from bridgegen.simulation.embedded.program import LanePoint, Point, WorldPoint

_OBJECTS = {
    osc.ObjectType.VEHICLE: osc.Vehicle,
    osc.ObjectType.PEDESTRIAN: osc.Pedestrian,
    osc.ObjectType.MISCELLANEOUS: osc.MiscObject,
    osc.ObjectType.EXTERNAL: osc.ExternalObjectReference,
}

TRAILERS = (osc.VehicleCategory.TRAILER, osc.VehicleCategory.SEMITRAILER)
"""The vehicles that are towed."""

Choice = TypeVar("Choice", bound=StrEnum)


class Tables:
    """Numbers for what a scenario file calls by name.

    Attributes:
        place: the file, for messages.
        objects: its entities, the ego first.
        ego: the number of the file's ego, whose controllers say what the system under test is.
        names: their names.
        parameters: the numeric parameters with their declared values.
        problems: what the rollout cannot do, a sentence each.
        culprits: the elements that cause it.
        notes: what runs otherwise than a reader of the file may expect, a sentence each.
        fixed: parameters that rows may not vary, and what they are used for.
    """

    def __init__(self, scenario: osc.OpenScenario, place: str, ego: int = 0) -> None:
        self.place = place
        objects = scenario.entities.scenario_objects
        self.objects = sorted(objects, key=_rank)
        self.ego = ego
        if ego:  # another that the same driver drives is in its place
            self.objects[0], self.objects[ego] = self.objects[ego], self.objects[0]
        self._selections = {
            str(selection.name): selection for selection in scenario.entities.entity_selections
        }
        self.names = tuple(str(obj.name) for obj in self.objects)
        self.parameters = numbers(scenario)
        self._declared = values(scenario)
        self.problems: list[str] = []
        self.culprits: list[Element] = []
        self.notes: list[str] = []
        self.fixed: dict[str, str] = {}
        self._slots: dict[tuple[type, Value], int] = {}

    @property
    def slots(self) -> tuple[Value, ...]:
        """The distinct values so far, in the order of their numbers."""
        return tuple(value for _, value in self._slots)

    def slot(self, value: Value) -> int:
        """Return the number of a value's slot, a new one if it is new."""
        key = value if isinstance(value, osc.ParameterRef | Expr) else float(value)
        return self._slots.setdefault((type(key), key), len(self._slots))

    def entity(self, name: object) -> int:
        """Return an entity's number; report a problem if several or none are named."""
        if str(name) not in self.names:
            self.problems.append(f"{self.place}: '{name}' where one entity is needed")
            return 0
        return self.names.index(str(name))

    def members(self, name: object) -> tuple[int, ...]:
        """Return the numbers of an entity, or of the entities of a selection, each once."""
        selection = self._selections.get(str(name))
        if selection is None:
            return (self.entity(name),)
        found: dict[int, None] = {}
        for member in selection.members.members:
            if isinstance(member, osc.EntityRef):
                found[self.entity(member.entity_ref)] = None
            else:
                found |= dict.fromkeys(self.of_type(member.object_type))
        return tuple(found)

    def of_type(self, kind: osc.ObjectType | osc.ParameterRef) -> list[int]:
        """Return the numbers of the entities of a kind."""
        wanted = _OBJECTS[self.choice(osc.ObjectType, kind)]
        return [e for e, obj in enumerate(self.objects) if isinstance(obj.entity_object, wanted)]

    def type_number(self, kind: osc.ObjectType | osc.ParameterRef) -> int:
        """Return the number of a kind of entities."""
        return list(_OBJECTS).index(self.choice(osc.ObjectType, kind))

    def type_of(self, body: object) -> int:
        """Return the number of an entity's kind."""
        return next(i for i, kind in enumerate(_OBJECTS.values()) if isinstance(body, kind))

    def unsupported(self, element: Element, what: str) -> None:
        """Record an unsupported element, with its line."""
        line = f", line {element.line}" if element.line else ""
        # Collected, not raised: a user sees all that is wrong in a file at once.
        self.problems.append(f"{self.place}{line}: {what} is not supported")
        self.culprits.append(element)

    def note(self, element: Element, sentence: str) -> None:
        """Record how something is run, with its line."""
        line = f", line {element.line}" if element.line else ""
        self.notes.append(f"{self.place}{line}: {sentence}")

    def literal(self, element: Element, name: str, value: Value) -> float:
        """Return a number that rows may not vary: parameters keep their declared values."""
        if isinstance(value, osc.ParameterRef | Expr):
            line = f" (line {element.line})" if element.line else ""
            self.fixed |= dict.fromkeys(value.names, f'{name}="{value}"{line}')
        return self.declared(value)

    def declared(self, value: Value) -> float:
        """Return what a value is by the declared values of the parameters."""
        if isinstance(value, osc.ParameterRef | Expr):
            return float(value.resolve(self.parameters))
        return float(value)

    def text(self, value: str | osc.ParameterRef) -> str:
        """Return a text; a parameter of text has the same value in every row."""
        return str(self._declared[value.name] if isinstance(value, osc.ParameterRef) else value)

    def truth(self, value: bool | osc.ParameterRef | Expr) -> bool:
        """Return a Boolean; a parameter of one has the same value in every row."""
        if isinstance(value, Expr):
            return bool(self.declared(value))
        if isinstance(value, osc.ParameterRef):
            return self.text(value).lower() in ("true", "1", "1.0")
        return value

    def choice(self, enum: type[Choice], value: str | osc.ParameterRef) -> Choice:
        """Return the number of an enumeration's value; report an unsupported one."""
        text = self.text(value)
        if text not in tuple(enum):
            known = ", ".join(enum)
            self.problems.append(f"{self.place}: one of {known} is needed, got '{text}' ({value})")
            return next(iter(enum))
        return enum(text)

    def point(self, position: osc.Position) -> tuple[Point | None, Value]:
        """Return a position and how far it is aside of its lane's centre [m]."""
        where = position.position
        if isinstance(where, osc.WorldPosition):
            x, y = (self.literal(where, name, getattr(where, name)) for name in ("x", "y"))
            h = None if where.h is None else self.literal(where, "h", where.h)
            return WorldPoint(x, y, where.line, h), 0.0
        if not isinstance(where, osc.LanePosition):
            self.unsupported(where, f"{type(where).__name__} here")
            return None, 0.0
        return self._on_lane(where), where.offset or 0.0

    def _on_lane(self, where: osc.LanePosition) -> LanePoint | None:
        turned = where.orientation
        if turned is not None and any(
            value not in (None, 0.0) for value in (turned.h, turned.p, turned.r)
        ):
            self.unsupported(turned, "an Orientation other than the lane's")
        try:
            lane = int(str(where.lane_id))
        except ValueError:
            self.unsupported(where, f'laneId="{where.lane_id}" (a whole number is needed)')
            return None
        return LanePoint(str(where.road_id), lane, where.s, where.line)


def _rank(scenario_object: osc.ScenarioObject) -> tuple[bool, bool]:
    """Return what the ego has least of: another name, and being a trailer."""
    body = scenario_object.entity_object
    is_trailer = isinstance(body, osc.Vehicle) and body.vehicle_category in TRAILERS
    return str(scenario_object.name).lower() != "ego", is_trailer


def table(rows: Sequence[tuple[int, ...]], width: int) -> Int:
    """Return rows of numbers as an array, also if there are none."""
    return np.array(rows, dtype=np.int64).reshape(len(rows), width)
