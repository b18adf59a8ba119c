"""Pedals, wheel and gear that a storyboard holds, as rows of integers; see ``_pedal_kernels``."""

from collections.abc import Iterator

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.values import Value
from bridgegen.simulation.embedded._codes import (
    BRAKE,
    IDLE,
    PARKING_BRAKE,
    PRESS,
    STEERING,
    THROTTLE,
)
from bridgegen.simulation.embedded.compiler.tables import Tables

AT_ONCE = 1e9
"""[1/s] How fast what has no ``maxRate`` gets where it is held."""

DISENGAGED = 0.5
"""[1] From this position of the clutch on, the engine drives nothing."""

Row = tuple[int, ...]


class Pedals:
    """What holds pedals, and lets go of them.

    Args:
        tables: the compiler's; takes down what cannot be run.
    """

    def __init__(self, tables: Tables) -> None:
        self._tables = tables

    def rows(
        self, part: osc.OverrideControllerValueAction, entity: int, *, steers: bool
    ) -> Iterator[Row]:
        """Yield the rows of an action.

        Args:
            part: the action.
            entity: whose pedals.
            steers: whether the entity has a driver, whose wheel may be held.
        """
        if part.throttle is not None:
            one = part.throttle
            yield self._row(entity, THROTTLE, one.active, one.value, one.max_rate)
        for column, brake in ((BRAKE, part.brake), (PARKING_BRAKE, part.parking_brake)):
            if brake is not None:
                yield self._brake(entity, column, brake)
        if part.steering_wheel is not None:
            yield from self._wheel(part.steering_wheel, entity, steers=steers)
        idle = self._idles(part)
        if idle is not None:
            yield self._row(entity, IDLE, idle, 1.0, None)

    def _row(
        self, entity: int, column: int, active: bool | osc.ParameterRef | osc.Expr, value: Value,
        rate: Value | None, wheelbase: float = 1.0,
    ) -> Row:  # fmt: skip
        slots = (self._tables.slot(one) for one in (value, AT_ONCE if rate is None else rate))
        is_held = int(self._tables.truth(active))
        return entity, PRESS, is_held, column, *slots, self._tables.slot(wheelbase)

    def _brake(self, entity: int, column: int, brake: osc.OverrideBrakeAction) -> Row:
        said: Value | None = brake.value
        rate: Value | None = None
        if isinstance(brake.brake, osc.BrakePercent):
            said, rate = brake.brake.value, brake.brake.max_rate
        elif brake.brake is not None and self._tables.truth(brake.active):
            self._tables.unsupported(brake, "BrakeForce: masses of vehicles are not used here,")
        return self._row(entity, column, brake.active, 0.0 if said is None else said, rate)

    def _wheel(
        self, wheel: osc.OverrideSteeringWheelAction, entity: int, *, steers: bool
    ) -> Iterator[Row]:
        if self._tables.truth(wheel.active):
            name = self._tables.names[entity]
            if not steers:
                what = f"the steering wheel of '{name}', which keeps to its path,"
                self._tables.unsupported(wheel, what)
                return
            if wheel.max_torque is not None:
                self._tables.unsupported(wheel, f"maxTorque of the steering wheel of '{name}'")
        axles = getattr(self._tables.objects[entity].entity_object, "axles", None)
        if axles is None or axles.front is None:
            return
        front, rear = axles.front.position_x, axles.rear.position_x
        base = self._tables.literal(axles.front, "positionX", front)
        base -= self._tables.literal(axles.rear, "positionX", rear)
        yield self._row(entity, STEERING, wheel.active, wheel.value, wheel.max_rate, max(base, 0.1))

    def _idles(self, part: osc.OverrideControllerValueAction) -> bool | None:
        """Return whether the engine drives nothing: the clutch is open, or no gear is in.

        None: the action says nothing of either.
        """
        found: bool | None = None
        if part.clutch is not None:
            held = self._tables.truth(part.clutch.active)
            found = held and self._tables.declared(part.clutch.value) >= DISENGAGED
        if part.gear is None:
            return found
        held, gear = self._tables.truth(part.gear.active), part.gear.gear
        idle = False
        if isinstance(gear, osc.AutomaticGear):
            which = self._tables.choice(osc.AutomaticGearType, gear.gear)
            idle = which in (osc.AutomaticGearType.N, osc.AutomaticGearType.P)
            back = which is osc.AutomaticGearType.R
        else:
            number = part.gear.number if gear is None else gear.number
            now = self._tables.declared(1.0 if number is None else number)
            idle, back = now == 0.0, now < 0.0
        if held and back:
            self._tables.unsupported(part.gear, "a gear that leads back, held by an override,")
        return bool(found) or (held and idle)
