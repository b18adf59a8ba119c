"""What happens: the actions of the storyboard."""

from dataclasses import dataclass
from typing import Annotated

from bridgegen.openx.openscenario.element import Element, Range, Tag
from bridgegen.openx.openscenario.enumerations import (
    DynamicsDimension,
    DynamicsShape,
    FollowingMode,
)
from bridgegen.openx.openscenario.environment import Environment
from bridgegen.openx.openscenario.positions import Position, Route
from bridgegen.openx.openscenario.values import Double, ParameterRef, String


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
class SpeedActionTarget(Element):
    """The speed to reach."""

    target: AbsoluteTargetSpeed


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

    action: AssignRouteAction


@dataclass(frozen=True)
class PrivateAction(Element):
    """One of the actions of an entity."""

    action: LongitudinalAction | TeleportAction | RoutingAction


@dataclass(frozen=True)
class EnvironmentAction(Element):
    """A change of the environment."""

    environment: Environment


@dataclass(frozen=True)
class GlobalAction(Element):
    """One of the actions that concern all."""

    action: EnvironmentAction


@dataclass(frozen=True)
class Action(Element):
    """An action of an event, by its name."""

    name: String
    action: PrivateAction | GlobalAction
