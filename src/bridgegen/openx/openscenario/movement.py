"""Actions along and across the road: speeds, distances, lanes, offsets; and their curves."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated

from bridgegen.openx.openscenario.element import ENTITY, AtLeast, Element, FiniteDouble, Range, Tag
from bridgegen.openx.openscenario.enumerations import (
    CoordinateSystem,
    DynamicsDimension,
    DynamicsShape,
    FollowingMode,
    LateralDisplacement,
    LongitudinalDisplacement,
    SpeedTargetValueType,
)
from bridgegen.openx.openscenario.values import Boolean, Double, Int, ParameterRef, String

# --- Actions along and across the road: speeds, distances to others, lanes, offsets ---


# --- Actions along the road: speeds, and distances to another entity ---


_NOT_NEGATIVE = Range(0.0)


@dataclass(frozen=True)
class TransitionDynamics(Element):
    """How a value changes: at once (``step``), or by a shape over a time, distance or rate."""

    dynamics_shape: DynamicsShape | ParameterRef
    dynamics_dimension: DynamicsDimension | ParameterRef
    value: Annotated[Double, _NOT_NEGATIVE]
    following_mode: FollowingMode | ParameterRef | None = None


@dataclass(frozen=True)
class DynamicConstraints(Element):
    """What may not be exceeded on the way [m/s, m/s², m/s³]; what is missing is unlimited."""

    max_acceleration: Annotated[Double | None, _NOT_NEGATIVE] = None
    max_deceleration: Annotated[Double | None, _NOT_NEGATIVE] = None
    max_speed: Annotated[Double | None, _NOT_NEGATIVE] = None
    max_acceleration_rate: Annotated[Double | None, _NOT_NEGATIVE] = None
    max_deceleration_rate: Annotated[Double | None, _NOT_NEGATIVE] = None


@dataclass(frozen=True)
class AbsoluteTargetSpeed(Element):
    """A speed to reach [m/s]."""

    value: FiniteDouble


@dataclass(frozen=True)
class RelativeTargetSpeed(Element):
    """A speed to reach, by another entity's: so much more [m/s], or so many times."""

    entity_ref: Annotated[String, ENTITY]
    value: FiniteDouble
    speed_target_value_type: SpeedTargetValueType | ParameterRef
    continuous: Boolean


@dataclass(frozen=True)
class SpeedActionTarget(Element):
    """The speed to reach."""

    target: AbsoluteTargetSpeed | RelativeTargetSpeed


@dataclass(frozen=True)
class SpeedAction(Element):
    """A change of speed."""

    dynamics: Annotated[TransitionDynamics, Tag("SpeedActionDynamics")]
    speed_action_target: SpeedActionTarget


@dataclass(frozen=True)
class SpeedProfileEntry(Element):
    """A speed to reach [m/s], and how long after the entry before [s]."""

    speed: FiniteDouble
    time: Annotated[Double | None, _NOT_NEGATIVE] = None


@dataclass(frozen=True)
class SpeedProfileAction(Element):
    """Speeds one after the other; with ``entity_ref``, relative to that entity's."""

    following_mode: FollowingMode | ParameterRef
    dynamic_constraints: DynamicConstraints | None = field(default=None, kw_only=True)
    entries: Annotated[tuple[SpeedProfileEntry, ...], AtLeast(1)]
    entity_ref: Annotated[String | None, ENTITY] = None


@dataclass(frozen=True)
class LongitudinalDistanceAction(Element):
    """Keeping a distance [m] or a time gap [s] to another entity.

    In 1.0 the entity stays behind the other one; from 1.1 on ``displacement`` says on which side.
    Other tools write a number below 0, which the standard does not have; only its size counts.
    """

    entity_ref: Annotated[String, ENTITY]
    continuous: Boolean
    freespace: Boolean
    distance: FiniteDouble | None = None
    time_gap: FiniteDouble | None = None
    displacement: LongitudinalDisplacement | ParameterRef | None = None
    coordinate_system: CoordinateSystem | ParameterRef | None = None
    dynamic_constraints: DynamicConstraints | None = None


@dataclass(frozen=True)
class LongitudinalAction(Element):
    """One of the actions along the road."""

    action: SpeedAction | LongitudinalDistanceAction | SpeedProfileAction


# --- Actions across the road: lanes, offsets, and distances to another entity ---


@dataclass(frozen=True)
class AbsoluteTargetLane(Element):
    """A lane of the present road by its id."""

    value: String


@dataclass(frozen=True)
class RelativeTargetLane(Element):
    """A lane by how many lanes it lies to the left of an entity's, in that one's direction."""

    entity_ref: Annotated[String, ENTITY]
    value: Int


@dataclass(frozen=True)
class LaneChangeTarget(Element):
    """The lane to change to."""

    target: AbsoluteTargetLane | RelativeTargetLane


@dataclass(frozen=True)
class LaneChangeAction(Element):
    """A change of lane."""

    dynamics: Annotated[TransitionDynamics, Tag("LaneChangeActionDynamics")]
    lane_change_target: LaneChangeTarget
    target_lane_offset: FiniteDouble | None = None


@dataclass(frozen=True)
class LaneOffsetActionDynamics(Element):
    """How an offset is reached: its course, and the most lateral acceleration [m/s²]."""

    dynamics_shape: DynamicsShape | ParameterRef
    max_lateral_acc: Annotated[Double | None, Range(0.0)] = None


@dataclass(frozen=True)
class AbsoluteTargetLaneOffset(Element):
    """A distance from the centre of the present lane [m]."""

    value: FiniteDouble


@dataclass(frozen=True)
class RelativeTargetLaneOffset(Element):
    """A distance from another entity's [m]."""

    entity_ref: Annotated[String, ENTITY]
    value: FiniteDouble


@dataclass(frozen=True)
class LaneOffsetTarget(Element):
    """The offset to reach."""

    target: AbsoluteTargetLaneOffset | RelativeTargetLaneOffset


@dataclass(frozen=True)
class LaneOffsetAction(Element):
    """A move aside within the lane; ``continuous``: kept until something else moves the entity."""

    continuous: Boolean
    dynamics: Annotated[LaneOffsetActionDynamics, Tag("LaneOffsetActionDynamics")]
    lane_offset_target: LaneOffsetTarget


@dataclass(frozen=True)
class LateralDistanceAction(Element):
    """Keeping a distance to another entity across the road [m]."""

    entity_ref: Annotated[String, ENTITY]
    continuous: Boolean
    freespace: Boolean
    distance: Annotated[Double | None, Range(0.0)] = None
    displacement: LateralDisplacement | ParameterRef | None = None
    coordinate_system: CoordinateSystem | ParameterRef | None = None
    dynamic_constraints: DynamicConstraints | None = None


@dataclass(frozen=True)
class LateralAction(Element):
    """One of the actions across the road."""

    action: LaneChangeAction | LaneOffsetAction | LateralDistanceAction


# --- Uniform B-splines: the knots by which a curve begins at its first point and ends at its last -
# Source: Piegl, Tiller, The NURBS Book (2nd edition, Springer 1997), section 2.4.


def uniform_knots(order: int, points: int) -> tuple[float, ...]:
    """Return the knots of a clamped uniform B-spline.

    Args:
        order: degree plus 1; at least 2.
        points: how many control points it has; at least ``order``.

    Returns:
        ``order + points`` whole numbers, from 0 on, not decreasing.
    """
    last = points - order + 1
    return tuple(float(min(max(i - order + 1, 0), last)) for i in range(order + points))


def is_uniform(knots: Sequence[float], order: int) -> bool:
    """Return whether knots are those of a clamped uniform B-spline, but for origin and scale."""
    usual = uniform_knots(order, len(knots) - order)
    span = knots[-1] - knots[0]
    return span > 0.0 and all(
        abs((knot - knots[0]) / span - value / usual[-1]) < 1e-9
        for knot, value in zip(knots, usual, strict=True)
    )
