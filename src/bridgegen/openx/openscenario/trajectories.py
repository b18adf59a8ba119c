"""Following a trajectory, with or without times."""

from dataclasses import dataclass
from typing import Annotated

from bridgegen.openx.openscenario.element import BARE, Element, FiniteDouble, Range, Tag
from bridgegen.openx.openscenario.enumerations import FollowingMode, ReferenceContext
from bridgegen.openx.openscenario.positions import TrajectoryRef
from bridgegen.openx.openscenario.values import Double, ParameterRef


@dataclass(frozen=True)
class NoTime(Element):
    """Times of the vertices do not count: the entity keeps its own speed."""


@dataclass(frozen=True)
class Timing(Element):
    """Times of the vertices count, moved [s] and scaled."""

    domain_absolute_relative: ReferenceContext | ParameterRef
    scale: FiniteDouble
    offset: FiniteDouble


@dataclass(frozen=True)
class TimeReference(Element):
    """Whether the times of the vertices count."""

    reference: Annotated[NoTime | Timing, Tag("None"), Tag("Timing")]


@dataclass(frozen=True)
class TrajectoryFollowingMode(Element):
    """Whether to be on the line exactly or to steer along it."""

    following_mode: FollowingMode | ParameterRef


@dataclass(frozen=True)
class FollowTrajectoryAction(Element):
    """Moving along a trajectory, from so far on it [m].

    1.0 has no ``TrajectoryRef``: the trajectory stands in the action itself.
    """

    time_reference: TimeReference
    trajectory_following_mode: TrajectoryFollowingMode
    trajectory_ref: Annotated[TrajectoryRef, BARE]
    initial_distance_offset: Annotated[Double | None, Range(0.0)] = None
