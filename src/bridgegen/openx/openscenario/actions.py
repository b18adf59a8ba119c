"""What happens: the actions of the storyboard, of one entity, of all, and of the user's own."""

from dataclasses import dataclass, field
from typing import Annotated

from bridgegen.openx.openscenario.declarations import CATALOG, File
from bridgegen.openx.openscenario.element import ENTITY, TEXT, AtLeast, Element, Range, Tag
from bridgegen.openx.openscenario.entities import ActivateControllerAction, ControllerAction
from bridgegen.openx.openscenario.enumerations import (
    ColorType,
    LightMode,
    PedestrianGestureType,
    PedestrianMotionType,
    SpeedTargetValueType,
    VehicleComponentType,
    VehicleLightType,
)
from bridgegen.openx.openscenario.global_actions import GlobalAction
from bridgegen.openx.openscenario.movement import LateralAction, LongitudinalAction
from bridgegen.openx.openscenario.positions import FollowTrajectoryAction, Position, Route
from bridgegen.openx.openscenario.values import Boolean, Double, ParameterRef, String

# --- What entities look like: lights and animations ---


_NOT_NEGATIVE = Range(0.0)
_SHARE = Range(0.0, 1.0)


@dataclass(frozen=True)
class VehicleLight(Element):
    """A light of a vehicle."""

    vehicle_light_type: VehicleLightType | ParameterRef


@dataclass(frozen=True)
class UserDefinedLight(Element):
    """A light that the standard leaves to the user."""

    user_defined_light_type: String


@dataclass(frozen=True)
class LightType(Element):
    """Which light."""

    light: VehicleLight | UserDefinedLight


@dataclass(frozen=True)
class ColorRgb(Element):
    """A colour by red, green and blue, 0 to 1."""

    red: Annotated[Double, _SHARE]
    green: Annotated[Double, _SHARE]
    blue: Annotated[Double, _SHARE]


@dataclass(frozen=True)
class ColorCmyk(Element):
    """A colour by cyan, magenta, yellow and key, 0 to 1."""

    cyan: Annotated[Double, _SHARE]
    magenta: Annotated[Double, _SHARE]
    yellow: Annotated[Double, _SHARE]
    key: Annotated[Double, _SHARE]


@dataclass(frozen=True)
class Color(Element):
    """A colour by its name, and exactly."""

    color_type: ColorType | ParameterRef
    color: ColorRgb | ColorCmyk


@dataclass(frozen=True)
class LightState(Element):
    """On, off or flashing [s], and how bright [cd]."""

    mode: LightMode | ParameterRef
    luminous_intensity: Annotated[Double | None, _NOT_NEGATIVE] = None
    flashing_on_duration: Annotated[Double | None, _NOT_NEGATIVE] = None
    flashing_off_duration: Annotated[Double | None, _NOT_NEGATIVE] = None
    color: Color | None = None


@dataclass(frozen=True)
class LightStateAction(Element):
    """A light of an entity takes up a state, within a time [s]."""

    light_type: LightType
    light_state: LightState
    transition_time: Annotated[Double | None, _NOT_NEGATIVE] = None


@dataclass(frozen=True)
class VehicleComponent(Element):
    """A part of a vehicle that moves."""

    vehicle_component_type: VehicleComponentType | ParameterRef


@dataclass(frozen=True)
class UserDefinedComponent(Element):
    """A moving part that the standard leaves to the user."""

    user_defined_component_type: String


@dataclass(frozen=True)
class ComponentAnimation(Element):
    """The motion of a part."""

    component: VehicleComponent | UserDefinedComponent


@dataclass(frozen=True)
class PedestrianGesture(Element):
    """What the arms do."""

    gesture: PedestrianGestureType | ParameterRef


@dataclass(frozen=True)
class PedestrianAnimation(Element):
    """How a pedestrian moves."""

    motion: PedestrianMotionType | ParameterRef | None = None
    user_defined_pedestrian_animation: String | None = None
    gestures: tuple[PedestrianGesture, ...] = ()


@dataclass(frozen=True)
class AnimationFile(Element):
    """A motion in a file, from a time on [s]."""

    file: File
    time_offset: Double | None = None


@dataclass(frozen=True)
class UserDefinedAnimation(Element):
    """A motion that the standard leaves to the user."""

    user_defined_animation_type: String


@dataclass(frozen=True)
class AnimationType(Element):
    """Which motion."""

    animation: ComponentAnimation | PedestrianAnimation | AnimationFile | UserDefinedAnimation


@dataclass(frozen=True)
class AnimationState(Element):
    """How far a motion gets, 0 to 1."""

    state: Annotated[Double, _SHARE]


@dataclass(frozen=True)
class AnimationAction(Element):
    """A motion of an entity, over a time [s], once or again and again."""

    animation_type: AnimationType
    animation_state: AnimationState | None = None
    loop: Boolean | None = None
    animation_duration: Annotated[Double | None, _NOT_NEGATIVE] = None


@dataclass(frozen=True)
class AppearanceAction(Element):
    """One of the actions on what an entity looks like."""

    action: LightStateAction | AnimationAction


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
