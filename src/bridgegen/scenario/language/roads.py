"""The road network of a scenario file: a template and its parameters.

A template is a kind of road network with named measures (*knobs*). Each is a constant, or the
name of a parameter of the static axis; without a word about it, a static parameter of the knob's
own name, or else the template's usual value.
"""

from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal, NamedTuple

from bridgegen.scenario.language.parameters import Axis, Derived, Parameter, nearest

Quantity = str | float
"""A parameter's name, or a constant."""

Template = Literal["crossroads", "t-junction", "roundabout", "merge", "road"]
RoadType = Literal["town", "rural", "motorway"]
Turn = Literal["left", "straight", "right"]


@dataclass(frozen=True)
class Knob:
    """A measure of a template.

    Attributes:
        unit: of its value.
        usual: its default value.
        low: the least that makes sense.
        high: the most.
        why: where the usual value comes from, or what it means.
    """

    unit: str
    usual: float
    low: float
    high: float
    why: str


_COMMON = {
    "lane_width": Knob("m", 3.5, 2.5, 5.0, "Width of every driving lane; as in CARLA's Town05."),
    "speed_limit": Knob("m/s", 13.9, 1.0, 60.0, "50 km/h, the usual limit in towns."),
    "sidewalk_width": Knob("m", 0.0, 0.0, 10.0, "Beside the road on both sides; 0 for none."),
    "shoulder_width": Knob("m", 0.0, 0.0, 5.0, "Outside the driving lanes; 0 for none."),
    "crosswalk_width": Knob("m", 4.0, 2.0, 12.0, "Along the road; 4 m is usual (StVO, VwV § 26)."),
    "closing_fog_density": Knob("%", 100.0, 0.0, 100.0, "The road is closed in denser fog."),
    "closing_precipitation": Knob("%", 100.0, 0.0, 100.0, "The road is closed in heavier rain."),
}
_LEGS = {
    "lanes_per_direction": Knob("count", 2, 1, 4, "On each leg; as in CARLA's Town05."),
    "arm_length": Knob("m", 60.0, 10.0, 2000.0, "Of each leg, from the junction's edge."),
}
_JUNCTION = _LEGS | {
    "intersection_size": Knob("m", 26.0, 6.0, 200.0, "From leg to opposite leg; as in Town05."),
    "green_time": Knob("s", 20.0, 5.0, 120.0, "RiLSA: green lasts at least 5 s."),
    "yellow_time": Knob("s", 3.0, 3.0, 6.0, "RiLSA: 3 s at 50 km/h."),
    "all_red_time": Knob("s", 2.0, 0.0, 10.0, "Until the junction is clear."),
    "signal_offset": Knob("s", 0.0, 0.0, 200.0, "Of the cycle that has passed at time 0."),
}
KNOBS: Mapping[Template, Mapping[str, Knob]] = MappingProxyType(
    {
        "crossroads": _COMMON | _JUNCTION,
        "t-junction": _COMMON | _JUNCTION,
        "roundabout": _COMMON
        | _LEGS
        | {
            "lanes_per_direction": Knob("count", 1, 1, 1, "A single-lane roundabout."),
            "radius": Knob("m", 15.0, 9.0, 60.0, "Of the ring lane's centre; FHWA: 14 to 20 m."),
            "ring_lane_width": Knob("m", 5.0, 3.5, 8.0, "FHWA NCHRP 672: 4.8 to 6 m."),
        },
        "merge": _COMMON
        | {
            "lanes": Knob("count", 2, 1, 5, "Of the main carriageway."),
            "lane_width": Knob("m", 3.75, 2.75, 5.0, "RAA: 3.75 m on motorways."),
            "speed_limit": Knob("m/s", 33.3, 5.0, 60.0, "120 km/h."),
            "arm_length": Knob("m", 300.0, 50.0, 5000.0, "Of main carriageway and ramp, before."),
            "merge_length": Knob("m", 200.0, 50.0, 800.0, "Of the acceleration lane; RAA: 250 m."),
            "taper_length": Knob("m", 60.0, 20.0, 300.0, "Over which it narrows; RAA: 60 m."),
            "after_length": Knob("m", 300.0, 50.0, 5000.0, "Of the carriageway beyond."),
        },
        "road": _COMMON
        | {
            "lanes": Knob("count", 2, 1, 6, "In the direction of the road."),
            "lanes_against": Knob("count", 0, 0, 6, "In the other direction."),
            "length": Knob("m", 400.0, 20.0, 10000.0, "Where no segments say so."),
            "grade": Knob("1", 0.0, -0.2, 0.2, "Rise by length, along the road; RAL: 0.08."),
        },
    }
)
"""Parameters of each template of a road network."""

HEADINGS: Mapping[str, Mapping[str, float]] = MappingProxyType(
    {
        "crossroads": {"A": 270.0, "B": 180.0, "C": 90.0, "D": 0.0},
        "t-junction": {"A": 270.0, "B": 180.0, "D": 0.0},
        "roundabout": {"A": 270.0, "B": 180.0, "C": 90.0, "D": 0.0},
        "merge": {},
        "road": {},
    }
)
"""Usual legs: their outward headings [deg], counter-clockwise from +x (east)."""

LEG_NAMES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {"merge": ("main", "ramp", "after"), "road": ("main",)}
)
"""The legs of a template that has no headings."""

CROSSWALK_GAP = 1.0
"""Distance from the junction's edge to a leg's crosswalk, and from there to the stop line [m];
ours."""

LETTERS = "ABCDE"
"""Names of legs with a heading; the paper numbers their points P1, P2 (A) to P9, P10 (E)."""


@dataclass(frozen=True)
class LegSpec:
    """A file's section on one leg; None leaves it to the knobs.

    Attributes:
        heading: outwards [deg], counter-clockwise from +x.
        lanes_in: number of lanes towards the junction.
        lanes_out: number of lanes away from it.
        turns: where each lane towards the junction leads, innermost first; empty: by rule.
        sign: what stands at its stop line.
        crosswalk: whether people cross it at the junction.
    """

    heading: float
    lanes_in: int | None = None
    lanes_out: int | None = None
    turns: tuple[tuple[Turn, ...], ...] = ()
    sign: Literal["stop", "yield"] | None = None
    crosswalk: bool = False


@dataclass(frozen=True)
class Segment:
    """A stretch of a road's reference line: constant curvature, or changing evenly.

    Attributes:
        length: [m].
        curvature: at its start [1/m], left positive.
        end_curvature: at its end.
    """

    length: Quantity
    curvature: Quantity
    end_curvature: Quantity


class Change(NamedTuple):
    """What of a road is different from a place on; "" is as before.

    Attributes:
        at: the place, from the road's start [m].
        road_type: its class from there on.
        markings: how its lanes are marked from there on.
    """

    at: Quantity
    road_type: RoadType | Literal[""] = ""
    markings: Literal["none", ""] = ""


@dataclass(frozen=True)
class RoadsSpec:
    """A road network as a scenario file describes it.

    Attributes:
        template: its kind.
        knobs: every measure of the template by name: a constant or a static parameter's name.
        legs: of a junction or roundabout, by name.
        segments: of a road; empty: straight.
        crosswalk_at: of a road: where its crosswalk's centre lies [m], None for none.
        signals: traffic lights at the junction: none, or a phase for each pair of opposite legs.
        road_type: what kind of road it is.
        left_hand: whether traffic drives on the left: then this is its mirror image.
        country: by whose law priority is judged, a code of ISO 3166-1; "": none is stated.
        change: of a road: what is different from a place on; None: nothing.
    """

    template: Template
    knobs: Mapping[str, Quantity]
    legs: Mapping[str, LegSpec]
    segments: tuple[Segment, ...] = ()
    crosswalk_at: float | None = None
    signals: Literal["none", "two-phase"] = "none"
    road_type: RoadType = "town"
    left_hand: bool = False
    country: str = ""
    change: Change | None = None

    def __repr__(self) -> str:
        """Return its contents in canonical form, for a scenario's fingerprint."""
        more = f", {self.left_hand!r}, {self.country!r}" if self.left_hand or self.country else ""
        more += f", {self.change!r}" if self.change else ""
        return (
            f"RoadsSpec({self.template!r}, {dict(sorted(self.knobs.items()))!r}, "
            f"{dict(sorted(self.legs.items()))!r}, {self.segments!r}, {self.crosswalk_at!r}, "
            f"{self.signals!r}, {self.road_type!r}{more})"
        )

    @property
    def leg_names(self) -> tuple[str, ...]:
        """The legs that a waypoint may lie on."""
        return LEG_NAMES.get(self.template) or tuple(self.legs)

    @property
    def parameters(self) -> frozenset[str]:
        """The static parameters that it is built from."""
        bends = [
            q
            for segment in self.segments
            for q in (segment.length, segment.curvature, segment.end_curvature)
        ]
        places = () if self.change is None else (self.change.at,)
        return frozenset(q for q in (*self.knobs.values(), *bends, *places) if isinstance(q, str))

    @property
    def closes(self) -> dict[str, Quantity]:
        """The weather parameters beyond which it is closed, with the limits [%]."""
        found = {name: self.knobs[f"closing_{name}"] for name in ("fog_density", "precipitation")}
        # Weather goes to 100 %: that limit never closes the road.
        return {name: limit for name, limit in found.items() if limit != 100.0}

    def length(self, leg: str) -> Quantity | None:
        """Return the length of a leg [m]; None if only its segments define it."""
        if self.template == "road":
            return None if self.segments else self.knobs["length"]
        return self.knobs["after_length" if leg == "after" else "arm_length"]

    def crosswalk(self, leg: str) -> float | None:
        """Return where the centre of a leg's crosswalk lies [m along the leg]; None for none."""
        if self.template == "road":
            return self.crosswalk_at
        width = self.knobs["crosswalk_width"]
        if leg not in self.legs or not self.legs[leg].crosswalk or isinstance(width, str):
            return None
        return CROSSWALK_GAP + 0.5 * width

    def lanes(self, leg: str, way: str) -> Quantity:
        """Return how many driving lanes a leg has in a direction ("in" or "out")."""
        if self.template == "road":
            return self.knobs["lanes" if way == "out" else "lanes_against"]
        if self.template == "merge":
            if (leg == "after") != (way == "out"):
                return 0.0
            return 1.0 if leg == "ramp" else self.knobs["lanes"]
        given = self.legs[leg].lanes_in if way == "in" else self.legs[leg].lanes_out
        return self.knobs["lanes_per_direction"] if given is None else float(given)


def usual(template: Template = "crossroads", **knobs: Quantity) -> RoadsSpec:
    """Return a template with its usual legs and, but for those given, measures.

    Raises:
        KeyError: no such template or knob.
    """
    found: dict[str, Quantity] = {name: knob.usual for name, knob in KNOBS[template].items()}
    for name, value in knobs.items():
        # For its KeyError: a misspelt knob would be carried along, and do nothing.
        _ = KNOBS[template][name]
        found[name] = value
    legs = {name: LegSpec(heading) for name, heading in HEADINGS[template].items()}
    return RoadsSpec(template, found, legs)


def knobs_of(
    template: Template,
    given: Mapping[str, Quantity],
    declared: Mapping[str, Parameter],
) -> dict[str, Quantity]:
    """Return every knob of a template: as given, a static parameter of its name, or its default."""
    found: dict[str, Quantity] = {}
    for name, knob in KNOBS[template].items():
        parameter = declared.get(name)
        own = name if parameter is not None and parameter.axis is Axis.STATIC else knob.usual
        found[name] = given.get(name, own)
    return found


def knob_problems(
    template: Template,
    given: Mapping[str, Quantity],
    declared: Mapping[str, Parameter | Derived],
    names: Set[str],
) -> Iterator[tuple[str, str]]:
    """Yield each knob with an invalid value, and why.

    Args:
        template: the kind of road network.
        given: the file's values, with static parameters of a knob's own name.
        declared: parameters and derived quantities.
        names: all that is declared, also wrongly.
    """
    known = KNOBS[template]
    for name, value in given.items():
        if name not in known:
            yield name, f"template {template} has no '{name}'{nearest(name, known)}"
            continue
        knob = known[name]
        rule = f"{name} [{knob.unit}] of template {template} must be {knob.low:g} to {knob.high:g}"
        if not isinstance(value, str):
            if not knob.low <= value <= knob.high:
                yield name, f"{rule}, got {value:g}"
            elif knob.unit == "count" and value != int(value):
                yield name, f"{name} must be a whole number, got {value:g}"
            continue
        if knob.unit == "s":
            yield (
                name,
                f"{name} [s] must be a constant, got '{value}': the lights' phases are part of the "
                "storyboard, and one storyboard serves every road network",
            )
            continue
        parameter = declared.get(value)
        if parameter is None:
            if value not in names:
                hint = nearest(value, declared)
                yield name, f"{name} names the unknown parameter '{value}'{hint}"
        elif isinstance(parameter, Derived) or parameter.axis is not Axis.STATIC:
            yield name, f"{name} must be a number or a parameter of the static axis, got '{value}'"
        elif parameter.kind.names:
            yield name, f"{name} needs a number, '{value}' is a category"
        elif parameter.unit != knob.unit:
            share = " (a share: 5 % is 0.05)" if (knob.unit, parameter.unit) == ("1", "%") else ""
            yield (
                name,
                f"{name} needs a parameter in {knob.unit}{share}, '{value}' is in {parameter.unit}",
            )
        elif parameter.low < knob.low or parameter.high > knob.high:
            yield name, f"{rule}, '{value}' goes from {parameter.low:g} to {parameter.high:g}"
        elif parameter.kind.apart != (knob.unit == "count"):
            kind = "integer" if knob.unit == "count" else "float"
            yield name, f"{name} needs a parameter of kind {kind}, '{value}' is not one"
