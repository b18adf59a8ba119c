"""What happens: the actions of the storyboard."""

from dataclasses import dataclass
from typing import Annotated

from bridgegen.openx.openscenario.element import ENTITY, Element, Range, Tag
from bridgegen.openx.openscenario.enumerations import (
    DynamicsDimension,
    DynamicsShape,
    FollowingMode,
    SpeedTargetValueType,
)
from bridgegen.openx.openscenario.environment import Environment
from bridgegen.openx.openscenario.positions import Position, Route
from bridgegen.openx.openscenario.trajectories import FollowTrajectoryAction
from bridgegen.openx.openscenario.values import Boolean, Double, Int, ParameterRef, String


@dataclass(frozen=True)
class TransitionDynamics(Element):
    """How a value changes: at once (``step``), or by a shape over a time, distance or rate."""

    dynamics_shape: DynamicsShape | ParameterRef
    dynamics_dimension: DynamicsDimension | ParameterRef
    value: Annotated[Double, Range(0.0)]
    following_mode: FollowingMode | ParameterRef | None = None


@dataclass(frozen=True)
class AbsoluteTargetSpeed(Element):
    """A speed to reach [m/s]."""

    value: Double


@dataclass(frozen=True)
class RelativeTargetSpeed(Element):
    """A speed to reach, by another entity's: so much more [m/s], or so many times."""

    entity_ref: Annotated[String, ENTITY]
    value: Double
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
class LongitudinalAction(Element):
    """One of the actions along the road."""

    action: SpeedAction


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
    target_lane_offset: Double | None = None


@dataclass(frozen=True)
class LaneOffsetActionDynamics(Element):
    """How an offset is reached: its course, and the most lateral acceleration [m/s²]."""

    dynamics_shape: DynamicsShape | ParameterRef
    max_lateral_acc: Annotated[Double | None, Range(0.0)] = None


@dataclass(frozen=True)
class AbsoluteTargetLaneOffset(Element):
    """A distance from the centre of the present lane [m]."""

    value: Double


@dataclass(frozen=True)
class RelativeTargetLaneOffset(Element):
    """A distance from another entity's [m]."""

    entity_ref: Annotated[String, ENTITY]
    value: Double


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
class LateralAction(Element):
    """One of the actions across the road."""

    action: LaneChangeAction | LaneOffsetAction


@dataclass(frozen=True)
class TeleportAction(Element):
    """Being put somewhere."""

    position: Position


@dataclass(frozen=True)
class AssignRouteAction(Element):
    """Being given a route."""

    route: Route


@dataclass(frozen=True)
class RoutingAction(Element):
    """One of the actions that say where to go."""

    action: AssignRouteAction | FollowTrajectoryAction


@dataclass(frozen=True)
class SynchronizeAction(Element):
    """Being at a position when another entity, the master, is at one of its own [m]."""

    master_entity_ref: Annotated[String, ENTITY]
    target_position_master: Annotated[Position, Tag("TargetPositionMaster")]
    target_position: Annotated[Position, Tag("TargetPosition")]
    target_tolerance: Annotated[Double | None, Range(0.0)] = None
    target_tolerance_master: Annotated[Double | None, Range(0.0)] = None


@dataclass(frozen=True)
class PrivateAction(Element):
    """One of the actions of an entity."""

    action: LongitudinalAction | LateralAction | SynchronizeAction | TeleportAction | RoutingAction


@dataclass(frozen=True)
class EnvironmentAction(Element):
    """A change of the environment."""

    environment: Environment


@dataclass(frozen=True)
class TrafficSignalStateAction(Element):
    """A traffic light takes up a state, one word for each lamp, top to bottom."""

    name: String
    state: String


@dataclass(frozen=True)
class TrafficSignalControllerAction(Element):
    """A controller of traffic lights takes up a phase."""

    traffic_signal_controller_ref: String
    phase: String


@dataclass(frozen=True)
class TrafficSignalAction(Element):
    """One of the actions of traffic lights."""

    action: TrafficSignalStateAction | TrafficSignalControllerAction


@dataclass(frozen=True)
class InfrastructureAction(Element):
    """One of the actions of what stands beside the road."""

    traffic_signal_action: TrafficSignalAction


@dataclass(frozen=True)
class AddEntityAction(Element):
    """An entity comes into the scenario, at a position."""

    position: Position


@dataclass(frozen=True)
class DeleteEntityAction(Element):
    """An entity leaves the scenario."""


@dataclass(frozen=True)
class EntityAction(Element):
    """One of the actions on the presence of an entity."""

    entity_ref: Annotated[String, ENTITY]
    action: AddEntityAction | DeleteEntityAction


@dataclass(frozen=True)
class GlobalAction(Element):
    """One of the actions that concern all."""

    action: EnvironmentAction | EntityAction | InfrastructureAction


@dataclass(frozen=True)
class Action(Element):
    """An action of an event, by its name."""

    name: String
    action: PrivateAction | GlobalAction
