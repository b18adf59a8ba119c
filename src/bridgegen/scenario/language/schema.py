"""The shape of a scenario file: which keys there are, what type each takes, what it means.

The texts under the keys are what editors and the documentation show
(`bridgegen.scenario.language.json_schema`). Rules about values are kept by the types that the file
becomes (``parameters``, ``story``, …).
"""

from typing import Annotated, Any, Literal

from pydantic import Field, ValidationInfo, field_validator

from bridgegen.scenario.language.criteria import CriterionSection
from bridgegen.scenario.language.exposure_schema import ExposureSection
from bridgegen.scenario.language.protocols import ClauseSection, GridSection
from bridgegen.scenario.language.schema_types import (
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
    GhostSection,
    JamSection,
    ParticipantSection,
    TrackerSection,
    WorksSection,
)
from bridgegen.scenario.language.storyboard import RecordedSection

# --- The shape of a scenario file's ``roads``: its keys, what each takes and means ---


class LegSection(ShapedSection):
    """One leg of a junction or roundabout."""

    heading: Degrees | None = None
    """Direction of the leg outwards [deg], counter-clockwise from east; legs are 45° apart at
    least."""
    lanes_in: Annotated[Number, Field(ge=0, le=6, multiple_of=1)] | None = None
    """Number of lanes towards the junction."""
    lanes_out: Annotated[Number, Field(ge=0, le=6, multiple_of=1)] | None = None
    """Number of lanes away from the junction."""
    turns: list[list[Literal["left", "straight", "right"]]] = []
    """Turns from each lane towards the junction, innermost first, e.g. [[left], [straight]]."""
    sign: Literal["stop", "yield"] | None = None
    """Traffic sign at the leg's stop line."""
    crosswalk: Annotated[bool, Field(strict=True)] | None = None
    """Whether the leg has a crosswalk at the junction; the value of ``crosswalks`` by default."""


class SegmentSection(ShapedSection):
    """One stretch of a road."""

    length: Length
    """Length of the segment [m]."""
    curvature: Curvature = 0.0
    """Curvature at the segment's start [1/m], left positive."""
    end_curvature: Curvature | None = None
    """Curvature at the segment's end [1/m]; that at its start by default."""


class ChangeSection(ShapedSection):
    """What of a road is different from a place on."""

    at: Length
    """Distance of the place from the start of the road [m]."""
    road_type: Literal["town", "rural", "motorway"] | None = None
    """Type of the road from there on; as before by default."""
    markings: Literal["none"] | None = None
    """Markings of the lanes from there on: none; as before by default."""


class RoadsSection(ShapedSection):
    """The road network: its legs and its template parameters (see ``roads.KNOBS``)."""

    legs: dict[str, LegSection] = {}
    """Legs of a junction or roundabout, by letter, A to E."""
    segments: list[SegmentSection] = []
    """Segments of a road, one after the other; straight by default."""
    crosswalk_at: Metres | None = None
    """Distance of a crosswalk's centre from the start of a road without junction [m]."""
    crosswalks: Annotated[bool, Field(strict=True)] = False
    """Whether there are crosswalks on all legs."""
    signals: Literal["none", "two-phase"] = "none"
    """Traffic lights of a junction: none, or a phase for each pair of opposite legs."""
    road_type: Literal["town", "rural", "motorway"] | None = None
    """Type of the road."""
    changes: ChangeSection | None = None
    """Place from which on a road without junction has another type, or no markings."""
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


class PriorSection(ShapedSection):
    """The ``prior`` of a parameter: how often its values are met."""

    bands: Annotated[
        dict[str, Annotated[list[Number], Field(min_length=2, max_length=2)]], Field(min_length=1)
    ]
    """Bands of values, ascending: NAME: [highest value, share]; the first may be one value."""
    source: Text
    """Source of the shares."""


class ParameterSection(ShapedSection):
    """One entry of ``parameters``."""

    axis: AxisName
    """Axis: the part of the search space that the parameter belongs to."""
    kind: KindName = "float"
    """Kind of the parameter's values: numbers, whole numbers, names of a category, or angles."""
    unit: Text | None = None
    """SI unit; see the list of units. A category has none."""
    low: Measured | None = None
    """Smallest value, in the parameter's unit."""
    high: Measured | None = None
    """Largest value, in the parameter's unit; of an angle, it may be less than the smallest."""
    values: Annotated[list[Text], Field(min_length=2)] | None = None
    """Names of a category's values."""
    only: Text | None = None
    """The one value of a category that it has here; by default it may have any."""
    default: NumberOrName
    """Value of the parameter while its axis is not searched."""
    description: Text
    """Quantity that the parameter states, in words."""
    source: Text
    """Source of the range."""
    prior: PriorSection | None = None
    """Shares of driving time, by which a search draws its values; without one evenly."""

    @field_validator("low", "high", "default", mode="before")
    @classmethod
    def _in_its_unit(cls, value: object, info: ValidationInfo) -> object:
        return convert(value, info.data.get("unit"))


class BoundSection(ShapedSection):
    """One entry of ``bounds``."""

    target: Text
    """Parameter that is limited."""
    lo: Formula | None = None
    """Lower limit: a formula of other parameters."""
    hi: Formula | None = None
    """Upper limit: a formula of other parameters."""
    why: Text
    """Reason of the limit."""
    source: Text
    """Source of the limit."""


class DerivedSection(ShapedSection):
    """One entry of ``derived``."""

    axis: AxisName
    """Axis that the derived quantity belongs to."""
    unit: Text
    """SI unit; see the list of units."""
    value: Formula
    """Formula of parameters that gives the value."""
    why: Text
    """Reason of the formula."""
    source: Text
    """Source of the formula."""
    description: Text
    """Quantity that is derived, in words."""


class FragmentFile(ShapedSection):
    """A file that scenarios include: parameters and their constraints."""

    fragment: Word
    """Name of the fragment."""
    description: Text
    """Content of the fragment, in a sentence or two."""
    parameters: dict[str, ParameterSection] = {}
    """Parameters that may vary, by name."""
    bounds: list[BoundSection] = []
    """Limits that depend on other parameters; the search never leaves them."""
    derived: dict[str, DerivedSection] = {}
    """Quantities that follow from parameters, by name."""


class EffectSection(ShapedSection):
    """One entry of ``effects``: a function of the user's that adds to each scenario."""

    function: Text
    """Function: FILE.py:FUNCTION beside the scenario, or the name of an entry point."""


class TermSection(ShapedSection):
    """One metric of the objective."""

    metric: QuantityName
    """Metric: see 'bridgegen list metrics'; or the margin of a criterion, criterion:ID."""
    weight: Number | None = None
    """Weight of the metric, with ``weights: fixed``."""


class CriticalSection(ShapedSection):
    """What makes a scenario critical."""

    n_collision_above: Number = 0.0
    """Number of collisions above which a scenario is critical."""
    d_min_below: Metres = 2.0
    """Minimum distance below which a scenario is critical [m], if v_d is large enough."""
    v_d_at_least: MetresPerSecond = 1.0
    """Least speed of the ego at the minimum distance for ``d_min_below`` to apply [m/s]."""


class ObjectiveSection(ShapedSection):
    """What is optimised."""

    terms: Annotated[list[TermSection], Field(min_length=1)]
    """Metrics that are optimised."""
    weights: Literal["fixed", "entropy"]
    """Weights of the terms: those that they state, or by the entropy of a random sample."""
    scale: Literal["raw", "standardised"]
    """Scale of the terms: in the metrics' units, or standardised by a random sample."""
    critical: Annotated[
        CriticalSection | Literal["harm", "criteria"], OrWord(CriticalSection, "harm", "criteria")
    ] = CriticalSection()
    """Rule by which a scenario is critical: thresholds; harm; or criteria, of which one is
    violated."""


class ScenarioFile(ShapedSection):
    """A logical scenario."""

    scenario: Word
    """Name of the scenario; the file's name is NAME.yaml."""
    title: Text
    """Title in a few words."""
    description: Text
    """Description of what happens, in a sentence or two."""
    source: Text
    """Source of the scenario: a standard, an accident database, a drive."""
    template: Literal["crossroads", "t-junction", "roundabout", "merge", "road"]
    """Kind of road network (layers 1 and 2)."""
    roads: RoadsSection = RoadsSection()
    """Dimensions and rules of the road network."""
    traffic: Literal["right", "left"] | None = None
    """Side on which traffic drives, right by default; left: the scenario happens in a mirror, its
    right is the nearside and its left the offside."""
    rules: Literal["DE", "JP", "UK", "US"] | None = None
    """Country by whose law it is judged, see docs/conflicts.md; German law by default, or on the
    left its mirror image."""
    driver: Word = "route-follower"
    """Default driver of the ego (see --ego and 'bridgegen list drivers'); storyboard: events of its
    own move it, unless --ego names a driver."""
    others: Literal["attentive", "insistent", "lawful", "scripted"] = "scripted"
    """Default driver of the other participants (see --others, and their ``driver``)."""
    duration: Seconds
    """Duration of the simulation [s]."""
    time_step: Seconds
    """Time step of the simulation [s]."""
    road_end: Literal["leave", "stand"] = "leave"
    """Behaviour of participants other than the ego where their road ends: leave, or stand."""
    axes: Annotated[list[AxisName], Field(min_length=1)]
    """Axes that are searched by default (see --axes)."""
    priors: Literal["met", "even"] = "met"
    """Values that a search draws: as often as priors say, or evenly over the ranges."""
    include: list[Text] = []
    """Fragments to include: of the catalogue, or files beside this one; "NAME as PREFIX_" again."""
    participants: dict[str, ParticipantSection]
    """Participants by name (layer 4); one is ``ego``."""
    events: dict[str, EventSection] = {}
    """Events by name: what happens, and when."""
    jams: dict[str, JamSection] = {}
    """Queues of standing vehicles by name (layer 3)."""
    road_works: dict[str, WorksSection] = {}
    """Lanes closed by cones, by name (layer 3)."""
    ghosts: dict[str, GhostSection] = {}
    """False positives of the ego's sensors by name: what they report and is not there."""
    tracker: TrackerSection | None = None
    """What the ego's sensors do not resolve, and how late its tracks are."""
    effects: list[EffectSection] = []
    """Functions of your own that add to each scenario."""
    parameters: dict[str, ParameterSection] = {}
    """Parameters that may vary, by name."""
    defaults: dict[str, NumberOrName] = {}
    """New default values of included parameters, by name."""
    bounds: list[BoundSection] = []
    """Limits that depend on other parameters; the search never leaves them."""
    derived: dict[str, DerivedSection] = {}
    """Quantities that follow from parameters, by name."""
    criteria: list[CriterionSection] = []
    """Pass criteria: formulas that must hold, each with an id."""
    odd: dict[
        Literal["INCLUDE_AND", "INCLUDE_OR", "EXCLUDE_AND", "EXCLUDE_OR"], dict[str, Any]
    ] = {}
    """Operational design domain of the ego, in sections of an OpenODD module: see docs/odd.md."""
    matrix: list[GridSection] = []
    """Values to test instead of a sample of the ranges: what 'bridgegen suite' runs."""
    clauses: list[ClauseSection] = []
    """Clauses of a regulation or protocol, which a suite judges."""
    recorded: RecordedSection | None = None
    """Recorded events that are this scenario, and its parameters in them: see 'bridgegen mine'."""
    objective: Annotated[
        ObjectiveSection | Literal["harm", "paper"], OrWord(ObjectiveSection, "harm", "paper")
    ] = "harm"
    """Objective, and rule by which a scenario is critical; harm: see docs/conflicts.md; paper: the
    fitness and the thresholds of the paper."""
    exposure: ExposureSection | None = None
    """Frequency of the scenario on the road, and distributions of its parameters; not used by a
    search."""
