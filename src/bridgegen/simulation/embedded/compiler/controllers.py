"""Who moves the ego, where a file switches controllers on and off: the storyboard, or its driver.

The ego's driver is the controller that names it (`declarations.DRIVER`); one that the user names
takes the place of whatever controller the file gives the ego. Other entities' drivers are named in
the same way, and drive all the time. No other controller is known here: where one is switched on,
the storyboard moves the entity, as the standard's default controller does, and a note says so. An
entity without one that is on is moved by the storyboard, too.
"""

from collections.abc import Iterator

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.declarations import DRIVER
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.values import Value
from bridgegen.simulation.embedded._codes import (
    BRAKE,
    CONTROL,
    IDLE,
    LATERALLY,
    LONGITUDINALLY,
    PARKING_BRAKE,
    PRESS,
    STEERING,
    THROTTLE,
)
from bridgegen.simulation.embedded.compiler.tables import Tables

UNSAID = -1

Part = osc.AssignControllerAction | osc.ActivateControllerAction | osc.OverrideControllerValueAction
"""Action that assigns, activates or overrides controllers."""

Switching = osc.AssignControllerAction | osc.ActivateControllerAction

_SWITCHES = {LATERALLY: "lateral", LONGITUDINALLY: "longitudinal"}


class Controllers:
    """Whether the ego's driver drives it, from the start on and from events on.

    Attributes:
        has_driver: whether there is one; set it before actions are added.
        replaces: whether it is one that the user names.

    Args:
        tables: the compiler's; takes down what cannot be run.
        scenario: the file.
    """

    def __init__(self, tables: Tables, scenario: osc.OpenScenario) -> None:
        self._tables, self._scenario = tables, scenario
        self.has_driver = self.replaces = False
        self._unknown: set[str] = set()
        self._first = {LATERALLY: UNSAID, LONGITUDINALLY: UNSAID}
        self._later: dict[int, list[int]] = {LATERALLY: [], LONGITUDINALLY: []}

    @property
    def drives(self) -> tuple[int, int]:
        """Whether the driver steers, and sets the speed, at the start: 1 or 0.

        Where the start does not say, it does, unless the first event that says anything switches
        it on.
        """
        # The standard has a controller off until it is switched on. A driver that the file says
        # nothing about drives from the start all the same, as one expects of ``--ego``.
        lateral, longitudinal = (
            first if first != UNSAID else int(self._later[which][:1] != [1])
            for which, first in self._first.items()
        )
        return lateral, longitudinal

    def may_rest(self, which: int) -> bool:
        """Return whether the driver does not steer, or set the speed, at some time."""
        return not self.drives[which] or 0 in self._later[which]

    def of(self, entity: int) -> Iterator[osc.Controller]:
        """Yield an entity's controllers from the start on, in the order of the file."""
        owner = self._tables.objects[entity or self._tables.ego]
        for controller in owner.object_controllers:
            yield controller.controller
        for private in self._scenario.storyboard.init.actions.privates:
            for wrapped in private.private_actions if private.entity_ref == owner.name else ():
                for part in parts(wrapped.action):
                    if isinstance(part, osc.AssignControllerAction):
                        yield _controller(part)

    def begin(self, action: Element, entity: int) -> None:
        """Take an action of the start."""
        for which, switched in self._switched(action, entity).items():
            if switched != UNSAID:
                self._first[which] = switched

    def row(self, action: Element, entity: int) -> tuple[int, ...] | None:
        """Return the row of an action of an event, None if it changes nothing."""
        for part in parts(action):
            if isinstance(part, osc.AssignControllerAction) and _names_driver(_controller(part)):
                self._tables.unsupported(part, "another driver than at the start")
        switched = self._switched(action, entity)
        for which, number in switched.items():
            if number != UNSAID:
                self._later[which].append(number)
        if all(number == UNSAID for number in switched.values()):
            return None
        slot = self._tables.slot(0.0)
        return entity, CONTROL, switched[LATERALLY], switched[LONGITUDINALLY], slot, slot, 0

    def _switched(self, action: Element, entity: int) -> dict[int, int]:
        """Return what an action switches on (1) and off (0) of what the driver does."""
        found = {LATERALLY: UNSAID, LONGITUDINALLY: UNSAID}
        for part in parts(action):
            if isinstance(part, osc.OverrideControllerValueAction):
                continue  # see ``pedals``
            is_drivers = entity == 0 and self.has_driver and self._is_drivers(part)
            for which, name in _SWITCHES.items():
                prefix = "activate_" if isinstance(part, osc.AssignControllerAction) else ""
                value = getattr(part, prefix + name)
                if value is None:
                    continue
                on = self._tables.truth(value)
                if is_drivers:
                    found[which] = int(on)
                elif entity > 0 and self._is_of_driver(part, entity):
                    if not on:
                        name = self._tables.names[entity]
                        self._tables.unsupported(part, f"switching off the driver of '{name}'")
                        break
                elif on:
                    self._stand_in(part, entity)
                    break
        return found

    def _is_drivers(self, part: Switching) -> bool:
        """Return whether an action is on the controller that the ego's driver is, or stands for."""
        # The user's driver is the system under test, whatever controller the file has in that
        # place.
        if self.replaces:
            return True
        if isinstance(part, osc.AssignControllerAction):
            return _names_driver(_controller(part))
        wanted = part.object_controller_ref or part.controller_ref
        mine = {str(controller.name) for controller in self.of(0) if _names_driver(controller)}
        for controller in self._tables.objects[0].object_controllers:
            if _names_driver(controller.controller) and controller.name is not None:
                mine.add(str(controller.name))
        return wanted is None or self._tables.text(wanted) in mine

    def _is_of_driver(self, part: Switching, entity: int) -> bool:
        """Return whether an action is on the controller that is an entity's driver."""
        if isinstance(part, osc.AssignControllerAction):
            return _names_driver(_controller(part))
        wanted = part.object_controller_ref or part.controller_ref
        mine = {str(controller.name) for controller in self.of(entity) if _names_driver(controller)}
        return self._tables.text(wanted) in mine if wanted is not None else bool(mine)

    def _stand_in(self, part: Switching, entity: int) -> None:
        """Note that the storyboard moves an entity whose controller is not known here.

        Refuse it where a known one would have to make way for it.
        """
        name = self._tables.names[entity]
        if any(_names_driver(controller) for controller in self.of(entity)):
            what = f"switching on another controller of '{name}' than its driver"
            self._tables.unsupported(part, what)
        # Not refused: that stopped every ALKS template and every fourth of esmini's files, though
        # what they say of the others runs.
        elif name not in self._unknown:
            self._unknown.add(name)
            hint = "; a driver in its place: --ego NAME" if entity == 0 else ""
            sentence = f"the storyboard moves '{name}': its controller is not known here{hint}"
            self._tables.note(part, sentence)


def parts(action: Element) -> Iterator[Part]:
    """Yield what an action does to controllers; nothing if it is on something else."""
    if isinstance(action, osc.ActivateControllerAction):
        yield action
    elif isinstance(action, osc.ControllerAction):
        parts = (
            action.assign_controller_action,
            action.override_controller_value_action,
            action.activate_controller_action,
        )
        yield from (part for part in parts if part is not None)


def _controller(part: osc.AssignControllerAction) -> osc.Controller:
    controller = part.controller
    return controller.controller if isinstance(controller, osc.ObjectController) else controller


def _names_driver(controller: osc.Controller) -> bool:
    return controller.properties is not None and controller.properties.get(DRIVER) is not None


# --- Pedals, wheel and gear that a storyboard holds; see ``_pedal_kernels`` ---


AT_ONCE = 1e9
"""Rate at which what has no ``maxRate`` reaches where it is held [1/s]."""

DISENGAGED = 0.5
"""Position of the clutch from which on the engine drives nothing [1]."""

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
            throttle = part.throttle
            yield self._row(entity, THROTTLE, throttle.active, throttle.value, throttle.max_rate)
        for column, brake in ((BRAKE, part.brake), (PARKING_BRAKE, part.parking_brake)):
            if brake is not None:
                yield self._brake(entity, column, brake)
        if part.steering_wheel is not None:
            yield from self._wheel(part.steering_wheel, entity, steers=steers)
        idle = self._idles(part)
        if idle is not None:
            yield self._row(entity, IDLE, idle, 1.0, None)

    def _row(
        self,
        entity: int,
        column: int,
        active: bool | osc.ParameterRef | osc.Expr,
        value: Value,
        rate: Value | None,
        wheelbase: float = 1.0,
    ) -> Row:
        slots = (self._tables.slot(number) for number in (value, AT_ONCE if rate is None else rate))
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
