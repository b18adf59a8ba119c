"""Actions across the road: lanes, offsets, and distances to another entity."""

from dataclasses import dataclass
from typing import Annotated

from bridgegen.openx.openscenario.element import ENTITY, Element, FiniteDouble, Range, Tag
from bridgegen.openx.openscenario.enumerations import (
    CoordinateSystem,
    DynamicsShape,
    LateralDisplacement,
)
from bridgegen.openx.openscenario.longitudinal import DynamicConstraints, TransitionDynamics
from bridgegen.openx.openscenario.values import Boolean, Double, Int, ParameterRef, String


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
