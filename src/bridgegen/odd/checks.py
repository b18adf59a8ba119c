"""What a logical scenario must have as a whole: what it needs, nothing idle, all of it feasible."""

from collections.abc import Iterable, Mapping, Set
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from bridgegen.arrays import Float
from bridgegen.errors import ScenarioError
from bridgegen.odd.parameters import Axis, Bound, Derived, Parameter, at, nearest, slack
from bridgegen.odd.space import SearchSpace, probes

if TYPE_CHECKING:
    from bridgegen.odd.scenario import LogicalScenario, Waypoint

# What the road network and the weather are built from: every scenario has these, in these units.
NEEDED = {
    Axis.STATIC: {
        "lane_width": "m",
        "lanes_per_direction": "count",
        "arm_length": "m",
        "intersection_size": "m",
    },
    Axis.WEATHER: {
        "precipitation": "%",
        "precipitation_deposits": "%",
        "cloudiness": "%",
        "wind_intensity": "%",
        "fog_density": "%",
        "fog_distance": "m",
        "fog_falloff": "1",
        "sun_altitude_angle": "deg",
        "sun_azimuth_angle": "deg",
        "wetness": "%",
        "friction": "1",
    },
}
INCLUDED_BY = {Axis.STATIC: "crossroads", Axis.WEATHER: "weather"}

# Between the reference points of two that start in one lane [m]: a car's length and a bit.
_CLEARANCE = 5.0


def use_problems(
    declared: Mapping[str, Parameter | Derived],
    bounds: Iterable[Bound],
    names: Set[str],
    used: Set[str],
    place: str,
) -> list[str]:
    """Return which parameters are needed and not declared, or declared and of no effect.

    Args:
        declared: parameters and derived quantities, by name.
        bounds: what limits them.
        names: of all that is declared, also wrongly.
        used: names that participants and events refer to.
        place: the scenario's file.
    """
    problems = []
    for axis, units in NEEDED.items():
        missing = [f"{name} [{unit}]" for name, unit in units.items() if name not in names]
        if missing:
            problems.append(
                f"a scenario needs {', '.join(missing)} on the axis {axis}; "
                f"include '{INCLUDED_BY[axis]}' declares all that it needs there ({place})"
            )
        for name, unit in units.items():
            found = declared.get(name)
            if found is None:
                continue
            if (found.axis, found.unit) != (axis, unit):
                problems.append(
                    f"{name} belongs to the axis {axis} in {unit}, "
                    f"got {found.axis} in {found.unit}{at(found.place)}"
                )
            elif isinstance(found, Parameter) and (found.kind == "integer") != (unit == "count"):
                kind = "integer" if unit == "count" else "float"
                problems.append(f"{name} [{unit}] must be of kind {kind}{at(found.place)}")
    needed = {name for units in NEEDED.values() for name in units}
    rules: list[Bound | Derived] = [*bounds]
    rules += (one for one in declared.values() if isinstance(one, Derived))
    read = set(used).union(*(rule.names for rule in rules))
    for name, one in declared.items():
        if name not in needed | read and one.axis is not Axis.EXTENSION:
            problems.append(
                f"nothing in {place} uses {name} [{one.unit}] of the axis {one.axis}"
                f"{nearest(name, needed - declared.keys())}{at(one.place)}"
            )
    return problems


def try_out(scenario: "LogicalScenario") -> None:
    """Refuse what only shows in values: at the defaults, and all over the space.

    Raises:
        ScenarioError: constraints that leave no value, defaults that break them, positions past
            the end of a leg or inside each other, nothing to search.
    """
    whole = SearchSpace(scenario, Axis)
    if scenario.space().n_var == 0:
        raise ScenarioError(
            f"the axes {', '.join(scenario.axes)} hold nothing to search ({scenario.place})"
        )
    defaults = {one.name: one.default for one in scenario.parameters.values()}
    try:
        whole.row(defaults)
    except ScenarioError as error:
        where = f"at the defaults ({scenario.place})"
        raise ScenarioError(*(f"{problem}, {where}" for problem in error.problems)) from None
    X = whole.decode(probes(whole.n_var))
    columns = {name: X[:, whole.index(name)] for name in whole.names}
    problems = []
    for one in scenario.participants:
        for end in (one.start, one.end):
            beyond = _metres(end, columns) - columns["arm_length"]
            if beyond.max() > slack(0.0):
                problems.append(
                    f"{one.name} must stay on the leg of {end.point}: distance <= arm_length [m], "
                    f"'{end.distance}' can lie {beyond.max():.3g} m beyond ({scenario.place})"
                )
    for one, other in combinations(scenario.participants, 2):
        gap = np.abs(_metres(one.start, columns) - _metres(other.start, columns))
        if one.start.point == other.start.point and gap.min() < _CLEARANCE:
            problems.append(
                f"{one.name} and {other.name} start {gap.min():.3g} m apart at {one.start.point}, "
                f"at least {_CLEARANCE} m is needed ({scenario.place})"
            )
    if problems:
        raise ScenarioError(*problems)


def _metres(end: "Waypoint", columns: dict[str, Float]) -> Float:
    return columns[end.distance] if isinstance(end.distance, str) else np.array([end.distance])
