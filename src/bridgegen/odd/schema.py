"""The shape of a scenario file: which keys there are and what type each takes.

Rules about values are kept by the types that the file becomes (``parameters``, ``story``, …).
"""

from typing import Annotated, Literal

from pydantic import Field

from bridgegen.odd.shape import (
    AxisName,
    Formula,
    LaneField,
    Number,
    QuantityField,
    ShapedSection,
    Text,
    Word,
)


class ParameterSection(ShapedSection):
    """One entry of ``parameters``."""

    axis: AxisName
    unit: Text
    low: Number
    high: Number
    default: Number
    kind: Literal["float", "integer"] = "float"
    description: Text
    source: Text


class BoundSection(ShapedSection):
    """One entry of ``bounds``."""

    target: Text
    lo: Formula | None = None
    hi: Formula | None = None
    why: Text
    source: Text


class DerivedSection(ShapedSection):
    """One entry of ``derived``."""

    axis: AxisName
    unit: Text
    value: Formula
    why: Text
    source: Text
    description: Text


class FragmentFile(ShapedSection):
    """A file that scenarios include: parameters and their constraints."""

    fragment: Word
    description: Text
    parameters: dict[str, ParameterSection] = {}
    bounds: list[BoundSection] = []
    derived: dict[str, DerivedSection] = {}


class LegSection(ShapedSection):
    """One leg of ``roads.legs``."""

    heading: Number | None = None
    lanes_in: Annotated[Number, Field(ge=0, le=6, multiple_of=1)] | None = None
    lanes_out: Annotated[Number, Field(ge=0, le=6, multiple_of=1)] | None = None
    turns: list[list[Literal["left", "straight", "right"]]] = []
    sign: Literal["stop", "yield"] | None = None
    crosswalk: Annotated[bool, Field(strict=True)] | None = None


class SegmentSection(ShapedSection):
    """One stretch of ``roads.segments``."""

    length: QuantityField
    curvature: QuantityField = 0.0
    end_curvature: QuantityField | None = None


class RoadsSection(ShapedSection):
    """The road network: what is said of its legs, and its knobs (see ``roads.KNOBS``)."""

    legs: dict[str, LegSection] = {}
    segments: list[SegmentSection] = []
    crosswalk_at: Number | None = None
    crosswalks: Annotated[bool, Field(strict=True)] = False
    signals: Literal["none", "two-phase"] = "none"
    road_type: Literal["town", "rural", "motorway"] | None = None
    lane_width: QuantityField | None = None
    speed_limit: QuantityField | None = None
    sidewalk_width: QuantityField | None = None
    shoulder_width: QuantityField | None = None
    crosswalk_width: QuantityField | None = None
    closing_fog_density: QuantityField | None = None
    closing_precipitation: QuantityField | None = None
    lanes_per_direction: QuantityField | None = None
    arm_length: QuantityField | None = None
    intersection_size: QuantityField | None = None
    green_time: QuantityField | None = None
    yellow_time: QuantityField | None = None
    all_red_time: QuantityField | None = None
    signal_offset: QuantityField | None = None
    radius: QuantityField | None = None
    ring_lane_width: QuantityField | None = None
    lanes: QuantityField | None = None
    lanes_against: QuantityField | None = None
    length: QuantityField | None = None
    merge_length: QuantityField | None = None
    taper_length: QuantityField | None = None
    after_length: QuantityField | None = None


class WaypointSection(ShapedSection):
    """A place on a leg."""

    point: Annotated[str, Field(strict=True, pattern=r"^P([1-9]|10)$")] | None = None
    leg: Word | None = None
    way: Literal["in", "out"] | None = None
    distance: QuantityField
    lane: LaneField = 1
    offset: QuantityField = 0.0


class ParticipantSection(ShapedSection):
    """One entry of ``participants``."""

    type: Literal[
        "car", "van", "truck", "bus", "motorcycle", "emergency",
        "bicycle", "pedestrian", "animal", "obstacle",
    ]  # fmt: skip
    start: WaypointSection | None = None
    end: WaypointSection | None = None
    path: list[WaypointSection] = []
    speed: QuantityField = 0.0


class ConditionSection(ShapedSection):
    """One alternative of an event's ``when``; or several conditions that must hold together."""

    kind: (
        Literal["time", "distance", "ttc", "headway", "speed", "travelled", "standstill", "after"]
        | None
    ) = None
    value: QuantityField = 0.0
    to: Word | None = None
    of: Word | None = None
    event: Word | None = None
    all: "list[ConditionSection]" = []


class LaneChangeSection(ShapedSection):
    """A lane change of an event."""

    lanes: Annotated[Number, Field(ge=-5, le=5, multiple_of=1)]
    time: QuantityField | None = None
    distance: QuantityField | None = None
    shape: Literal["linear", "cubic", "sinusoidal"] = "sinusoidal"


class EventSection(ShapedSection):
    """One entry of ``events``."""

    participant: Word | None = None
    speed: QuantityField | None = None
    rate: QuantityField | None = None
    time: QuantityField | None = None
    distance: QuantityField | None = None
    shape: Literal["linear", "cubic", "sinusoidal"] = "linear"
    lane_change: LaneChangeSection | None = None
    weather: Word | None = None
    when: Annotated[list[ConditionSection], Field(min_length=1)]


class JamSection(ShapedSection):
    """One entry of ``jams``: a queue of standing vehicles."""

    tail: WaypointSection
    vehicles: Annotated[list[Literal["car", "van", "truck", "bus"]], Field(min_length=1)]
    gap: QuantityField = 3.0


class WorksSection(ShapedSection):
    """One entry of ``road_works``: a lane that is closed by cones."""

    start: WaypointSection
    length: Number
    taper: Number
    spacing: Number = 5.0
    sign_before: Number = 40.0


class EffectSection(ShapedSection):
    """One entry of ``effects``: a function of the user's that adds to each scenario."""

    function: Text


class TermSection(ShapedSection):
    """One metric of the objective."""

    metric: Word
    weight: Number | None = None


class CriticalSection(ShapedSection):
    """What makes a scenario critical."""

    n_collision_above: Number = 0.0
    d_min_below: Number = 2.0
    v_d_at_least: Number = 1.0


class ObjectiveSection(ShapedSection):
    """What is optimised."""

    terms: Annotated[list[TermSection], Field(min_length=1)]
    weights: Literal["fixed", "entropy"]
    scale: Literal["raw", "standardised"]
    critical: CriticalSection = CriticalSection()


class ScenarioFile(ShapedSection):
    """A logical scenario."""

    scenario: Word
    title: Text
    description: Text
    source: Text
    template: Literal["crossroads", "t-junction", "roundabout", "merge", "road"]
    roads: RoadsSection = RoadsSection()
    driver: Word = "route-follower"
    duration: Number
    time_step: Number
    axes: Annotated[list[AxisName], Field(min_length=1)]
    include: list[Text] = []
    participants: dict[str, ParticipantSection]
    events: dict[str, EventSection] = {}
    jams: dict[str, JamSection] = {}
    road_works: dict[str, WorksSection] = {}
    effects: list[EffectSection] = []
    parameters: dict[str, ParameterSection] = {}
    defaults: dict[str, Number] = {}
    bounds: list[BoundSection] = []
    derived: dict[str, DerivedSection] = {}
    objective: ObjectiveSection
