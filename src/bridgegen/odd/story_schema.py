"""The schema of a scenario file's story: participants, places, actions and conditions."""

from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

from pydantic import AfterValidator, Field, ValidationInfo, field_validator

from bridgegen.odd.shape import (
    Acceleration,
    Duration,
    LaneField,
    Length,
    Metres,
    Number,
    QuantityField,
    ShapedSection,
    Speed,
    Word,
    convert,
)
from bridgegen.odd.story import CONDITIONS
from bridgegen.participants import QUEUES, TYPE_NAMES, canonical

if TYPE_CHECKING:
    TypeName: TypeAlias = str
    QueueName: TypeAlias = str
else:
    TypeName, QueueName = Literal[TYPE_NAMES], Literal[QUEUES]


class WaypointSection(ShapedSection):
    """A place on a leg."""

    point: Annotated[str, Field(strict=True, pattern=r"^P([1-9]|10)$")] | None = None
    """Of the paper's crossroads: P1 inbound on leg A, P2 outbound, P3 inbound on B …"""
    leg: Word | None = None
    """A to E of a junction; main, ramp or after of a merge; a road needs none."""
    way: Literal["in", "out"] | None = None
    """Towards the junction, or away from it; of a road ``out`` is its direction."""
    distance: Length
    """[m] along the leg from the junction's edge; of a road from its start."""
    lane: LaneField = 1
    """1 is the innermost lane of its direction; or sidewalk, or shoulder."""
    offset: Length = 0.0
    """To the left of the lane's centre [m], kept while driving."""


class ParticipantSection(ShapedSection):
    """One road user; the one that is called ``ego`` is under test."""

    type: Annotated[TypeName, AfterValidator(canonical)]
    """What it is."""
    start: WaypointSection | None = None
    """Where it stands at time 0."""
    end: WaypointSection | None = None
    """Where its route ends; the ego's must."""
    path: list[WaypointSection] = []
    """Instead of start and end: straight lines through places; not of a vehicle or an obstacle."""
    speed: Speed = 0.0
    """At time 0 [m/s]; of the ego also its target."""
    driver: Word | None = None
    """attentive or scripted, instead of ``others``; not of the ego."""


class ConditionSection(ShapedSection):
    """One alternative of an event's ``when``; or several conditions that must hold together."""

    kind: (
        Literal["time", "distance", "ttc", "headway", "speed", "travelled", "standstill", "after"]
        | None
    ) = None
    """What is compared with the value."""
    value: QuantityField = 0.0
    """In the kind's unit; of ``after`` a constant."""
    to: Word | None = None
    """The other participant, of distance, ttc and headway."""
    of: Word | None = None
    """Whose state is looked at; the event's own participant by default."""
    event: Word | None = None
    """The event that must have ended, of ``after``."""
    all: "list[ConditionSection]" = []
    """Conditions that must hold together."""

    @field_validator("value", mode="before")
    @classmethod
    def _in_its_unit(cls, value: object, info: ValidationInfo) -> object:
        kind = info.data.get("kind")
        return convert(value, CONDITIONS[kind].unit if kind else None)


class LaneChangeSection(ShapedSection):
    """A lane change of an event."""

    lanes: Annotated[Number, Field(ge=-5, le=5, multiple_of=1)]
    """How many, to the left of its direction of travel positive."""
    time: Duration | None = None
    """It takes so long [s]."""
    distance: Length | None = None
    """It takes so far [m]."""
    shape: Literal["linear", "cubic", "sinusoidal"] = "sinusoidal"
    """Of the way aside over time, or distance."""


ACTIONS = ("speed", "lane_change", "weather")
"""The keys of an event that are actions; it has one of them at least."""


class EventSection(ShapedSection):
    """Something that happens."""

    participant: Word | None = None
    """The participant that acts; none where the weather changes."""
    speed: Speed | None = None
    """It takes up this speed [m/s]."""
    rate: Acceleration | None = None
    """At this rate [m/s²]."""
    time: Duration | None = None
    """Within so long [s]."""
    distance: Length | None = None
    """Within so far [m]."""
    shape: Literal["linear", "cubic", "sinusoidal"] = "linear"
    """Of the speed over time, or distance."""
    lane_change: LaneChangeSection | None = None
    """It changes lane."""
    weather: Word | None = None
    """The weather becomes that of the parameters with this prefix."""
    when: Annotated[list[ConditionSection], Field(min_length=1)]
    """Alternatives; the first to hold starts the event."""


class JamSection(ShapedSection):
    """A queue of standing vehicles."""

    tail: WaypointSection
    """Where the last of them stands."""
    vehicles: Annotated[list[QueueName], Field(min_length=1)]
    """Their types, the last first."""
    gap: Length = 3.0
    """Between two of them [m]."""


class WorksSection(ShapedSection):
    """A lane that is closed by cones."""

    start: WaypointSection
    """On the lane that is closed."""
    length: Metres
    """[m]"""
    taper: Metres
    """Over which the cones cross the lane [m]."""
    spacing: Metres = 5.0
    """Of the cones [m]."""
    sign_before: Metres = 40.0
    """How far before them the sign stands [m]."""
