"""The shape of a scenario file: which keys there are, what type each takes, what it means.

The texts under the keys are what editors and the documentation show
(`bridgegen.scenario.language.json_schema`). Rules about values are kept by the types that the file
becomes (``parameters``, ``story``, …).
"""

from typing import Annotated, Literal

from pydantic import Field, ValidationInfo, field_validator

from bridgegen.scenario.language.criteria import CriterionSection
from bridgegen.scenario.language.exposure_schema import ExposureSection
from bridgegen.scenario.language.protocols import ClauseSection, GridSection
from bridgegen.scenario.language.shape import (
    AxisName,
    Curvature,
    Degrees,
    Duration,
    Formula,
    KindName,
    Length,
    Measured,
    Metres,
    MetresPerSecond,
    Number,
    NumberOrName,
    OrWord,
    Percent,
    QuantityField,
    QuantityName,
    Ratio,
    Seconds,
    ShapedSection,
    Speed,
    Text,
    Word,
    convert,
)
from bridgegen.scenario.language.story_schema import (
    EventSection,
    JamSection,
    ParticipantSection,
    WorksSection,
)
from bridgegen.scenario.language.storyboard import RecordedSection

# --- The shape of a scenario file's ``roads``: its keys, what each takes and means ---


class LegSection(ShapedSection):
    """One leg of a junction or roundabout."""

    heading: Degrees | None = None
    """Outwards [deg], counter-clockwise from east; legs are 45° apart at least."""
    lanes_in: Annotated[Number, Field(ge=0, le=6, multiple_of=1)] | None = None
    """Number of lanes towards the junction."""
    lanes_out: Annotated[Number, Field(ge=0, le=6, multiple_of=1)] | None = None
    """Number of lanes away from the junction."""
    turns: list[list[Literal["left", "straight", "right"]]] = []
    """Where each lane towards the junction leads, innermost first, e.g. [[left], [straight]]."""
    sign: Literal["stop", "yield"] | None = None
    """What stands at its stop line."""
    crosswalk: Annotated[bool, Field(strict=True)] | None = None
    """Whether it has a crosswalk at the junction; that of ``crosswalks`` by default."""


class SegmentSection(ShapedSection):
    """One stretch of a road."""

    length: Length
    """[m]"""
    curvature: Curvature = 0.0
    """At its start [1/m], left positive."""
    end_curvature: Curvature | None = None
    """At its end [1/m]; the same by default."""


class RoadsSection(ShapedSection):
    """The road network: its legs and its template parameters (see ``roads.KNOBS``)."""

    legs: dict[str, LegSection] = {}
    """Of a junction or roundabout, by letter, A to E."""
    segments: list[SegmentSection] = []
    """Of a road, one after the other; straight by default."""
    crosswalk_at: Metres | None = None
    """Of a road: where its crosswalk's centre lies [m]."""
    crosswalks: Annotated[bool, Field(strict=True)] = False
    """Whether there are crosswalks on all legs."""
    signals: Literal["none", "two-phase"] = "none"
    """Traffic lights at a junction: none, or a phase for each pair of opposite legs."""
    road_type: Literal["town", "rural", "motorway"] | None = None
    """What kind of road it is."""
    lane_width: Length | None = None
    speed_limit: Speed | None = None
    sidewalk_width: Length | None = None
    shoulder_width: Length | None = None
    crosswalk_width: Length | None = None
    closing_fog_density: Percent | None = None
    closing_precipitation: Percent | None = None
    lanes_per_direction: QuantityField | None = None
    arm_length: Length | None = None
    intersection_size: Length | None = None
    green_time: Duration | None = None
    yellow_time: Duration | None = None
    all_red_time: Duration | None = None
    signal_offset: Duration | None = None
    radius: Length | None = None
    ring_lane_width: Length | None = None
    lanes: QuantityField | None = None
    lanes_against: QuantityField | None = None
    length: Length | None = None
    grade: Ratio | None = None
    merge_length: Length | None = None
    taper_length: Length | None = None
    after_length: Length | None = None


class ParameterSection(ShapedSection):
    """One entry of ``parameters``."""

    axis: AxisName
    """The part of the search space that it belongs to."""
    kind: KindName = "float"
    """What it takes: any number, whole ones, one of some names, or angles."""
    unit: Text | None = None
    """SI; see the list of units. A category has none."""
    low: Measured | None = None
    """The smallest value."""
    high: Measured | None = None
    """The largest value; of an angle, that may be less than the smallest."""
    values: Annotated[list[Text], Field(min_length=2)] | None = None
    """The names of a category's values."""
    default: NumberOrName
    """The value while its axis is not searched."""
    description: Text
    """What it is."""
    source: Text
    """Where its range comes from."""

    @field_validator("low", "high", "default", mode="before")
    @classmethod
    def _in_its_unit(cls, value: object, info: ValidationInfo) -> object:
        return convert(value, info.data.get("unit"))


class BoundSection(ShapedSection):
    """One entry of ``bounds``."""

    target: Text
    """The parameter that is limited."""
    lo: Formula | None = None
    """It is at least this: a formula of other parameters."""
    hi: Formula | None = None
    """It is at most this: a formula of other parameters."""
    why: Text
    """The reason."""
    source: Text
    """Source of the rule."""


class DerivedSection(ShapedSection):
    """One entry of ``derived``."""

    axis: AxisName
    """The axis that it belongs to."""
    unit: Text
    """SI; see the list of units."""
    value: Formula
    """A formula of parameters."""
    why: Text
    """The reason."""
    source: Text
    """Source of the rule."""
    description: Text
    """What it is."""


class FragmentFile(ShapedSection):
    """A file that scenarios include: parameters and their constraints."""

    fragment: Word
    """Its name."""
    description: Text
    """What it is."""
    parameters: dict[str, ParameterSection] = {}
    """By name: what may vary."""
    bounds: list[BoundSection] = []
    """Limits that depend on other parameters; the search never leaves them."""
    derived: dict[str, DerivedSection] = {}
    """By name: what follows from parameters."""


class EffectSection(ShapedSection):
    """One entry of ``effects``: a function of the user's that adds to each scenario."""

    function: Text
    """FILE.py:FUNCTION beside the scenario, or the name of an entry point."""


class TermSection(ShapedSection):
    """One metric of the objective."""

    metric: QuantityName
    """See 'bridgegen list metrics'; or the margin of a criterion, criterion:ID."""
    weight: Number | None = None
    """With ``weights: fixed``."""


class CriticalSection(ShapedSection):
    """What makes a scenario critical."""

    n_collision_above: Number = 0.0
    """More collisions than this are critical."""
    d_min_below: Metres = 2.0
    """Nearer than this [m] is critical, if v_d is large enough."""
    v_d_at_least: MetresPerSecond = 1.0
    """How fast the ego must be at d_min for that [m/s]."""


class ObjectiveSection(ShapedSection):
    """What is optimised."""

    terms: Annotated[list[TermSection], Field(min_length=1)]
    """What is minimised or maximised."""
    weights: Literal["fixed", "entropy"]
    """Of the terms, or by the entropy of a random sample."""
    scale: Literal["raw", "standardised"]
    """In the units of the metrics, or standardised by a random sample."""
    critical: Annotated[
        CriticalSection | Literal["harm", "criteria"], OrWord(CriticalSection, "harm", "criteria")
    ] = CriticalSection()
    """What makes a scenario critical: thresholds, harm, or criteria: one that is violated."""


class ScenarioFile(ShapedSection):
    """A logical scenario."""

    scenario: Word
    """Its name; the file's name is NAME.yaml."""
    title: Text
    """A few words."""
    description: Text
    """What happens, in a sentence or two."""
    source: Text
    """Where it comes from: a standard, an accident database, a drive."""
    template: Literal["crossroads", "t-junction", "roundabout", "merge", "road"]
    """The kind of road network (layers 1 and 2)."""
    roads: RoadsSection = RoadsSection()
    """Its measures."""
    driver: Word = "route-follower"
    """Default driver of the ego (see --ego and 'bridgegen list drivers')."""
    others: Literal["attentive", "insistent", "scripted"] = "scripted"
    """Default driver of the other participants (see --others, and their ``driver``)."""
    duration: Seconds
    """Of the simulation [s]."""
    time_step: Seconds
    """Of the simulation [s]."""
    road_end: Literal["leave", "stand"] = "leave"
    """What participants other than the ego do where their road ends: leave, or stand."""
    axes: Annotated[list[AxisName], Field(min_length=1)]
    """Axes that are searched by default (see --axes)."""
    include: list[Text] = []
    """Fragments: of the catalogue, or files beside this one; "NAME as PREFIX_" again."""
    participants: dict[str, ParticipantSection]
    """By name (layer 4); one is ``ego``."""
    events: dict[str, EventSection] = {}
    """By name: what happens, and when."""
    jams: dict[str, JamSection] = {}
    """By name (layer 3)."""
    road_works: dict[str, WorksSection] = {}
    """By name (layer 3)."""
    effects: list[EffectSection] = []
    """Functions of yours that add to each scenario."""
    parameters: dict[str, ParameterSection] = {}
    """By name: what may vary."""
    defaults: dict[str, NumberOrName] = {}
    """Changes of included parameters."""
    bounds: list[BoundSection] = []
    """Limits that depend on other parameters; the search never leaves them."""
    derived: dict[str, DerivedSection] = {}
    """By name: what follows from parameters."""
    criteria: list[CriterionSection] = []
    """Pass criteria: formulas that a scenario must keep, each with an id."""
    matrix: list[GridSection] = []
    """Values to test instead of a sample of the ranges: what 'bridgegen suite' runs."""
    clauses: list[ClauseSection] = []
    """Clauses of a regulation or protocol, which a suite judges."""
    recorded: RecordedSection | None = None
    """Which recorded events are this scenario, and its parameters in them: 'bridgegen mine'."""
    objective: Annotated[
        ObjectiveSection | Literal["harm", "paper"], OrWord(ObjectiveSection, "harm", "paper")
    ] = "harm"
    """What is optimised, and what counts as critical; harm: see docs/conflicts.md; paper: the
    fitness and the thresholds of the paper."""
    exposure: ExposureSection | None = None
    """How often it is met, and with which values; no part of a search."""
