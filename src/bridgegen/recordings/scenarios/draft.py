"""The file of a mined scenario, but for its exposure: ranges, defaults, constraints, words.

Ranges are those of the events that keep the source scenario's constraints, from the least to the
greatest value, also where the source's own ranges are narrower. A range is extended where a
constraint would leave no value otherwise, and cut to the source's where the scenario cannot hold
more (a road's end, bodies inside each other). All that is in the file's words.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import yaml

from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.recordings.events.of_scenarios import Sought
from bridgegen.recordings.scenarios.ranges import (
    LEAST_SEEN,
    Range,
    bounds_of_speeds,
    seen_range,
    typical,
    with_room,
)
from bridgegen.scenario.language.kinds import FLOAT
from bridgegen.scenario.language.parameters import Bound
from bridgegen.scenario.language.plain_yaml import read_plain_yaml
from bridgegen.scenario.language.reader import build
from bridgegen.scenario.language.scenario import LogicalScenario

EVENTS_SOURCE = "The recorded events."
"""Source that constraints state which are tightened to the events."""
_DIGITS = 5
"""Number of significant digits of defaults."""


@dataclass(frozen=True)
class MinedRange:
    """The range that a mined scenario has of a parameter.

    Attributes:
        parameter: its name.
        unit: its unit.
        declared: by the source scenario.
        seen: of the events that keep the constraints.
        mined: of the mined scenario.
        remark: why it is not what was seen, or what it goes beyond; may be empty.
    """

    parameter: str
    unit: str
    declared: Range
    seen: Range
    mined: Range
    remark: str


@dataclass(frozen=True)
class Draft:
    """A scenario that was made of events, but for its exposure.

    Attributes:
        data: of its file.
        scenario: it.
        ranges: of its parameters.
        tightened: constraints that were added.
    """

    data: dict[str, Any]
    scenario: LogicalScenario
    ranges: tuple[MinedRange, ...]
    tightened: tuple[Bound, ...]


def draft(sought: Sought, rows: Mapping[str, Float], names: Sequence[str], about: str) -> Draft:
    """Return the scenario without its exposure, with the widest ranges that it can hold.

    Args:
        sought: the source scenario.
        rows: ``(N,)`` by parameter, of events that keep its constraints.
        names: the parameters whose ranges become what was seen.
        about: where the events come from.

    Raises:
        InputError: it cannot hold those of the source within what was seen either.
    """
    cut: list[tuple[str, str]] = []
    while True:
        try:
            return _attempt(sought, rows, names, about, cut)
        except InputError as error:
            left = [
                (name, end)
                for name in names
                for end in ("low", "high")
                if (name, end) not in cut and _is_wider(sought.scenario, name, end, rows)
            ]
            if not left:
                raise
            named = [pair for pair in left if any(pair[0] in text for text in error.problems)]
            for pair in named or left:
                with suppress(InputError):
                    return _attempt(sought, rows, names, about, [*cut, pair])
            cut.append((named or left)[0])


def _is_wider(scenario: LogicalScenario, name: str, end: str, rows: Mapping[str, Float]) -> bool:
    parameter, seen = scenario.parameters[name], seen_range(rows[name])
    return seen.low < parameter.low if end == "low" else seen.high > parameter.high


def _attempt(
    sought: Sought,
    rows: Mapping[str, Float],
    names: Sequence[str],
    about: str,
    cut: Sequence[tuple[str, str]],
) -> Draft:
    scenario, own = sought.scenario, _own_parameters(sought)
    wanted: dict[str, Range] = {}
    for name in names:
        parameter, seen = scenario.parameters[name], seen_range(rows[name])
        if name not in own:
            seen = Range(max(seen.low, parameter.low), min(seen.high, parameter.high))
        wanted[name] = Range(
            max(seen.low, parameter.low) if (name, "low") in cut else seen.low,
            min(seen.high, parameter.high) if (name, "high") in cut else seen.high,
        )
        if not wanted[name].low < wanted[name].high:
            raise InputError(f"no value of {name} is both in its range and seen")
    inside = np.all(
        [
            (range_.low <= rows[name]) & (rows[name] <= range_.high)
            for name, range_ in wanted.items()
        ],
        axis=0,
    )
    if inside.sum() < LEAST_SEEN:
        raise InputError(
            f"{inside.sum()} events are in ranges that it can hold; {LEAST_SEEN} are needed"
        )
    usual = {
        name: float(f"{values[typical(rows, names, inside)]:.{_DIGITS}g}")
        for name, values in rows.items()
    }
    kept = {name: values[inside] for name, values in rows.items()}
    tightened = bounds_of_speeds(scenario, kept, names, EVENTS_SOURCE)
    parameters = {
        name: replace(
            item,
            low=wanted[name].low,
            high=wanted[name].high,
            default=float(np.clip(usual[name], wanted[name].low, wanted[name].high)),
        )
        if name in wanted
        else item
        for name, item in scenario.parameters.items()
    }
    parameters = with_room(
        parameters, [*scenario.bounds, *tightened], scenario.derived, scenario.space().variables
    )
    ranges = tuple(
        _ranged(
            name, scenario, rows, Range(parameters[name].low, parameters[name].high), name in own
        )
        for name in names
    )
    data = _data(sought, parameters, ranges, usual, tightened, about)
    return Draft(data, _built(data, scenario), ranges, tuple(tightened))


def _ranged(
    name: str, scenario: LogicalScenario, rows: Mapping[str, Float], mined: Range, is_own: bool
) -> MinedRange:
    parameter, seen = scenario.parameters[name], seen_range(rows[name])
    remarks = []
    if mined.low < seen.low or mined.high > seen.high:
        remarks.append(
            "extended, because a constraint asks for it where other parameters are at "
            "the ends of their ranges"
        )
    if mined.low > seen.low or mined.high < seen.high:
        remarks.append(
            "cut to the source's, because the scenario cannot hold more"
            if is_own
            else "cut to that of the fragment that declares it"
        )
    if mined.low < parameter.low or mined.high > parameter.high:
        remarks.append(f"beyond the source's {parameter.low:g} to {parameter.high:g}")
    return MinedRange(
        name, parameter.unit, Range(parameter.low, parameter.high), seen, mined, "; ".join(remarks)
    )


def _data(
    sought: Sought,
    parameters: Mapping[str, Any],
    ranges: Sequence[MinedRange],
    usual: Mapping[str, float],
    tightened: Sequence[Bound],
    about: str,
) -> dict[str, Any]:
    """Return the file's data, without the exposure."""
    data = _stripped(sought.document.data)
    assert isinstance(data, dict)
    source = sought.scenario
    data["scenario"] = mined_name(source)
    data["title"] = f"{source.title}, as recorded"
    data["source"] = (
        f"{about} The roads, the behaviour and the constraints are those of {source.name}: "
        f"{source.source.strip()}"
    )
    for key in ("matrix", "exposure"):
        data.pop(key, None)
    defaults = dict(data.get("defaults", {}))
    own = _own_parameters(sought)
    changed = {range_.parameter: range_ for range_ in ranges}
    for name, value in usual.items():
        parameter = parameters[name]
        if name in own and name in changed:
            seen = changed[name]
            remark = f" ({seen.remark})" if seen.remark else ""
            data["parameters"][name] |= {
                "low": parameter.low,
                "high": parameter.high,
                "default": parameter.default,
                "source": f"Seen: {seen.seen.low:g} to {seen.seen.high:g}{remark}.",
            }
        elif parameter.kind.name == FLOAT.name and parameter.low <= value <= parameter.high:
            (
                data["parameters"][name].__setitem__("default", value)
                if name in own
                else defaults.__setitem__(name, value)
            )
    if defaults:
        data["defaults"] = defaults
    if tightened:
        data["bounds"] = [
            *data.get("bounds", []),
            *(
                {
                    "target": bound.target,
                    **{
                        key: str(end)
                        for key, end in (("lo", bound.lo), ("hi", bound.hi))
                        if end is not None
                    },
                    "why": bound.why,
                    "source": bound.source,
                }
                for bound in tightened
            ),
        ]
    return data


def _stripped(data: Any) -> Any:
    """Return data with texts that have no line end at theirs, as blocks of text have."""
    if isinstance(data, dict):
        return {key: _stripped(value) for key, value in data.items()}
    if isinstance(data, list):
        return [_stripped(value) for value in data]
    return data.strip() if isinstance(data, str) else data


def _built(data: Mapping[str, Any], source: LogicalScenario) -> LogicalScenario:
    return build(read_plain_yaml(dumped(data).encode(), f"{mined_name(source)}.yaml"), None)


def dumped(data: Mapping[str, Any]) -> str:
    """Return data as YAML."""
    return str(
        yaml.safe_dump(
            dict(data), sort_keys=False, allow_unicode=True, width=100, default_flow_style=None
        )
    )


def _own_parameters(sought: Sought) -> frozenset[str]:
    """Return the parameters that the file declares itself, rather than a fragment."""
    data = sought.document.data
    return frozenset(data.get("parameters", {})) if isinstance(data, dict) else frozenset()


def mined_name(source: LogicalScenario) -> str:
    """Return the name of the scenario that is mined of a scenario's events, and of its files."""
    return f"{source.name}-mined"


def files_of(sought: Sought) -> str:
    """Return a file beside the scenario's that it needs; "" if none."""
    data = sought.document.data
    assert isinstance(data, dict)
    included = [name.partition(" as ")[0] for name in data.get("include", [])]
    functions = [item["function"].partition(":")[0] for item in data.get("effects", [])]
    files = [name for name in (*included, *functions) if name.endswith((".yaml", ".yml", ".py"))]
    return files[0] if files else ""
