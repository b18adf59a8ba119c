"""What happens: the actions of the storyboard, of one entity, of all, and of the user's own."""

from dataclasses import dataclass, field
from typing import Annotated

from bridgegen.openx.openscenario.appearance import AppearanceAction
from bridgegen.openx.openscenario.catalog_files import CATALOG
from bridgegen.openx.openscenario.controllers import ActivateControllerAction, ControllerAction
from bridgegen.openx.openscenario.element import ENTITY, TEXT, AtLeast, Element, Range, Tag
from bridgegen.openx.openscenario.enumerations import SpeedTargetValueType
from bridgegen.openx.openscenario.global_actions import GlobalAction
from bridgegen.openx.openscenario.lateral import LateralAction
from bridgegen.openx.openscenario.longitudinal import LongitudinalAction
from bridgegen.openx.openscenario.positions import Position, Route
from bridgegen.openx.openscenario.trajectories import FollowTrajectoryAction
from bridgegen.openx.openscenario.values import Boolean, Double, ParameterRef, String


@dataclass(frozen=True)
class SensorReference(Element):
    """A sensor by its name."""

    name: String


@dataclass(frozen=True)
class SensorReferenceSet(Element):
    """The sensors that are meant."""

    sensor_references: Annotated[tuple[SensorReference, ...], AtLeast(1)]


@dataclass(frozen=True)
class VisibilityAction(Element):
    """Being seen or not: in pictures, by sensors, by other traffic."""

    graphics: Boolean
    sensors: Boolean
    traffic: Boolean
    sensor_reference_set: SensorReferenceSet | None = None


@dataclass(frozen=True)
class TeleportAction(Element):
    """Being put somewhere."""

    position: Position


@dataclass(frozen=True)
class AssignRouteAction(Element):
    """Being given a route."""

    route: Annotated[Route, CATALOG]


@dataclass(frozen=True)
class AcquirePositionAction(Element):
    """Being sent to a position, by the shortest route."""

    position: Position


@dataclass(frozen=True)
class RandomRouteAction(Element):
    """Being sent anywhere."""


@dataclass(frozen=True)
class RoutingAction(Element):
    """One of the routing actions."""

    action: AssignRouteAction | FollowTrajectoryAction | AcquirePositionAction | RandomRouteAction


@dataclass(frozen=True)
class TargetDistanceSteadyState(Element):
    """The speed is reached so far before the target [m]."""

    distance: Annotated[Double, Range(0.0)]


@dataclass(frozen=True)
class TargetTimeSteadyState(Element):
    """The speed is reached so long before the target [s]."""

    time: Annotated[Double, Range(0.0)]


@dataclass(frozen=True)
class AbsoluteSpeed(Element):
    """A speed at the target [m/s]."""

    value: Double
    steady_state: TargetDistanceSteadyState | TargetTimeSteadyState | None = None


@dataclass(frozen=True)
class RelativeSpeedToMaster(Element):
    """A speed at the target, by the master's: so much more [m/s], or so many times."""

    speed_target_value_type: SpeedTargetValueType | ParameterRef
    value: Double
    steady_state: TargetDistanceSteadyState | TargetTimeSteadyState | None = None


@dataclass(frozen=True)
class FinalSpeed(Element):
    """The speed at the target."""

    speed: AbsoluteSpeed | RelativeSpeedToMaster


@dataclass(frozen=True)
class SynchronizeAction(Element):
    """Being at a position when another entity, the master, is at one of its own [m]."""

    master_entity_ref: Annotated[String, ENTITY]
    target_position_master: Annotated[Position, Tag("TargetPositionMaster")]
    target_position: Annotated[Position, Tag("TargetPosition")]
    final_speed: FinalSpeed | None = field(default=None, kw_only=True)
    target_tolerance: Annotated[Double | None, Range(0.0)] = None
    target_tolerance_master: Annotated[Double | None, Range(0.0)] = None


@dataclass(frozen=True)
class ConnectTrailerAction(Element):
    """A trailer is coupled."""

    trailer_ref: Annotated[String, ENTITY]


@dataclass(frozen=True)
class DisconnectTrailerAction(Element):
    """The trailer is uncoupled."""


@dataclass(frozen=True)
class TrailerAction(Element):
    """One of the actions on a trailer."""

    action: ConnectTrailerAction | DisconnectTrailerAction


@dataclass(frozen=True)
class PrivateAction(Element):
    """One of the actions of an entity."""

    action: (
        LongitudinalAction
        | LateralAction
        | VisibilityAction
        | SynchronizeAction
        | ActivateControllerAction
        | ControllerAction
        | TeleportAction
        | RoutingAction
        | AppearanceAction
        | TrailerAction
    )


@dataclass(frozen=True)
class CustomCommandAction(Element):
    """A command that only its own simulator knows."""

    type: String
    text: Annotated[str, TEXT] = ""


@dataclass(frozen=True)
class UserDefinedAction(Element):
    """One of the actions that the standard leaves to the user."""

    custom_command_action: CustomCommandAction


@dataclass(frozen=True)
class Action(Element):
    """An action of an event, by its name."""

    name: String
    action: PrivateAction | GlobalAction | UserDefinedAction
