"""The actions that move an entity along its path, or by another one, as rows of integers."""

import math

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.values import Expr, Value
from bridgegen.simulation.embedded import _codes as codes
from bridgegen.simulation.embedded.compiler.positions import Positions
from bridgegen.simulation.embedded.compiler.tables import Tables

SHAPES = {
    osc.DynamicsShape.STEP: 0,
    osc.DynamicsShape.LINEAR: 1,
    osc.DynamicsShape.CUBIC: 2,
    osc.DynamicsShape.SINUSOIDAL: 3,
}
_DIMENSIONS = {
    osc.DynamicsDimension.RATE: 0,
    osc.DynamicsDimension.TIME: 1,
    osc.DynamicsDimension.DISTANCE: 2,
}
_SIDES = {
    osc.LongitudinalDisplacement.ANY: codes.EITHER_SIDE,
    osc.LongitudinalDisplacement.TRAILING_REFERENCED_ENTITY: codes.BEHIND,
    osc.LongitudinalDisplacement.LEADING_REFERENCED_ENTITY: codes.AHEAD,
}
_LATERAL_SIDES = {
    osc.LateralDisplacement.ANY: codes.EITHER_SIDE,
    osc.LateralDisplacement.LEFT_TO_REFERENCED_ENTITY: codes.LEFT_SIDE,
    osc.LateralDisplacement.RIGHT_TO_REFERENCED_ENTITY: codes.RIGHT_SIDE,
}
_ALONG = (
    osc.CoordinateSystem.LANE,
    osc.CoordinateSystem.ROAD,
    osc.CoordinateSystem.TRAJECTORY,
)

LONGITUDINAL = (
    osc.SpeedAction,
    osc.SpeedProfileAction,
    osc.LongitudinalDistanceAction,
    osc.SynchronizeAction,
)
"""Actions that move an entity along its path."""

Row = tuple[int, ...]


def first_speed(action: object) -> Value | None:
    """Return the speed that an initial action sets at once; None if it does anything else."""
    if not isinstance(action, osc.SpeedAction):
        return None
    target = action.speed_action_target.target
    dynamics = action.dynamics
    at_once = dynamics.dynamics_shape is osc.DynamicsShape.STEP or (
        dynamics.value == 0.0 and dynamics.dynamics_dimension is not osc.DynamicsDimension.RATE
    )
    return target.value if at_once and isinstance(target, osc.AbsoluteTargetSpeed) else None


class Courses:
    """Compiles longitudinal actions and lateral distances; takes down what cannot be run.

    Attributes:
        rows: as ``Program.courses`` has them.
        entries: of speed profiles, as ``Program.entries`` has them.
        pairs: which entity goes by which.

    Args:
        tables: the compiler's.
        positions: takes those of synchronisations.
    """

    def __init__(self, tables: Tables, positions: Positions) -> None:
        self._tables, self._positions = tables, positions
        self.rows: list[Row] = []
        self.entries: list[tuple[int, int]] = []
        self.pairs: list[tuple[int, int]] = []

    def add(self, action: object, entity: int) -> Row | None:
        """Return an action's row of ``Program.actions``; None if it is none of these."""
        match action:
            case osc.SpeedAction():
                return self._speed(action, entity)
            case osc.SpeedProfileAction():
                return self._profile(action, entity)
            case osc.LongitudinalDistanceAction():
                return self._distance(action, entity)
            case osc.LateralDistanceAction():
                return self._lateral_distance(action, entity)
            case osc.SynchronizeAction():
                return self._synchronise(action, entity)
        return None

    def dynamics(self, dynamics: osc.TransitionDynamics) -> tuple[int, int, int]:
        """Return shape, dimension and the slot of the value."""
        shape = self._tables.choice(osc.DynamicsShape, dynamics.dynamics_shape)
        dimension = self._tables.choice(osc.DynamicsDimension, dynamics.dynamics_dimension)
        return SHAPES[shape], _DIMENSIONS[dimension], self._tables.slot(dynamics.value)

    def order(self) -> tuple[list[int], list[int]]:
        """Return the entities, each after those that it goes by, and the place of each therein.

        Where they go by each other in a circle, the first of the file comes first.
        """
        order: list[int] = []
        leaders: dict[int, list[int]] = {}
        for follower, leader in self.pairs:
            leaders.setdefault(follower, []).append(leader)

        def visit(entity: int, above: tuple[int, ...]) -> None:
            if entity in order or entity in above:
                return
            for leader in leaders.get(entity, ()):
                visit(leader, (*above, entity))
            order.append(entity)

        for entity in range(len(self._tables.names)):
            visit(entity, ())
        return order, [order.index(entity) for entity in range(len(order))]

    def _speed(self, action: osc.SpeedAction, entity: int) -> Row:
        shape, dimension, value = self.dynamics(action.dynamics)
        target = action.speed_action_target.target
        slot = self._tables.slot(target.value)
        if isinstance(target, osc.AbsoluteTargetSpeed):
            return entity, codes.SPEED_CHANGE, shape, dimension, slot, value, 0
        continuous = self._flag(target, "continuous", target.continuous)
        if continuous and dimension != 0 and shape != 0:
            dimension_ = action.dynamics.dynamics_dimension
            sentence = (
                f'continuous="true" over a {dimension_}: there in time, and kept from then on'
            )
            self._tables.note(target, sentence)
        kind = self._tables.choice(osc.SpeedTargetValueType, target.speed_target_value_type)
        row = self._row(entity, target.entity_ref)
        row[codes.IS_FACTOR] = int(kind is osc.SpeedTargetValueType.FACTOR)
        row[codes.CONTINUOUS] = int(continuous)
        return entity, codes.RELATIVE_SPEED, shape, dimension, slot, value, self._keep(row)

    def _profile(self, action: osc.SpeedProfileAction, entity: int) -> Row:
        row = self._row(entity, action.entity_ref)
        mode = self._tables.choice(osc.FollowingMode, action.following_mode)
        row[codes.FOLLOWS] = int(mode is osc.FollowingMode.FOLLOW)
        row[codes.FIRST_ENTRY] = len(self.entries)
        for entry in action.entries:
            time = -1 if entry.time is None else self._tables.slot(entry.time)
            self.entries.append((self._tables.slot(entry.speed), time))
        row[codes.PAST_ENTRY] = len(self.entries)
        self._limit(row, action.dynamic_constraints)
        return entity, codes.SPEED_PROFILE, 0, 0, 0, 0, self._keep(row)

    def _distance(self, action: osc.LongitudinalDistanceAction, entity: int) -> Row:
        row = self._row(entity, action.entity_ref)
        given = [value for value in (action.distance, action.time_gap) if value is not None]
        if len(given) != 1:
            self._tables.unsupported(
                action, "a LongitudinalDistanceAction without distance or timeGap, or with both,"
            )
        row[codes.IS_TIME_GAP] = int(action.time_gap is not None)
        side = osc.LongitudinalDisplacement.TRAILING_REFERENCED_ENTITY
        if action.displacement is not None:
            side = self._tables.choice(osc.LongitudinalDisplacement, action.displacement)
        row[codes.SIDE] = _SIDES[side]
        self._keep_off(row, action)
        value: Value = given[0] if given else 0.0
        if self._tables.declared(value) < 0.0:
            value = self._size(action, value, row)
        slot = self._tables.slot(value)
        return entity, codes.KEEP_DISTANCE, 0, 0, slot, slot, self._keep(row)

    def _size(self, action: osc.LongitudinalDistanceAction, value: Value, row: list[int]) -> Value:
        """Return a number below 0 without its sign, which the standard does not have; note it.

        The displacement says on which side. 1.0 has none: there the sign does, as for esmini.
        """
        if action.displacement is None and self._positions.minor == 0:
            row[codes.SIDE] = codes.AHEAD
        side = {codes.BEHIND: "behind", codes.AHEAD: "ahead of"}
        where = side.get(row[codes.SIDE], "on its present side of")
        unit, now = "m" if action.time_gap is None else "s", self._tables.declared(value)
        said = f"{now:g} {unit}, below 0, is read as {-now:g} {unit} {where} '{action.entity_ref}'"
        self._tables.note(action, said)
        if isinstance(value, osc.ParameterRef | Expr):
            inner = value.text[2:-1] if isinstance(value, Expr) else value.text
            return Expr(f"${{abs({inner})}}")
        return -now

    def _lateral_distance(self, action: osc.LateralDistanceAction, entity: int) -> Row:
        row = self._row(entity, action.entity_ref)
        row[codes.IS_PRESENT] = int(action.distance is None)
        side = osc.LateralDisplacement.ANY
        if action.displacement is not None:
            side = self._tables.choice(osc.LateralDisplacement, action.displacement)
        row[codes.SIDE] = _LATERAL_SIDES[side]
        self._keep_off(row, action)
        slot = self._tables.slot(action.distance or 0.0)
        return entity, codes.KEEP_ASIDE, 0, 0, slot, slot, self._keep(row)

    def _keep_off(
        self, row: list[int], action: osc.LongitudinalDistanceAction | osc.LateralDistanceAction
    ) -> None:
        """Take down how a distance to another entity is measured, and how fast it may change."""
        row[codes.CONTINUOUS] = int(self._flag(action, "continuous", action.continuous))
        row[codes.FREESPACE] = int(self._flag(action, "freespace", action.freespace))
        system = osc.CoordinateSystem.ENTITY
        if action.coordinate_system is not None:
            system = self._tables.choice(osc.CoordinateSystem, action.coordinate_system)
        if system is osc.CoordinateSystem.WORLD:
            self._tables.unsupported(action, 'coordinateSystem="world"')
        row[codes.BY_BODY] = int(system not in _ALONG)
        limits = action.dynamic_constraints or osc.DynamicConstraints()
        bounds = [limits.max_acceleration, limits.max_deceleration]
        if isinstance(action, osc.LateralDistanceAction):
            bounds.append(limits.max_speed)
            for rate in (limits.max_acceleration_rate, limits.max_deceleration_rate):
                if rate is not None and rate != math.inf:
                    self._tables.unsupported(limits, "a rate of a lateral acceleration")
        row[codes.UNLIMITED] = int(all(bound is None for bound in bounds))
        self._limit(row, limits)

    def _synchronise(self, action: osc.SynchronizeAction, entity: int) -> Row:
        row = self._row(entity, action.master_entity_ref)
        row[codes.OWN_PLACE] = self._positions.place(action.target_position)
        row[codes.MASTER_PLACE] = self._positions.place(action.target_position_master)
        row[codes.TOLERANCE] = self._optional(action.target_tolerance)
        row[codes.MASTER_TOLERANCE] = self._optional(action.target_tolerance_master)
        if action.final_speed is not None:
            speed = action.final_speed.speed
            row[codes.FINAL] = codes.FINAL_SPEED
            if isinstance(speed, osc.RelativeSpeedToMaster):
                kind = self._tables.choice(osc.SpeedTargetValueType, speed.speed_target_value_type)
                is_factor = kind is osc.SpeedTargetValueType.FACTOR
                row[codes.FINAL] = codes.FINAL_FACTOR if is_factor else codes.FINAL_DELTA
            else:
                self._forward(speed, "value", speed.value)
            row[codes.FINAL_VALUE] = self._tables.slot(speed.value)
            steady = speed.steady_state
            if isinstance(steady, osc.TargetDistanceSteadyState):
                row[codes.STEADY] = codes.STEADY_DISTANCE
                row[codes.STEADY_VALUE] = self._tables.slot(steady.distance)
            elif isinstance(steady, osc.TargetTimeSteadyState):
                row[codes.STEADY] = codes.STEADY_TIME
                row[codes.STEADY_VALUE] = self._tables.slot(steady.time)
        return entity, codes.SYNCHRONIZE, 0, 0, 0, 0, self._keep(row)

    def _row(self, entity: int, ref: str | osc.ParameterRef | None) -> list[int]:
        row = [0] * codes.COURSE_WIDTH
        row[codes.REF] = -1
        if ref is not None:
            row[codes.REF] = self._tables.entity(ref)
            self.pairs.append((entity, row[codes.REF]))
        return row

    def _keep(self, row: list[int]) -> int:
        self.rows.append(tuple(row))
        return len(self.rows) - 1

    def _limit(self, row: list[int], limits: osc.DynamicConstraints | None) -> None:
        most = limits or osc.DynamicConstraints()
        values = (
            most.max_acceleration,
            most.max_deceleration,
            most.max_speed,
            most.max_acceleration_rate,
            most.max_deceleration_rate,
        )
        row[codes.MOST : codes.MOST + 5] = [self._optional(value) for value in values]

    def _optional(self, value: Value | None) -> int:
        return -1 if value is None else self._tables.slot(value)

    def _flag(self, element: Element, name: str, value: Value) -> bool:
        if not isinstance(value, bool):
            self._tables.unsupported(element, f'{name}="{value}"')
        return value is True

    def _forward(self, element: Element, name: str, value: Value) -> None:
        if isinstance(value, float) and value < 0.0:
            self._tables.unsupported(element, f'{name}="{value:g}" (driving backwards)')
