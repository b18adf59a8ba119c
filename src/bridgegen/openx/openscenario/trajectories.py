"""Trajectories: lines to follow, with or without times."""

from dataclasses import dataclass
from typing import Annotated

from bridgegen.openx.openscenario.element import AtLeast, Element, Range, Tag
from bridgegen.openx.openscenario.enumerations import FollowingMode, ReferenceContext
from bridgegen.openx.openscenario.positions import Position
from bridgegen.openx.openscenario.values import Boolean, Double, ParameterRef, String


@dataclass(frozen=True)
class Vertex(Element):
    """A point of a polyline, and when to be there [s]."""

    position: Position
    time: Double | None = None


@dataclass(frozen=True)
class Polyline(Element):
    """Straight lines from vertex to vertex."""

    vertices: Annotated[tuple[Vertex, ...], AtLeast(2)]


@dataclass(frozen=True)
class Shape(Element):
    """The line of a trajectory."""

    shape: Polyline


@dataclass(frozen=True)
class Trajectory(Element):
    """A line by its name."""

    name: String
    closed: Boolean
    shape: Shape


@dataclass(frozen=True)
class TrajectoryRef(Element):
    """The trajectory that is meant."""

    trajectory: Trajectory


@dataclass(frozen=True)
class NoTime(Element):
    """Times of the vertices do not count: the entity keeps its own speed."""


@dataclass(frozen=True)
class Timing(Element):
    """Times of the vertices count, moved [s] and scaled."""

    domain_absolute_relative: ReferenceContext | ParameterRef
    scale: Double
    offset: Double


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
    """Moving along a trajectory."""

    time_reference: TimeReference
    trajectory_following_mode: TrajectoryFollowingMode
    trajectory_ref: TrajectoryRef
    initial_distance_offset: Annotated[Double | None, Range(0.0)] = None
