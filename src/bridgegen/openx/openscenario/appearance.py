"""What entities look like: lights and animations."""

from dataclasses import dataclass
from typing import Annotated

from bridgegen.openx.openscenario.declarations import File
from bridgegen.openx.openscenario.element import Element, Range
from bridgegen.openx.openscenario.enumerations import (
    ColorType,
    LightMode,
    PedestrianGestureType,
    PedestrianMotionType,
    VehicleComponentType,
    VehicleLightType,
)
from bridgegen.openx.openscenario.values import Boolean, Double, ParameterRef, String

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
