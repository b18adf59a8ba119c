"""Ranges of parameters that hold what was seen, and leave room for a scenario's constraints."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import betaincinv

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError
from bridgegen.base.units import percent
from bridgegen.scenario.language.constraints import order, problems_of
from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.language.kinds import FLOAT, slack
from bridgegen.scenario.language.parameters import Bound, Derived, Parameter
from bridgegen.scenario.language.rules import cap, speeds_of
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.language.space import probes

LEAST_SEEN = 5
"""Least number of events of ranges without a distribution: they hold a third of the encounters."""
DIGITS = 2
"""Digits of the ends of ranges: a hundredth of the width's power of ten."""
_ROUNDS = 8
_FACTOR = "speed_factor"
_SEEN = "No event has a {name} beyond it."
_ROAD = "speed_limit of the road, speed_factor of the weather."
_LIMIT = "Nobody drives faster than the road allows, less in rain, in fog and by night."
_STEEPNESS = (0.0, 1.0, 2.0)


@dataclass(frozen=True)
class Range:
    """A range of a parameter.

    Attributes:
        low: its lower end.
        high: its upper end.
    """

    low: float
    high: float


def held_in_words(count: int) -> str:
    """Return how many encounters the range of so many events holds, 2 or more.

    The share between the least and the greatest of n independent values of one distribution is
    distributed as Beta(n - 1, 2), whatever that distribution is.

    Source: Wilks, Determination of sample sizes for setting tolerance limits, Annals of
    Mathematical Statistics 12 (1941) 91-96.
    """
    share = float(betaincinv(count - 1.0, 2.0, 0.05))
    return (
        f"{count:,} events: the range of a parameter, by itself, holds at least {percent(share)} "
        "of such encounters with 95 % confidence (Wilks 1941, independent events)"
    )


def seen_range(values: Float) -> Range:
    """Return the range of values, its ends rounded outwards."""
    return around(float(values.min()), float(values.max()))


def around(low: float, high: float) -> Range:
    """Return a range with ends rounded outwards, to a hundredth of its width's power of ten."""
    width = high - low
    if width <= 0.0:
        return Range(low, high)
    places = DIGITS - math.floor(math.log10(width))
    step = 10.0**-places
    return Range(
        round(math.floor(low / step + 1e-9) * step, max(places, 0)),
        round(math.ceil(high / step - 1e-9) * step, max(places, 0)),
    )


def fitted_names(scenario: LogicalScenario, rows: Mapping[str, Float]) -> tuple[str, ...]:
    """Return the parameters that events give, that are searched, and that took several values."""
    numbers = [
        name
        for name in scenario.space().variables
        if scenario.parameters[name].kind.name == FLOAT.name
    ]
    return tuple(name for name, values in rows.items() if name in numbers and np.ptp(values) > 0.0)


def typical(rows: Mapping[str, Float], names: Sequence[str], good: Bool) -> int:
    """Return the row that is nearest to the medians, in shares of the ranges.

    Args:
        rows: ``(N,)`` by parameter.
        names: the parameters that count.
        good: ``(N,)`` the rows to choose from, one at least.
    """
    away = np.zeros(len(good))
    for name in names:
        values = rows[name]
        median = float(np.median(values[good]))
        away += ((values - median) / float(np.ptp(values[good]) or 1.0)) ** 2
    return int(np.argmin(np.where(good, away, np.inf)))


def bounds_of_speeds(
    scenario: LogicalScenario, rows: Mapping[str, Float], names: Sequence[str], source: str
) -> list[Bound]:
    """Return bounds that keep the derived speeds of participants within what was seen of them.

    Ranges do not: of an ego that is slow and a vehicle that is much slower than its ego, no event
    has both. Speeds are bound that follow from two or more of the parameters, and from nothing
    else, and are linear in one of them. Where events are beyond the scenario's own ranges, which
    kept the road's limit, the speeds keep that, too.

    Args:
        scenario: whose derived speeds.
        rows: ``(N,)`` by parameter.
        names: the parameters whose ranges are what was seen.
        source: of the bounds, for the file.
    """
    speeds = {
        value
        for participant in scenario.participants
        if not participant.exceeds_limit
        for value in speeds_of(participant, scenario.story)
    }
    factors = [
        derived.name.removesuffix(_FACTOR)
        for derived in scenario.derived
        if derived.name.endswith(_FACTOR)
    ]
    limit = cap(scenario.roads.knobs["speed_limit"], sorted(factors))
    made: list[Bound] = []
    for derived in scenario.derived:
        if derived.name not in speeds or len(derived.names) < 2 or not derived.names <= set(names):
            continue
        seen = seen_range(np.asarray(derived.value.evaluate(rows)))
        beyond = any(_is_beyond(scenario.parameters[name], rows[name]) for name in derived.names)
        for target in sorted(derived.names, key=list(names).index, reverse=True):
            k = _slope(derived, target, rows)
            if k is None:
                continue
            bounds = [
                _solved(
                    derived,
                    target,
                    k,
                    f"{seen.low:g}",
                    f"{seen.high:g}",
                    _SEEN.format(name=derived.name),
                    source,
                )
            ]
            if beyond:
                bounds.append(_solved(derived, target, k, None, limit, _LIMIT, _ROAD))
            parameters, others = scenario.parameters.values(), [*scenario.bounds, *made]
            if not problems_of(parameters, [*others, *bounds], scenario.derived):
                made += bounds
                break
    return made


def _is_beyond(parameter: Parameter, values: Float) -> bool:
    return bool(values.min() < parameter.low or values.max() > parameter.high)


def _slope(derived: Derived, target: str, rows: Mapping[str, Float]) -> float | None:
    """Return by how much a quantity grows with a parameter; None if that is no constant."""
    at = [
        np.asarray(derived.value.evaluate({**rows, target: np.full_like(rows[target], value)}))
        for value in _STEEPNESS
    ]
    slope = at[1] - at[0]
    steady = np.abs(slope - slope[0]) <= slack(np.abs(at[0]))
    linear = np.abs(at[2] - at[1] - slope) <= slack(np.abs(at[0]))
    k = float(np.round(slope[0], 9))
    return k if k != 0.0 and (steady & linear).all() else None


def _solved(
    derived: Derived, target: str, k: float, low: str | None, high: str, why: str, source: str
) -> Bound:
    """Return the bound on a parameter that keeps a quantity, k times it and a rest, in a range."""
    rest = re.sub(rf"\b{re.escape(target)}\b", "0", derived.value.source)
    rest = rest.removesuffix(" - 0").removesuffix(" + 0")
    rest = rest if rest.isidentifier() else f"({rest})"
    ends = (low, high) if k > 0.0 else (high, low)
    lo, hi = (None if end is None else parse(_end(rest, k, end)) for end in ends)
    return Bound(target, lo, hi, why, source)


def _end(rest: str, k: float, value: str) -> str:
    """Return the formula of x with rest + k * x = value."""
    if k == -1.0:
        return f"{rest} + {value[1:]}" if value.startswith("-") else f"{rest} - {value}"
    return f"{value} - {rest}" if k == 1.0 else f"({value} - {rest}) / {k!r}"


def with_room(
    parameters: Mapping[str, Parameter],
    bounds: Sequence[Bound],
    derived: Sequence[Derived],
    variables: Sequence[str],
) -> dict[str, Parameter]:
    """Return parameters whose ranges leave a value wherever others are in theirs.

    Where a constraint asks for more than the range has, or for less, the range is extended to it.

    Args:
        parameters: all of a scenario.
        bounds: what limits them.
        derived: what follows from them.
        variables: the parameters that are searched.

    Raises:
        InputError: constraints of one parameter contradict each other.
    """
    made = dict(parameters)
    steps = order((*made, *(item.name for item in derived)), bounds, derived)
    formulas = {item.name: item.value for item in derived}
    shares = dict(zip(variables, probes(len(variables)).T, strict=True))
    for _ in range(_ROUNDS):
        table: dict[str, Float | float] = {}
        before = dict(made)
        for name in steps:
            if name in formulas:
                table[name] = formulas[name].evaluate(table)
                continue
            lo, hi = _left(made[name], [b for b in bounds if b.target == name], table)
            if name in variables:
                made[name] = parameter = _extended(made[name], lo, hi)
                lo, hi = (
                    np.clip(lo, parameter.low, parameter.high),
                    np.clip(hi, parameter.low, parameter.high),
                )
                table[name] = parameter.at(shares[name], lo, np.maximum(lo, hi))
            else:
                table[name] = np.clip(made[name].default, lo, np.maximum(lo, hi))
        if made == before:
            return made
    raise InputError("constraints leave some parameter no value within any range")


def _left(
    parameter: Parameter, bounds: Sequence[Bound], table: Mapping[str, Float | float]
) -> tuple[Float, Float]:
    """Return what bounds leave to a parameter; where they ask for no range, its own ends."""
    lo, hi = np.asarray(parameter.low), np.asarray(parameter.high)
    for bound in bounds:
        if bound.lo is not None:
            lo = np.asarray(np.fmax(lo, bound.lo.evaluate(table)))
        if bound.hi is not None:
            hi = np.asarray(np.fmin(hi, bound.hi.evaluate(table)))
    return lo, hi


def _extended(parameter: Parameter, lo: Float, hi: Float) -> Parameter:
    low, high = min(parameter.low, float(hi.min())), max(parameter.high, float(lo.max()))
    if (low, high) == (parameter.low, parameter.high):
        return parameter
    wide = around(low, high)
    return replace(
        parameter,
        low=parameter.low if low == parameter.low else wide.low,
        high=parameter.high if high == parameter.high else wide.high,
    )
