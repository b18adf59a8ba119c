"""The actions of a storyboard, at the start and in events, as rows of integers."""

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType

from bridgegen.drivers import kinds as lamps
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element
from bridgegen.simulation.embedded._codes import (
    ACQUIRE,
    ADD_ENTITY,
    ASSIGN_ROUTE,
    CONNECT_TRAILER,
    DELETE_ENTITY,
    DISCONNECT_TRAILER,
    FOLLOW,
    FOLLOW_LAID,
    LANE_CHANGE,
    LANE_OFFSET,
    LATERALLY,
    SHOW,
    SWITCH,
    TELEPORT,
)
from bridgegen.simulation.embedded.compiler.controllers import Controllers, Pedals, parts
from bridgegen.simulation.embedded.compiler.courses import SHAPES, Courses
from bridgegen.simulation.embedded.compiler.global_actions import GlobalActions
from bridgegen.simulation.embedded.compiler.layouts import Layouts, Towing, is_laid
from bridgegen.simulation.embedded.compiler.positions import Positions
from bridgegen.simulation.embedded.compiler.tables import Tables
from bridgegen.simulation.embedded.compiler.trajectories import compile_trajectory
from bridgegen.simulation.embedded.program import (
    AlongTrajectory,
    LaneCheck,
    PathSpec,
    Spot,
)

_BY_TIME = 1

LAMPS: Mapping[str, int] = MappingProxyType(
    {
        osc.VehicleLightType.INDICATOR_LEFT: lamps.LEFT,
        osc.VehicleLightType.INDICATOR_RIGHT: lamps.RIGHT,
        osc.VehicleLightType.WARNING_LIGHTS: lamps.HAZARD,
        osc.VehicleLightType.BRAKE_LIGHTS: lamps.BRAKE,
    }
)
"""The lights of a vehicle that drivers here see."""

CONTROLLING = osc.ActivateControllerAction | osc.ControllerAction
"""The actions on who drives."""


class Actions:
    """What events change.

    Attributes:
        rows: as ``Program.actions`` has them.
        initial: the numbers of those that begin at the start.
        courses: what moves entities along their paths.
        laterals: as ``Program.laterals`` has them.
        routes: as ``Program.waypoints`` has them.
        lane_checks: lane changes that are known to be asked for.
        layouts: trajectories that are laid when they begin.

    Args:
        tables: the compiler's; takes down what cannot be run.
        paths: of the entities; trajectories of events are added.
        positions: takes the places that they name.
        global_actions: compiles what concerns all.
        controllers: compiles who drives.
        towing: compiles who tows whom.
    """

    def __init__(
        self,
        tables: Tables,
        paths: list[PathSpec],
        positions: Positions,
        global_actions: GlobalActions,
        controllers: Controllers,
        towing: Towing,
    ) -> None:
        self._tables, self._paths, self._global_actions = tables, paths, global_actions
        self._positions, self._controllers, self._towing = positions, controllers, towing
        self._driven: list[Element] = []
        self.routes: list[tuple[Spot, ...]] = []
        self.laterals: list[tuple[int, ...]] = []
        self.lane_checks: list[LaneCheck] = []
        self.courses = Courses(tables, positions)
        self._pedals = Pedals(tables)
        self.layouts = Layouts(tables, positions)
        self.rows: list[tuple[int, ...]] = []
        self.initial: list[int] = []

    def begin(self, action: osc.PrivateAction, entity: int) -> None:
        """Add what one entity does from the start on."""
        first, known = len(self.rows), len(self._tables.problems)
        self._private(action, entity)
        if len(self._tables.problems) > known:
            del self.rows[first:]
        for i in range(first, len(self.rows)):
            self.rows[i] = (*self.rows[i], 0)
            self.initial.append(i)

    def begin_pedals(self, action: Element, entity: int) -> None:
        """Add the pedals that one entity holds from the start on."""
        first = len(self.rows)
        self._press(action, entity)
        for i in range(first, len(self.rows)):
            self.rows[i] = (*self.rows[i], 0)
            self.initial.append(i)

    def _press(self, action: Element, entity: int) -> None:
        steers = entity == 0 and self._controllers.has_driver
        for part in parts(action):
            if isinstance(part, osc.OverrideControllerValueAction):
                self.rows += self._pedals.rows(part, entity, steers=steers)

    def begin_with_all(self, action: Element) -> None:
        """Add what concerns all from the start on."""
        if isinstance(action, osc.ParameterAction | osc.VariableAction):
            for row in self._global_actions.rows(action):
                self.initial.append(len(self.rows))
                self.rows.append((*row, 0))
        else:
            self._global_actions.begin_with(action)

    def add(self, part: osc.Action, named: Sequence[int], selected: Sequence[int]) -> None:
        """Add an action of an event; one that cannot be run is taken down and left out.

        Args:
            part: the action.
            named: the entities that it moves, if it is a private one.
            selected: those that it moves if they make the event's trigger fire.
        """
        first, known = len(self.rows), len(self._tables.problems)
        sure = None
        if isinstance(part.action, osc.GlobalAction):
            change = part.action.action
            if isinstance(change, osc.EntityAction):
                self._presence(change)
            else:
                self.rows += self._global_actions.rows(change)
        elif not isinstance(part.action, osc.PrivateAction):
            self._tables.unsupported(part.action, type(part.action).__name__)
        else:
            if not named and not selected:
                self._tables.unsupported(part, "a PrivateAction without an actor")
            for entity in named:
                self._private(part.action, entity)
            sure = len(self.rows)
            for entity in selected:
                self._private(part.action, entity)
        if len(self._tables.problems) > known:
            del self.rows[first:]
        for i in range(first, len(self.rows)):
            self.rows[i] = (*self.rows[i], int(sure is not None and i >= sure))

    def _private(self, wrapped: osc.PrivateAction, entity: int) -> None:
        action = wrapped.action
        inner = getattr(action, "action", action)
        if isinstance(action, osc.LateralAction):
            self._note_driven(inner, entity)
        if (row := self.courses.add(inner, entity)) is not None:
            self.rows.append(row)
        elif isinstance(inner, osc.LaneChangeAction):
            self._lane_change(inner, entity)
        elif isinstance(inner, osc.LaneOffsetAction):
            self._lane_offset(inner, entity)
        elif isinstance(action, osc.TeleportAction):
            place, slot = self._positions.add(action.position), self._tables.slot(0.0)
            self.rows.append((entity, TELEPORT, 0, 0, slot, slot, place))
        elif isinstance(action, osc.RoutingAction):
            self._routing(action.action, entity)
        elif isinstance(action, osc.TrailerAction):
            self._coupling(action, entity)
        elif isinstance(action, osc.VisibilityAction):
            shown = (int(self._tables.truth(flag)) for flag in (action.sensors, action.traffic))
            slot, (sensors, traffic) = self._tables.slot(0.0), shown
            self.rows.append((entity, SHOW, 0, sensors, slot, slot, traffic))
        elif isinstance(inner, osc.LightStateAction) and (switched := self.lamps(inner)):
            mode = self._tables.choice(osc.LightMode, inner.light_state.mode)
            is_lit, slot = int(mode != osc.LightMode.OFF), self._tables.slot(0.0)
            self.rows.append((entity, SWITCH, 0, switched, slot, slot, is_lit))
        elif isinstance(action, CONTROLLING):
            if (row := self._controllers.row(action, entity)) is not None:
                self.rows.append(row)
            self._press(action, entity)
        elif not self.is_unseen(inner, entity):
            self._tables.unsupported(action, f"{type(inner).__name__} in an Event")

    def lamps(self, action: Element) -> int:
        """Return which lamps that drivers here see an action switches, as bits; 0: none."""
        if not isinstance(action, osc.LightStateAction):
            return 0
        light = action.light_type.light
        if not isinstance(light, osc.VehicleLight):
            return 0
        return LAMPS.get(self._tables.text(light.vehicle_light_type), 0)

    def is_unseen(self, action: Element, entity: int) -> bool:
        """Return whether an action changes only what no driver here sees; note it then."""
        if isinstance(action, osc.LightStateAction | osc.AnimationAction):
            what = "other lights" if isinstance(action, osc.LightStateAction) else "animations"
            who = self._tables.names[entity]
            self._tables.note(action, f"no driver here sees the {what} of '{who}'")
            return True
        return False

    def _coupling(self, action: osc.TrailerAction, entity: int) -> None:
        """Add an action by which an entity takes a trailer, or leaves it."""
        slot = self._tables.slot(0.0)
        if isinstance(action.action, osc.DisconnectTrailerAction):
            self.rows.append((entity, DISCONNECT_TRAILER, 0, 0, slot, slot, 0))
            return
        towed = self._tables.entity(action.action.trailer_ref)
        if self._towing.takes(action.action, entity, towed):
            self.rows.append((entity, CONNECT_TRAILER, 0, towed, slot, slot, 0))

    def _presence(self, action: osc.EntityAction) -> None:
        """Add an action by which an entity comes or goes."""
        entity = self._tables.entity(action.entity_ref)
        if entity == 0 and self._controllers.has_driver:
            what = f"a {type(action.action).__name__} of the ego, which a driver drives,"
            self._tables.unsupported(action.action, what)
        kind, place, slot = DELETE_ENTITY, 0, self._tables.slot(0.0)
        if isinstance(action.action, osc.AddEntityAction):
            kind, place = ADD_ENTITY, self._positions.add(action.action.position)
        self.rows.append((entity, kind, 0, 0, slot, slot, place))

    def _routing(self, action: Element, entity: int) -> None:
        slot = self._tables.slot(0.0)
        if isinstance(action, osc.AssignRouteAction | osc.AcquirePositionAction):
            spots = self.waypoints(action)
            if spots:
                kind, place = ASSIGN_ROUTE, 0
                if isinstance(action, osc.AcquirePositionAction):
                    kind, place = ACQUIRE, self._positions.add(action.position)
                self.rows.append((entity, kind, 0, place, slot, slot, self.add_route(spots)))
        elif isinstance(action, osc.FollowTrajectoryAction):
            self._note_driven(action, entity)
            timing = action.time_reference.reference
            relative = isinstance(timing, osc.Timing) and (
                timing.domain_absolute_relative is osc.ReferenceContext.RELATIVE
            )
            if is_laid(action):
                start = self._tables.slot(action.initial_distance_offset or 0.0)
                number = self.layouts.add(action, entity)
                row = (entity, FOLLOW_LAID, 0, int(relative), start, slot, number)
                self.rows.append(row)
                return
            number = sum(isinstance(lanes, AlongTrajectory) for lanes in self._paths)
            path = compile_trajectory(self._tables, action)
            self._paths.append(path)
            offset = self._tables.slot(path.start)
            self.rows.append((entity, FOLLOW, 0, int(relative), offset, slot, number))
        else:
            self._tables.unsupported(action, f"{type(action).__name__} in an Event")

    def waypoints(
        self, action: osc.AssignRouteAction | osc.AcquirePositionAction
    ) -> tuple[Spot, ...]:
        """Return the places that a route passes, or the one that it leads to."""
        if isinstance(action, osc.AcquirePositionAction):
            found = [self._positions.spot(action.position)]
        else:
            found = [self._positions.spot(waypoint.position) for waypoint in action.route.waypoints]
        return tuple(spot for spot in found if spot is not None)

    def add_route(self, spots: tuple[Spot, ...]) -> int:
        """Return the number of a route, a new one if it is new."""
        if spots not in self.routes:
            self.routes.append(spots)
        return self.routes.index(spots) + 1

    def _lane_change(self, action: osc.LaneChangeAction, entity: int) -> None:
        shape, dimension, value = self.courses.dynamics(action.dynamics)
        target = action.lane_change_target.target
        other, lanes, lane = -1, None, None
        if isinstance(target, osc.RelativeTargetLane):
            other = self._tables.entity(target.entity_ref)
            lanes = int(self._tables.literal(target, "value", target.value))
        else:
            try:
                lane = int(str(target.value))
            except ValueError:
                self._tables.unsupported(target, f'value="{target.value}" (a lane id is needed)')
        # Where lanes count from another entity, its lane is known only when the action begins.
        if other in (-1, entity):
            self.lane_checks.append(LaneCheck(entity, lanes, lane, action.line))
        offset = self._tables.slot(action.target_lane_offset or 0.0)
        row = self._lateral(other, lanes if lane is None else lane)
        self.rows.append((entity, LANE_CHANGE, shape, dimension, offset, value, row))

    def _lane_offset(self, action: osc.LaneOffsetAction, entity: int) -> None:
        target, other = action.lane_offset_target.target, -1
        if isinstance(target, osc.RelativeTargetLaneOffset):
            other = self._tables.entity(target.entity_ref)
        dynamics = action.dynamics
        shape = self._shape(dynamics, dynamics.dynamics_shape)
        most = dynamics.max_lateral_acc
        slots = (
            self._tables.slot(target.value),
            self._tables.slot(math.inf if most is None else most),
        )
        if isinstance(action.continuous, osc.ParameterRef):
            self._tables.unsupported(action, f'continuous="{action.continuous}"')
        row = self._lateral(other, 0, continuous=action.continuous is True)
        self.rows.append((entity, LANE_OFFSET, shape, _BY_TIME, *slots, row))

    def _lateral(self, other: int, count: int | None, *, continuous: bool = False) -> int:
        self.laterals.append((other, count or 0, int(continuous)))
        return len(self.laterals) - 1

    def _note_driven(self, action: Element, entity: int) -> None:
        """Note what only the storyboard can do; see ``refuse_driven``."""
        if entity == 0 and self._controllers.has_driver:
            self._driven.append(action)

    def refuse_driven(self) -> None:
        """Take down what moves the ego across where a driver steers it all the time.

        To be called when all actions are known.
        """
        if not self._controllers.may_rest(LATERALLY):
            for action in self._driven:
                what = f"a {type(action).__name__} of the ego, which a driver drives,"
                self._tables.unsupported(action, what)

    def _shape(self, element: Element, shape: osc.DynamicsShape | osc.ParameterRef) -> int:
        if isinstance(shape, osc.ParameterRef):
            self._tables.unsupported(element, f'dynamicsShape="{shape}"')
            return 0
        return SHAPES[shape]

    @property
    def has_comings_and_goings(self) -> bool:
        """Whether entities are added or deleted."""
        return any(row[1] in (ADD_ENTITY, DELETE_ENTITY) for row in self.rows)

    def is_timed(self, entity: int) -> bool:
        """Say whether an entity follows a trajectory with times, which rules out all else."""
        path = self._paths[entity] if entity < len(self._paths) else None
        return isinstance(path, AlongTrajectory) and bool(path.times)
