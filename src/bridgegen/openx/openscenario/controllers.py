"""Controllers: assigned, switched on and off, and overridden at their pedals."""

from dataclasses import dataclass
from typing import Annotated

from bridgegen.openx.openscenario.catalog_files import CATALOG
from bridgegen.openx.openscenario.element import Element, Range, Tag
from bridgegen.openx.openscenario.entities import Controller, ObjectController
from bridgegen.openx.openscenario.enumerations import AutomaticGearType
from bridgegen.openx.openscenario.values import Boolean, Double, Int, ParameterRef, String

_SHARE = Range(0.0, 1.0)
_NOT_NEGATIVE = Range(0.0)


@dataclass(frozen=True)
class AssignControllerAction(Element):
    """Getting a controller, and which of what it does is switched on."""

    controller: Annotated[Controller | ObjectController, CATALOG]
    activate_lateral: Boolean | None = None
    activate_longitudinal: Boolean | None = None
    activate_animation: Boolean | None = None
    activate_lighting: Boolean | None = None


@dataclass(frozen=True)
class ActivateControllerAction(Element):
    """Switching on or off what a controller does; what is missing stays as it is.

    ``controller_ref`` is 1.2's name of ``object_controller_ref``.
    """

    lateral: Boolean | None = None
    longitudinal: Boolean | None = None
    animation: Boolean | None = None
    lighting: Boolean | None = None
    object_controller_ref: String | None = None
    controller_ref: String | None = None


@dataclass(frozen=True)
class OverrideThrottleAction(Element):
    """The throttle's position, 0 to 1."""

    active: Boolean
    value: Annotated[Double, _SHARE]
    max_rate: Annotated[Double | None, _NOT_NEGATIVE] = None


@dataclass(frozen=True)
class BrakePercent(Element):
    """A brake's position, 0 to 1, and how fast it gets there [1/s]."""

    value: Annotated[Double, _SHARE]
    max_rate: Annotated[Double | None, _NOT_NEGATIVE] = None


@dataclass(frozen=True)
class BrakeForce(Element):
    """A brake's force [N], and how fast it gets there [N/s]."""

    value: Annotated[Double, _NOT_NEGATIVE]
    max_rate: Annotated[Double | None, _NOT_NEGATIVE] = None


@dataclass(frozen=True)
class OverrideBrakeAction(Element):
    """The service brake, or the parking brake; ``value`` (0 to 1) is up to 1.1."""

    active: Boolean
    brake: BrakePercent | BrakeForce | None = None
    value: Annotated[Double | None, _SHARE] = None


@dataclass(frozen=True)
class OverrideClutchAction(Element):
    """The clutch's position, 0 to 1."""

    active: Boolean
    value: Annotated[Double, _SHARE]
    max_rate: Annotated[Double | None, _NOT_NEGATIVE] = None


@dataclass(frozen=True)
class OverrideSteeringWheelAction(Element):
    """The steering wheel's angle [rad]."""

    active: Boolean
    value: Double
    max_rate: Annotated[Double | None, _NOT_NEGATIVE] = None
    max_torque: Annotated[Double | None, _NOT_NEGATIVE] = None


@dataclass(frozen=True)
class ManualGear(Element):
    """A gear by its number; negative ones lead back."""

    number: Int


@dataclass(frozen=True)
class AutomaticGear(Element):
    """A position of an automatic gearbox."""

    gear: AutomaticGearType | ParameterRef


@dataclass(frozen=True)
class OverrideGearAction(Element):
    """The gear; ``number`` is up to 1.1."""

    active: Boolean
    gear: ManualGear | AutomaticGear | None = None
    number: Double | None = None


@dataclass(frozen=True)
class OverrideControllerValueAction(Element):
    """Holding controls, whatever the controller does; what is missing stays as it is."""

    throttle: Annotated[OverrideThrottleAction | None, Tag("Throttle")] = None
    brake: Annotated[OverrideBrakeAction | None, Tag("Brake")] = None
    clutch: Annotated[OverrideClutchAction | None, Tag("Clutch")] = None
    parking_brake: Annotated[OverrideBrakeAction | None, Tag("ParkingBrake")] = None
    steering_wheel: Annotated[OverrideSteeringWheelAction | None, Tag("SteeringWheel")] = None
    gear: Annotated[OverrideGearAction | None, Tag("Gear")] = None


@dataclass(frozen=True)
class ControllerAction(Element):
    """What is done to a controller: 1.0 has the first two, 1.3 one of the three."""

    assign_controller_action: AssignControllerAction | None = None
    override_controller_value_action: OverrideControllerValueAction | None = None
    activate_controller_action: ActivateControllerAction | None = None
