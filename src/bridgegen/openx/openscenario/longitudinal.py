"""Actions along the road: speeds, and distances to another entity."""

from dataclasses import dataclass, field
from typing import Annotated

from bridgegen.openx.openscenario.element import ENTITY, AtLeast, Element, FiniteDouble, Range, Tag
from bridgegen.openx.openscenario.enumerations import (
    CoordinateSystem,
    DynamicsDimension,
    DynamicsShape,
    FollowingMode,
    LongitudinalDisplacement,
    SpeedTargetValueType,
)
from bridgegen.openx.openscenario.values import Boolean, Double, ParameterRef, String

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
    """

    entity_ref: Annotated[String, ENTITY]
    continuous: Boolean
    freespace: Boolean
    distance: Annotated[Double | None, _NOT_NEGATIVE] = None
    time_gap: Annotated[Double | None, _NOT_NEGATIVE] = None
    displacement: LongitudinalDisplacement | ParameterRef | None = None
    coordinate_system: CoordinateSystem | ParameterRef | None = None
    dynamic_constraints: DynamicConstraints | None = None


@dataclass(frozen=True)
class LongitudinalAction(Element):
    """One of the actions along the road."""

    action: SpeedAction | LongitudinalDistanceAction | SpeedProfileAction
