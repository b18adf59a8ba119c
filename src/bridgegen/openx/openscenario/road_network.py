"""The road network: the map, what to draw it with, the part in use, and how its lights change."""

from dataclasses import dataclass, field
from typing import Annotated

from bridgegen.openx.openscenario.declarations import File
from bridgegen.openx.openscenario.element import Alias, AtLeast, Element, Tag
from bridgegen.openx.openscenario.positions import Position
from bridgegen.openx.openscenario.values import Double, String


@dataclass(frozen=True)
class TrafficSignalState(Element):
    """A traffic light's state during a phase, one word for each lamp, top to bottom."""

    traffic_signal_id: String
    state: String


@dataclass(frozen=True)
class TrafficSignalGroupState(Element):
    """The state of all lights of a controller together."""

    state: String


@dataclass(frozen=True)
class Phase(Element):
    """A phase of a controller [s]; 1.2's schema spells the group's state with an e too many."""

    name: String
    duration: Double
    traffic_signal_states: Annotated[tuple[TrafficSignalState, ...], Tag("TrafficSignalState")] = ()
    traffic_signal_group_state: Annotated[
        TrafficSignalGroupState | None, Alias("TrafficeSignalGroupState")
    ] = None


@dataclass(frozen=True)
class TrafficSignalController(Element):
    """Traffic lights that go through phases together, again and again."""

    name: String
    phases: tuple[Phase, ...] = ()
    delay: Double | None = None
    reference: String | None = None


@dataclass(frozen=True)
class TrafficSignals(Element):
    """The controllers of a road network's traffic lights."""

    controllers: Annotated[tuple[TrafficSignalController, ...], Tag("TrafficSignalController")] = ()


@dataclass(frozen=True)
class UsedArea(Element):
    """The part of the map that the scenario takes place in, by corners."""

    positions: Annotated[tuple[Position, ...], AtLeast(2)]


@dataclass(frozen=True)
class RoadNetwork(Element):
    """The OpenDRIVE file, what to draw it with, and how its lights change."""

    logic_file: Annotated[File | None, Tag("LogicFile")] = None
    scene_graph_file: Annotated[File | None, Tag("SceneGraphFile")] = field(
        default=None, kw_only=True
    )
    traffic_signals: TrafficSignals | None = field(default=None, kw_only=True)
    used_area: UsedArea | None = field(default=None, kw_only=True)
