"""The bodies of entities: how large they are, what they can do, who tows whom."""

import math

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.drivers.kinds import NAMES
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.bodies import object_class_of
from bridgegen.openx.openscenario.declarations import SIREN
from bridgegen.openx.openscenario.element import Element
from bridgegen.simulation.embedded.compiler.tables import TRAILERS, Tables, table

Body = osc.Vehicle | osc.Pedestrian | osc.MiscObject | osc.ExternalObjectReference

_STEEPEST = 1.5  # rad, a steering angle that is as good as a right angle


def kind(body: Body) -> int:
    """Return what an entity is, see `bridgegen.drivers.kinds`."""
    return NAMES.index(object_class_of(body).name)


def has_siren(body: Body) -> bool:
    """Return whether a body is an emergency vehicle whose blue light and siren are on."""
    if not isinstance(body, osc.Vehicle) or body.properties is None:
        return False
    return str(body.properties.get(SIREN)).lower() in ("on", "true", "1")


def wheelbase(tables: Tables, body: osc.Vehicle) -> float:
    """Return the distance between the axles [m]; 0 of a vehicle with one axle."""
    rear, front = body.axles.rear, body.axles.front or body.axles.rear
    ahead = tables.literal(front, "positionX", front.position_x)
    return ahead - tables.literal(rear, "positionX", rear.position_x)


def measures(tables: Tables, body: Body) -> tuple[float, ...]:
    """Return a row of ``Program.bodies``; missing limits are infinite."""
    if isinstance(body, osc.ExternalObjectReference):
        tables.unsupported(body, "ExternalObjectReference")
        return (0.0,) * 8
    box = body.bounding_box
    height = tables.literal(box.dimensions, "height", box.dimensions.height)
    size = (
        tables.literal(box.dimensions, "length", box.dimensions.length),
        tables.literal(box.dimensions, "width", box.dimensions.width),
        tables.literal(box.center, "x", box.center.x),
    )
    if not isinstance(body, osc.Vehicle):
        return (*size, math.inf, math.inf, math.inf, math.inf, height)
    limits, axles = body.performance, body.axles
    front, distance = axles.front or axles.rear, wheelbase(tables, body)
    lock = tables.literal(front, "maxSteering", front.max_steering)
    bend = math.tan(min(lock, _STEEPEST)) / max(distance, 0.1)
    if distance <= 0.0 and body.vehicle_category in TRAILERS:
        bend = math.inf  # it has nothing to steer with, and goes where it is led
    elif distance <= 0.0:
        tables.unsupported(axles, "a Vehicle without a FrontAxle ahead of its RearAxle")
    return (
        *size,
        tables.literal(limits, "maxSpeed", limits.max_speed),
        tables.literal(limits, "maxAcceleration", limits.max_acceleration),
        tables.literal(limits, "maxDeceleration", limits.max_deceleration),
        bend,
        height,
    )


# --- Who tows whom: the couplings of vehicles at the start, and those that actions make ---


SHORTEST = 0.1
"""The least distance from a trailer's coupler to its axle [m]: a shorter one has no direction."""


class Towing:
    """The vehicles that tow, and their trailers.

    Attributes:
        towers: ``(E,)`` which vehicle tows each entity at the start; -1: none.

    Args:
        tables: the compiler's; takes down couplings that cannot be.
    """

    def __init__(self, tables: Tables) -> None:
        self._tables = tables
        self.towers: Int = np.full(len(tables.objects), -1, dtype=np.int64)
        self._pairs: dict[tuple[int, int], None] = {}

    def compile(self) -> None:
        """Take down who tows whom at the start."""
        for tower, one in enumerate(self._tables.objects):
            vehicle = one.entity_object
            if not isinstance(vehicle, osc.Vehicle) or vehicle.trailer is None:
                continue
            named = vehicle.trailer.trailer
            assert isinstance(named, osc.EntityRef)  # see `with_trailers_apart`
            towed = self._tables.entity(named.entity_ref)
            if self.towers[towed] >= 0:
                name = self._tables.names[towed]
                self._tables.unsupported(vehicle.trailer, f"a second vehicle that tows '{name}'")
            elif self.takes(vehicle.trailer, tower, towed):
                self.towers[towed] = tower

    def takes(self, element: Element, tower: int, towed: int) -> bool:
        """Return whether a vehicle can tow another one; it is noted that it may.

        Args:
            element: that says so.
            tower: the entity that tows.
            towed: the trailer.
        """
        names = self._tables.names
        front, rear = (self._tables.objects[e].entity_object for e in (tower, towed))
        problem = ""
        if not isinstance(front, osc.Vehicle) or front.trailer_hitch is None:
            problem = f"a trailer behind '{names[tower]}', which has no TrailerHitch,"
        elif not isinstance(rear, osc.Vehicle) or rear.trailer_coupler is None:
            problem = f"the trailer '{names[towed]}', which has no TrailerCoupler,"
        elif self._tables.literal(rear, "dx", rear.trailer_coupler.dx) < SHORTEST:
            problem = f"a TrailerCoupler less than {SHORTEST} m ahead of its axle"
        elif towed == 0:
            problem = "an ego that is towed"
        elif tower in self._behind(towed):
            problem = f"'{names[towed]}' as a trailer of itself"
        if problem:
            self._tables.unsupported(element, problem)
            return False
        self._pairs[tower, towed] = None
        return True

    def _behind(self, e: int) -> set[int]:
        """Return an entity, and all that it may tow."""
        found, left = {e}, [e]
        while left:
            now = left.pop()
            more = {towed for tower, towed in self._pairs if tower == now} - found
            found |= more
            left += sorted(more)
        return found

    def tows(self) -> Int:
        """Return who may tow whom, ``(W, 2)``: each vehicle behind what it is towed by."""
        left, found = list(self._pairs), list[tuple[int, int]]()
        while left:
            later = {towed for _, towed in left}
            ready = [pair for pair in left if pair[0] not in later]
            found += ready
            left = [pair for pair in left if pair not in ready]
        return table(found, 2)

    def couplings(self) -> Float:
        """Return where each entity tows and is towed, ``(E, 2)`` ahead of its reference [m]."""
        found = np.full((len(self._tables.objects), 2), math.nan)
        for e, one in enumerate(self._tables.objects):
            vehicle = one.entity_object
            if isinstance(vehicle, osc.Vehicle):
                for i, part in enumerate((vehicle.trailer_hitch, vehicle.trailer_coupler)):
                    if part is not None and self._pairs:
                        found[e, i] = self._tables.literal(part, "dx", part.dx)
        return found
