"""What a logical scenario must have as a whole: what it needs, nothing idle, all of it feasible."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from contextlib import suppress
from dataclasses import replace
from itertools import combinations

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.base.errors import ScenarioError
from bridgegen.base.units import has_unit, in_unit
from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.language.kinds import slack
from bridgegen.scenario.language.parameters import Axis, Bound, Derived, Parameter, at, nearest
from bridgegen.scenario.language.plain_yaml import Document
from bridgegen.scenario.language.roads import Quantity
from bridgegen.scenario.language.rules import cap, speeds_of
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.language.space import probes
from bridgegen.scenario.language.story import Participant
from bridgegen.scenario.participants import Body
from bridgegen.scenario.weather import PARAMETERS

MAX_STEPS = 100_000

NEEDED = {
    parameter.name: parameter.unit for parameter in PARAMETERS.values() if parameter.is_declared
} | {"speed_factor": "1"}
"""Units of the weather's parameters and of its effect on speeds, by name: every scenario has
these."""

_CLEARANCE = 0.4
"""Least distance between the boxes of two that start in one lane [m]."""

_ASIDE = 0.25
"""Least distance between the sides of two that start beside each other in one lane [m]."""


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
    missing = [f"{name} [{unit}]" for name, unit in NEEDED.items() if name not in names]
    if missing:
        problems.append(
            f"a scenario needs {', '.join(missing)} on the axis weather; "
            f"include 'weather' declares all that it needs there ({place})"
        )
    for name, unit in NEEDED.items():
        found = declared.get(name)
        if found is not None and (found.axis, found.unit) != (Axis.WEATHER, unit):
            problems.append(
                f"{name} belongs to the axis weather in {unit}, "
                f"got {found.axis} in {found.unit}{at(found.place)}"
            )
        elif isinstance(found, Parameter) and found.kind.apart:
            problems.append(f"{name} [{unit}] must be of kind float{at(found.place)}")
    needed = set(NEEDED)
    rules: list[Bound | Derived] = [*bounds]
    rules += (parameter for parameter in declared.values() if isinstance(parameter, Derived))
    read = set(used).union(*(rule.names for rule in rules))
    for name, parameter in declared.items():
        if name not in needed | read and parameter.axis is not Axis.EXTENSION:
            problems.append(
                f"nothing in {place} uses {name} [{parameter.unit}] of the axis {parameter.axis}"
                f"{nearest(name, needed - declared.keys())}{at(parameter.place)}"
            )
    return problems


def time_problems(document: Document) -> list[str]:
    """Return what is wrong with a file's duration and time step."""
    data = document.data if isinstance(document.data, dict) else {}
    duration, step = (_in_seconds(data.get(key)) for key in ("duration", "time_step"))
    if not isinstance(duration, int | float) or not isinstance(step, int | float):
        return []  # reported with the shape already
    for key, value in (("duration", duration), ("time_step", step)):
        if not 0.0 < value < math.inf:
            where = document.at((key,))
            return [f"{key} [s] must be greater than 0 and finite, got {value} ({where})"]
    steps = duration / step
    # With a tolerance: 0.3 s / 0.1 s is 2.9999999999999996 in binary fractions.
    if 1 <= steps <= MAX_STEPS and abs(steps - round(steps)) <= 1e-6 * steps:
        return []
    return [
        f"duration must be a whole number of time steps, 1 to {MAX_STEPS}, got {duration} s / "
        f"{step} s = {steps:.6g} ({document.at(('duration',))})"
    ]


def _in_seconds(value: object) -> object:
    """Return a time that is written with a unit in seconds; others as they are."""
    if isinstance(value, str) and has_unit(value):
        with suppress(ValueError):
            return in_unit(value, "s")
    return value


def try_out(scenario: LogicalScenario) -> None:
    """Refuse what only shows in values: at the defaults, and all over the space.

    Raises:
        ScenarioError: constraints that leave no value, defaults that break them, positions past
            the end of a leg or inside each other, nothing to search.
    """
    whole = scenario.space(Axis)
    if scenario.space().n_var == 0:
        raise ScenarioError(
            f"the axes {', '.join(scenario.axes)} hold nothing to search ({scenario.place})"
        )
    defaults = {parameter.name: parameter.default for parameter in scenario.parameters.values()}
    try:
        whole.row(defaults)
    except ScenarioError as error:
        where = f"at the defaults ({scenario.place})"
        raise ScenarioError(*(f"{problem}, {where}" for problem in error.problems)) from None
    X = whole.decode(probes(whole.n_var))
    columns = {name: X[:, whole.index(name)] for name in whole.names}
    problems = [
        problem
        for participants, rows in _placed(scenario, columns)
        for problem in _places(scenario, participants, rows)
    ]
    problems += _fast(scenario, columns)
    if problems:
        raise ScenarioError(*dict.fromkeys(problems))


def _placed(
    scenario: LogicalScenario, columns: Mapping[str, Float]
) -> Iterator[tuple[tuple[Participant, ...], Mapping[str, Float]]]:
    """Yield the participants at the places that categories choose, and the rows of that choice."""
    names = list(
        dict.fromkeys(
            participant.place_by for participant in scenario.participants if participant.place_by
        )
    )
    if not names:
        yield scenario.participants, columns
        return
    chosen = np.stack([columns[name] for name in names], axis=1)
    for key in np.unique(chosen, axis=0):
        at = dict(zip(names, key.astype(int).tolist(), strict=True))
        rows = np.flatnonzero((chosen == key).all(axis=1))
        yield (
            tuple(
                participant.at_each_place[at[participant.place_by]]
                if participant.place_by
                else participant
                for participant in scenario.participants
            ),
            {name: column[rows] for name, column in columns.items()},
        )


def _places(
    scenario: LogicalScenario,
    participants: Sequence[Participant],
    columns: Mapping[str, Float],
) -> Iterator[str]:
    """Yield participants that may leave a leg's end, or start inside another."""
    for participant in participants:
        ends = [(participant.start, 0.0), *((point, 0.0) for point in participant.path[1:])]
        for end, least in [*ends, *([(participant.end, 0.0)] if participant.end else [])]:
            length = scenario.roads.length(end.leg)
            at_ = _metres(end.distance, columns)
            if at_.min() < least - slack(0.0):
                yield (
                    f"{participant.name} must stay on leg {end.leg}: distance >= 0 [m], "
                    f"'{end.distance}' can be {at_.min():.3g} m ({scenario.place})"
                )
            if length is None:
                beyond = at_ - _segments_length(scenario, columns)
            else:
                beyond = at_ - _metres(length, columns)
            if beyond.max() > slack(0.0):
                limit = length if isinstance(length, str) else "its length"
                yield (
                    f"{participant.name} must stay on leg {end.leg}: distance <= {limit} [m], "
                    f"'{end.distance}' can lie {beyond.max():.3g} m beyond ({scenario.place})"
                )
    for participant in participants:
        if participant.end is None or (participant.start.leg, participant.start.way) != (
            participant.end.leg,
            participant.end.way,
        ):
            continue
        behind = _metres(participant.start.distance, columns) - _metres(
            participant.end.distance, columns
        )
        behind = behind if participant.start.way == "out" else -behind
        if behind.max() >= 0.0:
            yield (
                f"the route of {participant.name} must lead on along its lane: its end can lie "
                f"{behind.max():.3g} m behind its start, and vehicles follow their lane's "
                f"direction (one that drives against it has heading 180 and no end) "
                f"({scenario.place})"
            )
    on_lanes = [participant for participant in participants if not participant.path]
    for combination, other in combinations(on_lanes, 2):
        a, b = combination.start, other.start
        if (a.leg, a.way, a.lane) != (b.leg, b.way, b.lane):
            continue
        body, others = (_room(each, columns) for each in (combination, other))
        ahead = _metres(a.distance, columns) - _metres(b.distance, columns)
        # Distances count from the junction: on the way in, the larger one is farther behind.
        ahead = ahead if a.way == "out" else -ahead
        aside = np.abs(_metres(a.offset, columns) - _metres(b.offset, columns))
        needed = _CLEARANCE + np.where(
            ahead >= 0.0, body.rear + others.front, body.front + others.rear
        )
        in_the_way = aside < 0.5 * (body.width + others.width) + _ASIDE
        gap, needed, in_the_way = np.broadcast_arrays(np.abs(ahead), needed, in_the_way)
        lacking = np.where(in_the_way, needed - gap, -math.inf)
        worst = int(lacking.argmax())
        if lacking[worst] > slack(0.0):
            yield (
                f"{combination.name} and {other.name} start {gap[worst]:.3g} m apart on {a}, "
                f"at least {needed[worst]:g} m is needed ({scenario.place})"
            )


def _hull(bodies: tuple[Body, ...]) -> Body:
    """Return a body that takes as much room as each of some about the reference point."""
    front, rear = (max(getattr(body, end) for body in bodies) for end in ("front", "rear"))
    width = max(body.width for body in bodies)
    ahead = 0.5 * (front - rear)
    return replace(bodies[0], length=front + rear, width=width, center_ahead=ahead)


def _room(participant: Participant, columns: Mapping[str, Float]) -> Body:
    """Return the body of a participant; of one that is turned, what holds it however it is."""
    body = _hull(participant.bodies)
    heading = _metres(participant.heading, columns)
    if not heading.any():
        return body
    if (np.abs(heading) == 180.0).all():
        return replace(body, center_ahead=-body.center_ahead)
    far = elementary.hypot(max(body.front, body.rear), 0.5 * body.width)
    return replace(body, length=2.0 * far, width=2.0 * far, center_ahead=0.0)


def _fast(scenario: LogicalScenario, columns: Mapping[str, Float]) -> Iterator[str]:
    """Yield who may be faster than road, weather or legs allow; parameters have their bounds."""
    prefixes = sorted(
        name.removesuffix("speed_factor") for name in columns if name.endswith("speed_factor")
    )
    limit = parse(cap(scenario.roads.knobs["speed_limit"], prefixes)).evaluate(columns)
    for participant in scenario.participants:
        for value in speeds_of(participant, scenario.story):
            speed = _metres(value, columns)
            allowed = np.asarray(min(body.max_speed for body in participant.bodies))
            why = f"a {' or '.join(participant.types) or participant.type} can do"
            if participant.conduct == "vehicle" and value != 0.0 and not participant.exceeds_limit:
                if np.min(limit) <= allowed:
                    why = "road and weather allow"
                allowed = np.minimum(limit, allowed)
            over = speed - allowed
            if over.max() > slack(float(np.max(allowed))):
                yield (
                    f"{participant.name} must be no faster than {why}, the speed {value} [m/s] "
                    "exceeds "
                    f"that by up to {over.max():.3g} m/s ({scenario.place})"
                )


def _segments_length(scenario: LogicalScenario, columns: Mapping[str, Float]) -> Float:
    parts = [_metres(segment.length, columns) for segment in scenario.roads.segments]
    return np.asarray(sum(parts[1:], parts[0]))


def _metres(value: Quantity, columns: Mapping[str, Float]) -> Float:
    return columns[value] if isinstance(value, str) else np.array([value])
