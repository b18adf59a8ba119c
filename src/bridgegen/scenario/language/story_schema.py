"""The schema of a scenario file's story: participants, places, actions and conditions."""

from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

from pydantic import AfterValidator, Field, ValidationInfo, field_validator

from bridgegen.scenario.language.shape import (
    Acceleration,
    Angle,
    Duration,
    LaneField,
    Length,
    Metres,
    MetresPerSecond,
    Number,
    QuantityField,
    ShapedSection,
    Speed,
    Word,
    convert,
)
from bridgegen.scenario.language.story import CONDITIONS
from bridgegen.scenario.named_models import MODELS
from bridgegen.scenario.participants import QUEUES, TYPE_NAMES, canonical

if TYPE_CHECKING:
    TypeName: TypeAlias = str
    QueueName: TypeAlias = str
    ModelName: TypeAlias = str
else:
    TypeName, QueueName = Literal[TYPE_NAMES], Literal[QUEUES]
    ModelName = Literal[tuple(MODELS)]


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


class BodySection(ShapedSection):
    """A body of one's own; what is not said is the type's."""

    length: Annotated[Metres | None, Field(gt=0.0, le=60.0)] = None
    """[m]"""
    width: Annotated[Metres | None, Field(gt=0.0, le=60.0)] = None
    """[m]"""
    height: Annotated[Metres | None, Field(gt=0.0, le=60.0)] = None
    """[m]"""
    mass: Annotated[Number | None, Field(gt=0.0, le=1e6)] = None
    """[kg]"""
    max_speed: Annotated[MetresPerSecond | None, Field(gt=0.0, le=150.0)] = None
    """[m/s]"""
    max_acceleration: Annotated[Number | None, Field(gt=0.0, le=30.0)] = None
    """[m/s²]"""
    max_deceleration: Annotated[Number | None, Field(gt=0.0, le=30.0)] = None
    """[m/s²]"""


class PlaceSection(ShapedSection):
    """Where a participant starts and goes, where a category chooses one of several."""

    start: WaypointSection
    """Where it stands at time 0."""
    end: WaypointSection | None = None
    """Where its route ends; the ego's must."""


class ParticipantSection(ShapedSection):
    """One road user; the one that is called ``ego`` is under test."""

    type: Annotated[TypeName, AfterValidator(canonical)]
    """What it is."""
    type_by: Word | None = None
    """A category that gives type or model instead, in each evaluation; its default is said, too."""
    model: ModelName | None = None
    """Which one of its type: a test target or a design vehicle, whose body it has."""
    body: BodySection | None = None
    """Its dimensions and what it can do, where they are not the type's."""
    start: WaypointSection | None = None
    """Where it stands at time 0."""
    end: WaypointSection | None = None
    """Where its route ends; the ego's must."""
    place_by: Word | None = None
    """A category that chooses one of ``places`` in each evaluation."""
    places: dict[Word, PlaceSection] = {}
    """Instead of start and end: several, by the category's values."""
    path: list[WaypointSection] = []
    """Instead of start and end: straight lines through places; of a vehicle a smooth curve from the
    first to the last, which the others bend."""
    speed: Speed = 0.0
    """At time 0 [m/s]; of the ego also its target; a vehicle reverses below 0."""
    heading: Angle = 0.0
    """Turned from its lane's direction [deg], left positive; at 180 it faces the traffic."""
    exceeds_limit: Annotated[str, Field(strict=True, min_length=1, max_length=200)] | None = None
    """Why it may be faster than road and weather allow: an emergency vehicle on a call, say."""
    siren: Annotated[bool, Field(strict=True)] = False
    """Of an emergency vehicle: blue light and siren are on, and all give way to it."""
    driver: Word | None = None
    """attentive, insistent or scripted, instead of ``others``; not of the ego."""


class ConditionSection(ShapedSection):
    """One alternative of an event's ``when``; or several conditions that must hold together."""

    kind: (
        Literal[
            "time",
            "distance",
            "gap",
            "ttc",
            "headway",
            "speed",
            "travelled",
            "standstill",
            "contact",
            "after",
            "began",
        ]
        | None
    ) = None
    """What is compared with the value."""
    value: QuantityField = 0.0
    """In the kind's unit; of ``after`` and ``began`` a constant; none of ``contact``."""
    to: Word | None = None
    """The other participant, of distance, gap, ttc, headway and contact."""
    of: Word | None = None
    """Whose state is looked at; the event's own participant by default."""
    event: Word | None = None
    """The event that must have ended, of ``after``, or begun, of ``began``."""
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


class LaneOffsetSection(ShapedSection):
    """A way aside: within its lane, or over its edge."""

    offset: Length
    """Where to, left of its lane's centre positive [m]."""
    acceleration: Acceleration = 1.0
    """Across the lane at most [m/s²]."""
    shape: Literal["linear", "cubic", "sinusoidal"] = "sinusoidal"
    """Of the way aside over time."""


class KeepDistanceSection(ShapedSection):
    """A distance that it keeps behind another one, bumper to bumper, from then on."""

    to: Word
    """The other participant."""
    distance: Length | None = None
    """So far [m]."""
    time: Duration | None = None
    """Or so long, at its own speed [s]."""
    acceleration: Acceleration = 2.0
    """At most, to get there [m/s²]; ISO 15622 allows an adaptive cruise control as much."""
    braking: Acceleration = 3.5
    """At most [m/s²]; ISO 15622 again."""
    max_speed: Speed | None = None
    """At most [m/s], while it catches up."""


class ArrivalSection(ShapedSection):
    """It chooses its speed so that it arrives as another one does."""

    at: WaypointSection
    """Where it arrives."""
    other: Word
    """The other participant."""
    place: WaypointSection
    """Where that one arrives."""


ACTIONS = (
    "speed", "lane_change", "lane_offset", "keep_distance", "arrive", "indicate", "weather",
)  # fmt: skip
"""The keys of an event that are actions; it has one of them at least."""


class EventSection(ShapedSection):
    """Something that happens."""

    participant: Word | None = None
    """The participant that acts; none where the weather changes."""
    speed: Speed | None = None
    """It takes up this speed [m/s]; a vehicle reverses below 0."""
    rate: Acceleration | None = None
    """At this rate [m/s²]."""
    jerk: Number | None = None
    """The acceleration, at most the rate, builds up and is released so fast [m/s³]."""
    time: Duration | None = None
    """Within so long [s]."""
    distance: Length | None = None
    """Within so far [m]."""
    shape: Literal["linear", "cubic", "sinusoidal"] = "linear"
    """Of the speed over time, or distance."""
    lane_change: LaneChangeSection | None = None
    """It changes lane."""
    lane_offset: LaneOffsetSection | None = None
    """It moves aside."""
    keep_distance: KeepDistanceSection | None = None
    """It follows another one."""
    arrive: ArrivalSection | None = None
    """It arrives somewhere as another one does elsewhere."""
    indicate: Literal["left", "right", "hazard", "off"] | None = None
    """It indicates, or switches its hazard lights on, or all of these off."""
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
