"""A scenario of the catalogue with what a sentence says of it, as the text of a file.

Of what the sentence does not say, only as much is narrowed as the scenario's constraints ask for,
once the values that it says are kept; and that is said, too.
"""

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from bridgegen.base.errors import InputError
from bridgegen.scenario.language.kinds import slack
from bridgegen.scenario.language.parameters import Axis, Parameter
from bridgegen.scenario.language.plain_yaml import Path, read_plain_yaml, replaced
from bridgegen.scenario.language.reader import build, shipped_text
from bridgegen.scenario.language.rules import speeds_of
from bridgegen.scenario.language.sentence import Range, Sentence
from bridgegen.scenario.language.space import probes
from bridgegen.scenario.named_models import MODELS
from bridgegen.scenario.participants import PARTICIPANTS, Body

_STARTS = 400
_SHARES = (0.75, 0.5, 0.25, 0.1, 0.0)

Ranges = dict[str, tuple[float, float]]


@dataclass(frozen=True)
class Narrowed:
    """A scenario file made of a sentence.

    Attributes:
        text: of the file.
        lines: what was understood, as lines of YAML: a key, its value, and the words in a comment.
    """

    text: str
    lines: tuple[str, ...]


def narrow(sentence: Sentence, name: str) -> Narrowed:
    """Return the scenario that a sentence says, as a file.

    Args:
        sentence: it.
        name: of the new scenario.

    Raises:
        InputError: the scenario cannot be like that; says which of its rules is in the way.
    """
    work = _Work(sentence, name)
    ranges, defaults = work.narrowed()
    return Narrowed(work.text(ranges, defaults), tuple(work.lines(ranges)))


@dataclass
class _Work:
    sentence: Sentence
    name: str
    said: dict[str, tuple[object, str]] = field(init=False)
    wanted: Ranges = field(init=False)
    problem: str = field(default="", init=False)

    def __post_init__(self) -> None:
        self.said = self.sentence.said
        parameters = self.sentence.scenario.parameters
        self.wanted = {}
        for key, (value, _) in self.said.items():
            name = key.removeprefix("parameters.")
            if isinstance(value, Range):
                low, high = parameters[name].low, parameters[name].high
                ends = (value.low, value.high)
                self.wanted[name] = (
                    low if ends[0] is None else max(low, ends[0]),
                    high if ends[1] is None else min(high, ends[1]),
                )
            elif key.startswith("parameters."):
                self.wanted[name] = (parameters[name].read(str(value)),) * 2

    # -- values that keep the scenario's constraints ---------------------------------------------

    def narrowed(self) -> tuple[Ranges, dict[str, float]]:
        """Return the ranges that differ from the catalogue's, and defaults that keep them.

        Raises:
            InputError: there are none.
        """
        for defaults in self._rows():
            if self._fits(self.wanted, defaults):
                return self.wanted, defaults
            if (ranges := self._less(defaults)) is not None:
                return ranges, defaults
        raise InputError(
            f"{self.sentence.scenario.name} cannot be as '{self.sentence.text}' says: "
            f"{self.problem or 'its constraints leave no value'}"
        )

    def _less(self, at: Mapping[str, float]) -> Ranges | None:
        """Return ranges of which others than those that are said are narrowed; None if none do."""
        parameters = self.sentence.scenario.parameters
        free = [
            (name, item.low, item.high)
            for name, item in parameters.items()
            if name not in self.wanted and item.kind.name == "float" and item.low < item.high
        ]
        # One end may be all that is in the way; if not, ends of all, of which most may stay.
        ends = [((name, side),) for name, *_ in free for side in (0, 1)]
        every = tuple((name, side) for name, *_ in free for side in (0, 1))
        for names in (ends, [every]):
            for share in _SHARES:
                for some in names:
                    ranges = dict(self.wanted)
                    for name, side in some:
                        item = parameters[name]
                        pair = list(ranges.get(name, (item.low, item.high)))
                        pair[side] = _nearer(pair[side], at[name], share)
                        ranges[name] = (pair[0], pair[1])
                    if self._fits(ranges, at):
                        return self._widened(ranges, at)
        return None

    def _widened(self, ranges: Ranges, at: Mapping[str, float]) -> Ranges:
        """Return ranges of which each end is the catalogue's again, where that is possible."""
        # Twice: another that is wider may make room for it.
        for name in [name for name in ranges if name not in self.wanted] * 2:
            full = self.sentence.scenario.parameters[name]
            for side, end in enumerate((full.low, full.high)):
                pair = (end, ranges[name][1]) if side == 0 else (ranges[name][0], end)
                if pair != ranges[name] and self._fits({**ranges, name: pair}, at):
                    ranges[name] = pair
            if ranges[name] == (full.low, full.high):
                ranges = {key: ends for key, ends in ranges.items() if key != name}
                return self._widened(ranges, at)
        return ranges

    def _fits(self, ranges: Ranges, defaults: Mapping[str, float]) -> bool:
        place = f"{self.name}.yaml"
        try:
            build(read_plain_yaml(self.text(ranges, defaults).encode(), place), None)
        except InputError as error:
            self.problem = self.problem or error.problems[0]
            return False
        return True

    def _rows(self) -> Iterator[dict[str, float]]:
        """Yield defaults that keep what is said: next to the catalogue's, then others."""
        scenario = self.sentence.scenario
        space = scenario.space(Axis)
        usual = {name: item.default for name, item in scenario.parameters.items()}
        for name, (low, high) in self.wanted.items():
            if not low <= usual[name] <= high:
                usual[name] = 0.5 * (low + high)
        first = self._settled(usual)
        if first is not None:
            yield first
        X = space.decode(probes(space.n_var))
        columns = [space.index(name) for name in usual]
        width = np.maximum(np.ptp(X[:, columns], axis=0), 1e-9)
        far = (np.abs(X[:, columns] - [usual[name] for name in usual]) / width).sum(axis=1)
        tried = 0
        for row in np.argsort(far, kind="stable")[:_STARTS]:
            start = dict(zip(usual, X[row, columns].tolist(), strict=True))
            found = self._settled(start)
            if found is not None and (tried := tried + 1) <= 3:
                yield found

    def _settled(self, start: Mapping[str, float]) -> dict[str, float] | None:
        """Return values near some that keep what is said and all constraints; None without any."""
        scenario = self.sentence.scenario
        space = scenario.space(Axis)
        table: dict[str, float] = {}
        for name in space.order:
            if name in space.derived:
                table[name] = float(space.derived[name].value.evaluate(table))
                continue
            try:
                lo, hi = map(float, space.interval(name, table))
            except InputError as error:
                self.problem = self.problem or error.problems[0]
                return None
            low, high = self.wanted.get(name, (lo, hi))
            if max(lo, low) > min(hi, high) + float(slack(high)):
                rules = " and ".join(str(bound) for bound in space.bounds[name])
                self.problem = self.problem or (
                    f"{rules} leaves {lo:.4g} to {hi:.4g} to {name}, got {low:g} to {high:g}"
                )
                return None
            table[name] = float(np.clip(start[name], max(lo, low), max(min(hi, high), low)))
        for name, body in self._bodies():
            item = scenario.participant(name)
            for value in speeds_of(item, scenario.story):
                speed = table[value] if isinstance(value, str) else float(value)
                if speed > body.max_speed:
                    self.problem = self.problem or (
                        f"{name} drives at {value}, {speed:.4g} m/s, and can do {body.max_speed:g}"
                    )
                    return None
        return {name: table[name] for name in scenario.parameters}

    def _bodies(self) -> Iterator[tuple[str, Body]]:
        """Yield the participants that are said to be something, and the body of that."""
        for key, (value, _) in self.said.items():
            if key.startswith("participants."):
                named = MODELS.get(str(value)) or PARTICIPANTS[str(value)]
                yield key.split(".")[1], named.body

    # -- the file, and what is told --------------------------------------------------------------

    def text(self, ranges: Ranges, defaults: Mapping[str, float]) -> str:
        """Return the file with some ranges and defaults."""
        scenario = self.sentence.scenario
        text = shipped_text(scenario.name).decode("utf-8")
        data = read_plain_yaml(text.encode(), scenario.name).data
        assert isinstance(data, dict)
        own, bounds, later = data.get("parameters", {}), [], dict(data.get("defaults", {}))
        title = self.sentence.text.strip()
        values: dict[Path, str] = {
            ("scenario",): self.name,
            ("title",): _quoted(title[:1].upper() + title[1:]),
        }
        for name, parameter in scenario.parameters.items():
            low, high = ranges.get(name, (parameter.low, parameter.high))
            default = defaults[name]
            if default != parameter.default:
                if name in own:
                    values["parameters", name, "default"] = _written(parameter, default)
                else:
                    later[name] = parameter.kind.written(default)
            if name not in ranges:
                continue
            words = self._words(name)
            if parameter.kind.names:
                only = _written(parameter, low)
                values["parameters", name, "default"] = f"{only}\n    only: {only} # {words}"
            elif name in own:
                values["parameters", name, "low"] = f"{low!r} # {words}"
                values["parameters", name, "high"] = f"{high!r} # {words}"
            else:
                ends = {"lo": low, "hi": high}
                limits = ", ".join(
                    f"{key}: {end!r}"
                    for key, end in ends.items()
                    if end != (parameter.low if key == "lo" else parameter.high)
                )
                if limits:
                    why = _quoted(words.replace('"', "'"))
                    bounds.append(
                        f"  - {{target: {name}, {limits}, why: {why}, source: Said of it.}}\n"
                    )
        added = ""
        for key, (value, words) in self.said.items():
            path: Path = tuple(key.split("."))
            if key.startswith("participants.") and path[2] == "model":
                if "model" in data["participants"][path[1]]:
                    continue
                kind = data["participants"][path[1]]["type"]
                values[(*path[:2], "type")] = f"{kind} # {words}\n    model: {value}"
            elif key.startswith("participants.") or key == "roads.lanes":
                values[path] = str(value)
            elif key in ("traffic", "rules"):
                added += f"{key}: {value} # {words}\n"
        text = replaced(text, values, scenario.name)
        if later:
            text = re.sub(r"^defaults:.*\n(?:[ \t].*\n)*", "", text, flags=re.M)
            values_ = ", ".join(f"{key}: {value}" for key, value in later.items())
            added += f"defaults: {{{values_}}}\n"
        if bounds and "bounds" in data:
            text = re.sub(r"^bounds:.*\n", lambda at: at[0] + "".join(bounds), text, flags=re.M)
        elif bounds:
            added += "bounds:\n" + "".join(bounds)
        head = f"# Of the catalogue's {scenario.name}, as said: {_quoted(self.sentence.text)}\n"
        return head + text.rstrip("\n") + "\n" + (f"\n{added}" if added else "")

    def _words(self, name: str) -> str:
        if (key := f"parameters.{name}") in self.said:
            return self.said[key][1]
        return "narrowed, so that the rest is possible"

    def lines(self, ranges: Ranges) -> Iterator[str]:
        """Yield what was understood, and what was narrowed for it."""
        scenario = self.sentence.scenario
        rows = []
        for key, (value, words) in self.said.items():
            name = key.removeprefix("parameters.")
            if isinstance(value, Range):
                rows.append((key, _interval(scenario.parameters[name], *ranges[name]), words))
            else:
                more = f"; {scenario.title}" if key == "like" else ""
                rows.append((key, str(value), words + more))
        rows += [
            (f"parameters.{name}", _interval(scenario.parameters[name], *ends), self._words(name))
            for name, ends in ranges.items()
            if name not in self.wanted
        ]
        wide = max(len(f"{key}: {value}") for key, value, _ in rows)
        for key, value, words in rows:
            yield f"{f'{key}: {value}':{wide}}  # {words}"
        if len(rows) > len(self.said):
            yield f"# narrowed, since else {' '.join(self.problem.split())}"
        for name, body in self._bodies():
            old = scenario.participant(name).body
            if abs(body.front - old.front) > 0.05 or abs(body.rear - old.rear) > 0.05:
                yield (
                    f"# {name} reaches {body.front:g} m to the front and {body.rear:g} m to the "
                    f"rear of its reference point, in {scenario.name} {old.front:g} m and "
                    f"{old.rear:g} m: formulas there that hold a length are not changed"
                )


def _nearer(end: float, middle: float, share: float) -> float:
    """Return an end of a range that is only a share as far from a value inside, in few digits."""
    far = middle + share * (end - middle)
    rounded = float(np.ceil(far * 100) if far < middle else np.floor(far * 100)) / 100
    return rounded if abs(rounded - end) < abs(middle - end) else middle


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _written(parameter: Parameter, value: float) -> str:
    return str(parameter.kind.written(value)) if parameter.kind.names else repr(float(value))


def _interval(parameter: Parameter, low: float, high: float) -> str:
    unit = "" if parameter.unit in ("1", "count") else f" {parameter.unit}"
    return f"{low:g}{unit}" if low == high else f"{low:g} to {high:g}{unit}"
