"""The shape of a scenario file's ``roads``: its keys, what each takes and means."""

from typing import Annotated, Literal

from pydantic import Field

from bridgegen.scenario.language.shape import (
    Curvature,
    Degrees,
    Duration,
    Length,
    Metres,
    Number,
    Percent,
    QuantityField,
    Ratio,
    ShapedSection,
    Speed,
)


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
