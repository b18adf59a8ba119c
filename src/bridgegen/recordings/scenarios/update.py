"""New ranges for a user's scenario, as a difference that its owner may apply.

Ranges are widened to hold the events that keep the scenario's constraints. They are not narrowed:
that something was not seen is no reason to leave it out.
"""

import difflib
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.disk import write_whole
from bridgegen.base.errors import FileFormatError, InputError, StorageError
from bridgegen.base.units import has_unit, in_unit
from bridgegen.recordings.events.of_scenarios import ScenarioEvents, Sought, broken_by
from bridgegen.recordings.events.tables import broken_in_words
from bridgegen.recordings.scenarios.ranges import Range, around, held_in_words
from bridgegen.scenario.exposure.fit import LEAST_ROWS
from bridgegen.scenario.language.parameters import Parameter
from bridgegen.scenario.language.plain_yaml import read_plain_yaml, replaced
from bridgegen.scenario.language.reader import build

ENDING = ".diff"
_ENDS = ("low", "high")
_LINE = re.compile(r"[^\n]*\n|[^\n]+")


@dataclass(frozen=True)
class Proposed:
    """What events say of a parameter's range.

    Attributes:
        parameter: its name.
        unit: its unit.
        declared: by the file.
        seen: of the events that keep the constraints.
        outside: how many of these are outside the declared range.
        proposed: what the range should be; the declared one if it holds them.
        remark: why it is not wider; may be empty.
    """

    parameter: str
    unit: str
    declared: Range
    seen: Range
    outside: int
    proposed: Range
    remark: str


@dataclass(frozen=True)
class Update:
    """A proposal for a scenario file.

    Attributes:
        path: of the file.
        events: that are this scenario, with all their parameters.
        kept: of these, how many keep the constraints.
        ranges: by parameter.
        broken: the constraints that events break, in words.
        diff: as ``patch`` takes it; "" if nothing is proposed.
    """

    path: Path
    events: int
    kept: int
    ranges: tuple[Proposed, ...]
    broken: tuple[str, ...]
    diff: str


def proposed_update(sought: Sought, events: ScenarioEvents) -> Update:
    """Return new ranges for a scenario's file.

    Args:
        sought: the scenario, of a file.
        events: that are it.

    Raises:
        FileFormatError: the file can no longer be read.
    """
    assert sought.path is not None
    path, rows = sought.path, events.rows
    good = np.ones(events.complete, np.bool_)
    for _, breaks in broken_by(sought.scenario, rows):
        good &= ~breaks
    try:
        text = path.read_bytes().decode()
    except (OSError, UnicodeDecodeError) as error:
        raise FileFormatError(f"{path}: cannot be read: {error}") from None
    kept = {name: values[good] for name, values in rows.items()} if good.any() else {}
    ends, refused, new = _ends(sought, text, kept)
    ranges = tuple(
        _proposed(sought.scenario.parameters[name], values, new, refused.get(name, ""))
        for name, values in kept.items()
    )
    after = replaced(text, ends, str(path))
    broken = tuple(broken_in_words(item) for item in events.broken)
    return Update(path, events.complete, int(good.sum()), ranges, broken, _diff(path, text, after))


def _ends(
    sought: Sought, text: str, kept: Mapping[str, Float]
) -> tuple[dict[tuple[str | int, ...], str], dict[str, str], dict[tuple[str, str], float]]:
    """Return the new texts of ends of ranges, why there are not more, and the new values."""
    found = read_plain_yaml(text.encode(), str(sought.path)).scalars
    wanted: dict[tuple[str, str], float] = {}
    refused: dict[str, str] = {}
    texts: dict[tuple[str | int, ...], str] = {}
    for name, values in kept.items():
        parameter = sought.scenario.parameters[name]
        for end, value in zip(_ENDS, (float(values.min()), float(values.max())), strict=True):
            if (value >= parameter.low) if end == "low" else (value <= parameter.high):
                continue
            at = found.get(("parameters", name, end))
            if at is None:
                refused[name] = "its range is declared in a fragment, not in this file"
            elif parameter.kind.name not in ("float", "integer"):
                refused[name] = f"a range of kind {parameter.kind.name} is not changed"
            else:
                texts["parameters", name, end], wanted[name, end] = _written(
                    at.text, value, parameter, end
                )
    while (problem := _problem(sought, text, texts)) is not None:
        paths = list(texts)
        named = [path for path in paths if str(path[1]) in problem] or paths
        helps = [
            path
            for path in named
            if _problem(sought, text, {**texts, path: found[path].text}) is None
        ]
        path = (helps or named)[0]
        name, end = str(path[1]), str(path[2])
        del texts[path], wanted[name, end]
        refused[name] = f"its {end} end stays: else {problem}"
    return texts, refused, wanted


def _problem(sought: Sought, text: str, texts: Mapping[tuple[str | int, ...], str]) -> str | None:
    """Return why a scenario cannot have some ends of ranges; None if it can."""
    assert sought.path is not None
    place = str(sought.path)
    try:
        build(read_plain_yaml(replaced(text, texts, place).encode(), place), sought.path.parent)
    except InputError as error:
        return error.problems[0]
    return None


def _written(text: str, value: float, parameter: Parameter, end: str) -> tuple[str, float]:
    """Return an end of a range, rounded outwards, in the unit of the old text, and its value."""
    zero, factor, unit = 0.0, 1.0, ""
    if has_unit(text):
        unit = re.sub(r"^\s*[-+.0-9eE]+", "", text).rstrip()
        zero = in_unit(f"0{unit}", parameter.unit)
        factor = in_unit(f"1{unit}", parameter.unit) - zero
    low, high = (
        (each - zero) / factor for each in (min(value, parameter.low), max(value, parameter.high))
    )
    if parameter.kind.name == "integer":
        rounded = float(math.floor(low) if end == "low" else math.ceil(high))
    else:
        wide = around(low, high)
        rounded = wide.low if end == "low" else wide.high
    return f"{rounded:.12g}{unit}", rounded * factor + zero


def _proposed(
    parameter: Parameter, values: Float, new: Mapping[tuple[str, str], float], remark: str
) -> Proposed:
    outside = int(((values < parameter.low) | (values > parameter.high)).sum())
    seen = Range(float(values.min()), float(values.max()))
    proposed = (new.get((parameter.name, end), getattr(parameter, end)) for end in _ENDS)
    return Proposed(
        parameter.name,
        parameter.unit,
        Range(parameter.low, parameter.high),
        seen,
        outside,
        Range(*proposed),
        remark,
    )


def _diff(path: Path, before: str, after: str) -> str:
    lines = difflib.unified_diff(_LINE.findall(before), _LINE.findall(after), str(path), str(path))
    return "".join(
        line if line.endswith("\n") else f"{line}\n\\ No newline at end of file\n" for line in lines
    )


def in_words(update: Update) -> list[str]:
    """Return what events say of a file, a sentence each."""
    texts = [f"{update.events:,} events, {update.kept:,} of which keep all constraints"]
    texts += [held_in_words(update.kept)] if 1 < update.kept < LEAST_ROWS else []
    texts += update.broken
    for each in update.ranges:
        text = (
            f"{each.parameter} [{each.unit}]: seen {each.seen.low:.4g} to {each.seen.high:.4g}, "
            f"{each.outside:,} outside {each.declared.low:g} to {each.declared.high:g}"
        )
        if each.proposed != each.declared:
            text += f"; proposed {each.proposed.low:g} to {each.proposed.high:g}"
        texts.append(f"{text}; {each.remark}" if each.remark else text)
    return texts


def write_updates(
    out: Path, sought: Sequence[Sought], scenarios: Sequence[ScenarioEvents], paths: Sequence[Path]
) -> tuple[Update, ...]:
    """Write the difference for each of some scenario files; the files themselves stay.

    Args:
        out: the folder of all.
        sought: the scenarios.
        scenarios: the events of each.
        paths: the files to propose ranges for.

    Raises:
        StorageError: one cannot be written.
    """
    made = []
    for item, events in zip(sought, scenarios, strict=True):
        if item.path not in paths:
            continue
        update = proposed_update(item, events)
        place = out / f"{update.path.name}{ENDING}"
        if update.diff:
            write_whole(place, [update.diff.encode()])
        else:
            try:
                place.unlink(missing_ok=True)
            except OSError as error:
                raise StorageError(f"{place}: cannot be removed: {error.strerror}") from None
        made.append(update)
    return tuple(made)


def refuse_same_names(paths: Sequence[Path]) -> None:
    """Refuse files whose differences would have one name.

    Raises:
        InputError: two have the same.
    """
    names = [path.name for path in paths]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise InputError(f"two files to update have the name {twice[0]}: rename one")
