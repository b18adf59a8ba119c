"""The storyboard, the road network, and the whole file."""

from dataclasses import dataclass, field
from typing import Annotated

from bridgegen.openx.openscenario.actions import Action, PrivateAction, UserDefinedAction
from bridgegen.openx.openscenario.conditions import Trigger
from bridgegen.openx.openscenario.declarations import (
    CATALOG,
    CatalogLocations,
    File,
    FileHeader,
    MonitorDeclarations,
    ParameterDeclarations,
    VariableDeclarations,
)
from bridgegen.openx.openscenario.element import (
    ENTITY,
    Alias,
    AtLeast,
    Element,
    Range,
    Tag,
)
from bridgegen.openx.openscenario.entities import Actors, Entities
from bridgegen.openx.openscenario.enumerations import Priority
from bridgegen.openx.openscenario.global_actions import GlobalAction
from bridgegen.openx.openscenario.positions import Position
from bridgegen.openx.openscenario.values import Double, ParameterRef, String, UnsignedInt

# --- The road network: the map, the part in use, and how its lights change ---


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


@dataclass(frozen=True)
class Event(Element):
    """Actions that start together when the trigger fires."""

    name: String
    priority: Priority | ParameterRef
    actions: Annotated[tuple[Action, ...], AtLeast(1)]
    start_trigger: Annotated[Trigger | None, Tag("StartTrigger")] = None
    maximum_execution_count: Annotated[UnsignedInt | None, Range(1)] = None


@dataclass(frozen=True)
class Maneuver(Element):
    """Events that belong together."""

    parameter_declarations: ParameterDeclarations | None = field(default=None, kw_only=True)
    name: String
    events: Annotated[tuple[Event, ...], AtLeast(1)]


@dataclass(frozen=True)
class ManeuverGroup(Element):
    """Maneuvers and whose they are."""

    name: String
    maximum_execution_count: Annotated[UnsignedInt, Range(1)]
    actors: Actors
    maneuvers: Annotated[tuple[Maneuver, ...], CATALOG] = ()


@dataclass(frozen=True)
class Act(Element):
    """Maneuver groups that start together; without a start trigger, with the story."""

    name: String
    maneuver_groups: Annotated[tuple[ManeuverGroup, ...], AtLeast(1)]
    start_trigger: Annotated[Trigger | None, Tag("StartTrigger")] = None
    stop_trigger: Annotated[Trigger | None, Tag("StopTrigger")] = None


@dataclass(frozen=True)
class Story(Element):
    """Acts that belong together."""

    parameter_declarations: ParameterDeclarations | None = field(default=None, kw_only=True)
    name: String
    acts: Annotated[tuple[Act, ...], AtLeast(1)]


@dataclass(frozen=True)
class Private(Element):
    """What an entity does at the start."""

    entity_ref: Annotated[String, ENTITY]
    private_actions: Annotated[tuple[PrivateAction, ...], AtLeast(1)]


@dataclass(frozen=True)
class InitActions(Element):
    """What is done at the start."""

    global_actions: tuple[GlobalAction, ...] = ()
    user_defined_actions: tuple[UserDefinedAction, ...] = field(default=(), kw_only=True)
    privates: tuple[Private, ...] = ()


@dataclass(frozen=True)
class Init(Element):
    """The start."""

    actions: Annotated[InitActions, Tag("Actions")]


@dataclass(frozen=True)
class Storyboard(Element):
    """Start, stories and end."""

    init: Init
    stories: tuple[Story, ...] = ()
    stop_trigger: Annotated[Trigger | None, Tag("StopTrigger")] = None


@dataclass(frozen=True)
class OpenScenario(Element):
    """A scenario file.

    Attributes:
        left_hand: whether it is the mirror image of one with left-hand traffic, which is written:
            see `bridgegen.openx.openscenario.mirror`.
    """

    file_header: FileHeader
    parameter_declarations: ParameterDeclarations | None = field(default=None, kw_only=True)
    variable_declarations: VariableDeclarations | None = field(default=None, kw_only=True)
    monitor_declarations: MonitorDeclarations | None = field(default=None, kw_only=True)
    catalog_locations: CatalogLocations = field(default_factory=CatalogLocations, kw_only=True)
    road_network: RoadNetwork
    entities: Entities
    storyboard: Storyboard
    left_hand: bool = field(default=False, kw_only=True)
