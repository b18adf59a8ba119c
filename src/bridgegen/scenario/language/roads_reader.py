"""The ``roads`` section of a scenario file: from its keys to a ``RoadsSpec``."""

import math
from collections.abc import Callable, Iterator, Mapping, Set
from itertools import pairwise

from bridgegen.scenario.language.parameters import Derived, Parameter, nearest
from bridgegen.scenario.language.plain_yaml import Path
from bridgegen.scenario.language.roads import (
    HEADINGS,
    KNOBS,
    LETTERS,
    Change,
    LegSpec,
    RoadsSpec,
    RoadType,
    Segment,
    Template,
    knob_problems,
    knobs_of,
)
from bridgegen.scenario.language.schema import LegSection, RoadsSection

LEAST_ANGLE = 45.0
"""Least angle between two legs of a junction [deg]."""

_FEWEST = {"crossroads": 2, "t-junction": 3, "roundabout": 3}
_MOST = {"crossroads": 5, "t-junction": 3, "roundabout": 5}
_TIGHTEST = 1 / 6.0  # 1/m: what a car at full lock can just drive

Say = Callable[[str, Path], None]


def read_roads(
    template: Template,
    given: RoadsSection,
    parameters: Mapping[str, Parameter],
    derived: Mapping[str, Derived],
    declared: Set[str],
    report: Say,
) -> RoadsSpec:
    """Return the road network that a file describes, and report its problems.

    Args:
        template: its kind.
        given: the file's section on it.
        parameters: what it may name.
        derived: what it may not name, for the message.
        declared: all names, also of what is declared wrongly.
        report: gets a problem and its path.
    """
    every = {name for knobs in KNOBS.values() for name in knobs}
    values = {name: value for name in every if (value := getattr(given, name)) is not None}
    known: dict[str, Parameter | Derived] = {**derived, **parameters}
    knobs = knobs_of(template, values, parameters)
    unknown = {name: value for name, value in values.items() if name not in knobs}
    for name, problem in knob_problems(template, unknown | knobs, known, declared):
        report(problem, ("roads", name))
    legs = _legs(template, given, report)
    if template != "road":
        for key in ("segments", "crosswalk_at", "changes"):
            if getattr(given, key):
                report(f"template {template} has no '{key}'", ("roads", key))
    if template not in ("crossroads", "t-junction") and given.signals != "none":
        report(f"template {template} has no signals", ("roads", "signals"))
    segments = tuple(
        Segment(
            segment.length,
            segment.curvature,
            segment.curvature if segment.end_curvature is None else segment.end_curvature,
        )
        for segment in given.segments
    )
    for number, segment in enumerate(segments):
        for key, value, low, high in (
            ("length", segment.length, 1.0, 5000.0),
            ("curvature", segment.curvature, -_TIGHTEST, _TIGHTEST),
            ("end_curvature", segment.end_curvature, -_TIGHTEST, _TIGHTEST),
        ):
            for problem in _measure(key, value, low, high, known, declared):
                report(problem, ("roads", "segments", number))
    length = knobs.get("length", 0.0)
    at = given.crosswalk_at
    straight = not segments and isinstance(length, float)
    if at is not None and straight and not 0.0 < at < float(length):
        report(
            f"crosswalk_at [m] must lie on the road, 0 to {length:g}, got {at:g}",
            ("roads", "crosswalk_at"),
        )
    change = None
    if given.changes is not None:
        later = given.changes
        change = Change(later.at, later.road_type or "", later.markings or "")
        length = length if straight else 10_000.0  # segments say it as they are built
        for problem in _measure("at", change.at, 1.0, float(length), known, declared):
            report(problem, ("roads", "changes"))
        if not (change.road_type or change.markings):
            report("changes must say road_type or markings", ("roads", "changes"))
    usual: RoadType = "motorway" if template == "merge" else "town"
    return RoadsSpec(
        template,
        knobs,
        legs,
        segments,
        given.crosswalk_at,
        given.signals,
        given.road_type or usual,
        change=change,
    )


def _legs(template: Template, given: RoadsSection, report: Say) -> dict[str, LegSpec]:
    """Return the legs of a junction: the usual ones, or those with a given heading."""
    headings = dict(HEADINGS[template])
    if any(leg.heading is not None for leg in given.legs.values()):
        headings = {
            name: leg.heading if leg.heading is not None else headings.get(name, math.nan)
            for name, leg in given.legs.items()
        }
    for name in given.legs:
        if not headings and not HEADINGS[template]:
            report(f"template {template} has no legs to describe", ("roads", "legs"))
            return {}
        if name not in headings or len(name) != 1 or name not in LETTERS:
            report(
                f"a leg is one of {', '.join(headings)}, got '{name}'{nearest(name, headings)}",
                ("roads", "legs", name),
            )
        elif math.isnan(headings[name]):
            report(f"leg {name} must have a heading [deg]", ("roads", "legs", name))
    legs = {
        name: _leg(name, heading, given.legs.get(name, LegSection()), given, report)
        for name, heading in sorted(headings.items())
        if math.isfinite(heading)
    }
    for problem in _angles(template, legs):
        report(problem, ("roads", "legs"))
    return legs


def _leg(
    name: str, heading: float, leg_section: LegSection, given: RoadsSection, report: Say
) -> LegSpec:
    path: Path = ("roads", "legs", name)
    lanes_in = None if leg_section.lanes_in is None else int(leg_section.lanes_in)
    if leg_section.turns and lanes_in != len(leg_section.turns):
        report(
            f"turns of leg {name} must be one list per lane in (lanes_in), innermost first", path
        )
    if any(not turns for turns in leg_section.turns):
        report(f"each lane in of leg {name} must lead somewhere, got an empty list in turns", path)
    return LegSpec(
        heading,
        lanes_in,
        None if leg_section.lanes_out is None else int(leg_section.lanes_out),
        tuple(tuple(turns) for turns in leg_section.turns),
        leg_section.sign,
        given.crosswalks if leg_section.crosswalk is None else leg_section.crosswalk,
    )


def _angles(template: Template, legs: Mapping[str, LegSpec]) -> Iterator[str]:
    if template not in _FEWEST:
        return
    if not _FEWEST[template] <= len(legs) <= _MOST[template]:
        yield (
            f"template {template} has {_FEWEST[template]} to {_MOST[template]} legs, "
            f"got {len(legs)}"
        )
        return
    around = sorted((leg.heading % 360.0, name) for name, leg in legs.items())
    around.append((around[0][0] + 360.0, around[0][1]))
    for (value, name), (other, following) in pairwise(around):
        if other - value < LEAST_ANGLE - 1e-9:
            yield (
                f"legs must be {LEAST_ANGLE:g}° apart at least, {name} and {following} are "
                f"{other - value:g}°"
            )


def _measure(
    key: str,
    value: float | str,
    low: float,
    high: float,
    known: Mapping[str, Parameter | Derived],
    declared: Set[str],
) -> Iterator[str]:
    unit = "m" if key in ("length", "at") else "1/m"
    if not isinstance(value, str):
        if not low <= value <= high:
            yield f"{key} [{unit}] must be {low:.4g} to {high:.4g}, got {value:g}"
        return
    parameter = known.get(value)
    if parameter is None:
        if value not in declared:
            yield f"{key} names the unknown parameter '{value}'{nearest(value, known)}"
    elif isinstance(parameter, Derived) or parameter.axis != "static":
        yield f"{key} must be a number or a parameter of the static axis, got '{value}'"
    elif parameter.unit != unit or parameter.low < low or parameter.high > high:
        yield (
            f"{key} needs a parameter in {unit} within {low:.4g} to {high:.4g}, '{value}' is in "
            f"{parameter.unit}, {parameter.low:g} to {parameter.high:g}"
        )
