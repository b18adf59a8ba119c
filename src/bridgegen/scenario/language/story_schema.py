"""The schema of a scenario file's story: participants, places, actions and conditions."""

from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

from pydantic import AfterValidator, Field, ValidationInfo, field_validator

from bridgegen.scenario.language.schema_types import (
    Acceleration,
    Angle,
    Curvature,
    Duration,
    LaneField,
    Length,
    Metres,
    MetresPerSecond,
    Number,
    QuantityField,
    Ratio,
    ShapedSection,
    Speed,
    Text,
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
    """Point of the paper's crossroads: P1 inbound on leg A, P2 outbound, P3 inbound on B …"""
    leg: Word | None = None
    """Leg: A to E of a junction; main, ramp or after of a merge; a road needs none."""
    way: Literal["in", "out"] | None = None
    """Direction of travel: towards the junction, or away from it; along a road it is ``out``."""
    distance: Length
    """Distance along the leg from the junction's edge, or along a road from its start [m]."""
    lane: LaneField = 1
    """Lane number from the inside of its direction, 1 is the innermost; or sidewalk, or
    shoulder."""
    offset: Length = 0.0
    """Lateral offset from the lane's centre [m], left positive; it is kept while driving."""


class BodySection(ShapedSection):
    """A body of one's own; what is not said is the type's."""

    length: Annotated[Metres | None, Field(gt=0.0, le=60.0)] = None
    """Length of the body [m]."""
    width: Annotated[Metres | None, Field(gt=0.0, le=60.0)] = None
    """Width of the body [m]."""
    height: Annotated[Metres | None, Field(gt=0.0, le=60.0)] = None
    """Height of the body [m]."""
    mass: Annotated[Number | None, Field(gt=0.0, le=1e6)] = None
    """Mass of the body [kg]."""
    max_speed: Annotated[MetresPerSecond | None, Field(gt=0.0, le=150.0)] = None
    """Largest speed [m/s]."""
    max_acceleration: Annotated[Number | None, Field(gt=0.0, le=30.0)] = None
    """Largest acceleration [m/s²]."""
    max_deceleration: Annotated[Number | None, Field(gt=0.0, le=30.0)] = None
    """Largest deceleration [m/s²]."""


class RouteChangeSection(ShapedSection):
    """A lane change of the ego's route: where it may be; its driver decides when it is."""

    lanes: Literal[1, -1]
    """Lane that it changes to: 1 the one to its left, -1 the one to its right."""
    at: Annotated[Metres, Field(ge=0.0)] = 0.0
    """Distance along the leg where its route ends from which on it may change [m], a constant; at a
    merge 0, where the acceleration lane begins."""
    within: Annotated[Metres, Field(ge=15.0)]
    """Length of road from there on which it must have changed [m], a constant."""


class PassSection(ShapedSection):
    """What stands in the ego's lane, which its route passes on the lane beside."""

    around: Word
    """Participant that stands, or road works, in the ego's lane."""
    lanes: Literal[1, -1] = 1
    """Lane on which it is passed: 1 the one to its left, that of oncoming traffic where there is no
    other; -1 the one to its right."""
    before: Annotated[Metres, Field(ge=25.0, le=300.0)] = 60.0
    """Length of road before it on which the ego may change lanes [m], a constant."""
    after: Annotated[Metres, Field(ge=15.0, le=300.0)] = 40.0
    """Length of road behind it on which the ego returns [m], a constant."""


class PlaceSection(ShapedSection):
    """Where a participant starts and goes, where a category chooses one of several."""

    start: WaypointSection
    """Position at time 0."""
    end: WaypointSection | None = None
    """End of the route; required for the ego."""


class ParticipantSection(ShapedSection):
    """One road user; the one that is called ``ego`` is under test."""

    type: Annotated[TypeName, AfterValidator(canonical)]
    """Type of the participant."""
    type_by: Word | None = None
    """Category that gives type or model instead, in each evaluation; its default is stated as
    well."""
    model: ModelName | None = None
    """Model of the type, with its body: a test target or a design vehicle."""
    body: BodySection | None = None
    """Dimensions and limits of motion where they differ from the type's."""
    start: WaypointSection | None = None
    """Position at time 0."""
    end: WaypointSection | None = None
    """End of the route; required for the ego."""
    lane_change: RouteChangeSection | None = None
    """Lane change of the ego's route; those of others are events."""
    passes: PassSection | None = None
    """What stands in the ego's lane and is passed, by the lane beside."""
    place_by: Word | None = None
    """Category that chooses one of ``places`` in each evaluation."""
    places: dict[Word, PlaceSection] = {}
    """Starts and ends to choose from, by the category's values, instead of start and end."""
    path: list[WaypointSection] = []
    """Waypoints of a path, instead of start and end: straight lines; of a vehicle a smooth curve
    from the first to the last, which the others bend."""
    speed: Speed = 0.0
    """Speed at time 0 [m/s], and target speed of the ego; a vehicle reverses below 0."""
    heading: Angle = 0.0
    """Heading relative to the lane's direction [deg], left positive; 180 faces the traffic."""
    exceeds_limit: Annotated[str, Field(strict=True, min_length=1, max_length=200)] | None = None
    """Reason why it may be faster than road and weather allow, such as an emergency call."""
    off_crosswalk: Annotated[str, Field(strict=True, min_length=1, max_length=200)] | None = None
    """Reason why a pedestrian is on the road away from crosswalks, where it has no priority."""
    siren: Annotated[bool, Field(strict=True)] = False
    """Whether an emergency vehicle has its blue light and siren on, so that all give way to it."""
    driver: Word | None = None
    """Driver: attentive, insistent, lawful or scripted, instead of ``others``; not of the ego."""


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
    """Kind of quantity that is compared with ``value``."""
    value: QuantityField = 0.0
    """Threshold in the kind's unit; of ``after`` and ``began`` a constant; none of ``contact``."""
    to: Word | None = None
    """Other participant, for distance, gap, ttc, headway and contact."""
    of: Word | None = None
    """Participant whose state is evaluated; the event's own by default."""
    event: Word | None = None
    """Event that must have ended, for ``after``, or begun, for ``began``."""
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
    """Number of lanes to change, to the left of its direction of travel positive."""
    time: Duration | None = None
    """Duration of the lane change [s]."""
    distance: Length | None = None
    """Length of the lane change [m]."""
    shape: Literal["linear", "cubic", "sinusoidal"] = "sinusoidal"
    """Profile of the lateral movement over time, or distance."""


class LaneOffsetSection(ShapedSection):
    """A way aside: within its lane, or over its edge."""

    offset: Length
    """Target offset from the lane's centre [m], left positive."""
    acceleration: Acceleration = 1.0
    """Largest lateral acceleration [m/s²]."""
    shape: Literal["linear", "cubic", "sinusoidal"] = "sinusoidal"
    """Profile of the lateral movement over time."""


class KeepDistanceSection(ShapedSection):
    """A distance that it keeps behind another one, bumper to bumper, from then on."""

    to: Word
    """Other participant that is followed."""
    distance: Length | None = None
    """Distance to keep, bumper to bumper [m]."""
    time: Duration | None = None
    """Time gap to keep instead of a distance, at its own speed [s]."""
    acceleration: Acceleration = 2.0
    """Largest acceleration [m/s²]; ISO 15622 allows an adaptive cruise control as much."""
    braking: Acceleration = 3.5
    """Largest deceleration [m/s²]; ISO 15622 allows an adaptive cruise control as much."""
    max_speed: Speed | None = None
    """Largest speed while it catches up [m/s]."""


class ArrivalSection(ShapedSection):
    """It chooses its speed so that it arrives as another one does."""

    at: WaypointSection
    """Position at which the event's participant arrives."""
    other: Word
    """Other participant whose arrival it matches."""
    place: WaypointSection
    """Position at which the other participant arrives."""


ACTIONS = (
    "speed",
    "lane_change",
    "lane_offset",
    "keep_distance",
    "arrive",
    "indicate",
    "door",
    "weather",
)
"""Keys of an event that are actions; it has one of them at least."""


class EventSection(ShapedSection):
    """Something that happens."""

    participant: Word | None = None
    """Participant that acts; none where the weather changes."""
    speed: Speed | None = None
    """Target speed [m/s]; a vehicle reverses below 0."""
    rate: Acceleration | None = None
    """Acceleration or deceleration of the speed change [m/s²]."""
    jerk: Number | None = None
    """Rate at which the acceleration, up to ``rate``, builds up and is released [m/s³]."""
    time: Duration | None = None
    """Duration of the speed change, or of that of the weather, or of the opening of a door; then a
    constant [s]."""
    distance: Length | None = None
    """Distance covered during the speed change [m]."""
    shape: Literal["linear", "cubic", "sinusoidal"] = "linear"
    """Profile of the speed over time, or distance."""
    lane_change: LaneChangeSection | None = None
    """Lane change of the participant."""
    lane_offset: LaneOffsetSection | None = None
    """Lateral movement of the participant in its lane, or over its edge."""
    keep_distance: KeepDistanceSection | None = None
    """Distance that the participant keeps behind another one."""
    arrive: ArrivalSection | None = None
    """Arrival of the participant at the same time as that of another one elsewhere."""
    indicate: Literal["left", "right", "hazard", "off"] | None = None
    """Indicator or hazard lights that the participant switches on, or off."""
    door: Literal["left", "right"] | None = None
    """Front door that a standing vehicle opens, within ``time``."""
    weather: Word | None = None
    """Prefix of the parameters that state the new weather."""
    when: Annotated[list[ConditionSection], Field(min_length=1)]
    """Alternative conditions; the first to hold starts the event."""


class JamSection(ShapedSection):
    """A queue of standing vehicles."""

    tail: WaypointSection
    """Position of the last vehicle."""
    vehicles: Annotated[list[QueueName], Field(min_length=1)]
    """Types of the vehicles, the last first."""
    gap: Length = 3.0
    """Gap between two vehicles [m]."""


class GhostSection(ShapedSection):
    """Something that the ego's sensors report and that is not there."""

    type: Annotated[TypeName, AfterValidator(canonical)] = "car"
    """Type of participant that it is taken for."""
    at: Length | None = None
    """Place along the ego's route at which it seems to stand, from the ego's start [m]."""
    rate: Curvature | None = None
    """Births per distance travelled instead of a place [1/m], at random in the region ahead."""
    mirrors: Text | None = None
    """Participant whose mirror image it is instead of a place."""
    aside: Length | None = None
    """Distance of the guard rail or wall, the mirror, to the left of the ego's route [m]."""
    share: Ratio | None = None
    """Share of frames in which it is reported [1], else all of them."""
    appears: Length
    """Largest distance ahead of the ego's front at which it is reported [m]."""
    vanishes: Length = 0.0
    """Distance ahead of the ego's front below which it is not reported any more [m]."""
    lifetime: Duration = 60.0
    """Longest time for which it is reported [s]; of births at random the mean."""


class TrackerSection(ShapedSection):
    """What the ego's sensors do not resolve, and how its tracker confirms and keeps a track."""

    angle: Angle = 0.0
    """Gap in bearing up to which two bodies are detected as one [deg]."""
    range: Length = 0.0
    """Gap in range up to which two bodies are detected as one [m]."""
    extent: Ratio = 1.0
    """Share by which the greater one's box grows to enclose both [1]; at 0 it masks the other."""
    confirm: Ratio = 3.0
    """Number of frames, of the last ``of``, that must see a track before it is confirmed."""
    of: Ratio = 5.0
    """Number of last frames that count for that."""
    coast: Duration = 1.0
    """How long a confirmed track is kept after the last detection [s]."""


class WorksSection(ShapedSection):
    """A lane that is closed by cones."""

    start: WaypointSection
    """Position on the closed lane at which the road works begin."""
    length: Metres
    """Length of the road works [m]."""
    taper: Metres
    """Length over which the cones cross the lane [m]."""
    spacing: Metres = 5.0
    """Distance between two cones [m]."""
    sign_before: Metres = 40.0
    """Distance of the sign before the road works [m]."""
