"""A scenario of the catalogue with what a sentence says of it, as the text of a file.

What is said of ranges becomes bounds, with the words as their reason. Of what the sentence does not
say, one end of a range is narrowed where else the scenario would break its own rules; and that is
said, too.
"""

import json
import re
from collections.abc import Mapping
from dataclasses import replace

from bridgegen.base.errors import InputError
from bridgegen.scenario.language.constraints import Constraints
from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.language.parameters import Axis, Bound, Parameter
from bridgegen.scenario.language.plain_yaml import Path, read_plain_yaml, replaced
from bridgegen.scenario.language.reader import build, shipped_text
from bridgegen.scenario.language.rules import speeds_of
from bridgegen.scenario.language.sentence import Range, Sentence
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.scenario.named_models import body_of

_SHARES = (0.75, 0.5, 0.25, 0.1, 0.05)
_NARROWED = "narrowed for the rest"

_Limits = dict[str, tuple[float, float, str]]  # by parameter: low, high, and the words


def narrow(sentence: Sentence, name: str) -> tuple[str, tuple[str, ...]]:
    """Return the scenario that a sentence says, as a file.

    Args:
        sentence: it.
        name: of the new scenario.

    Returns:
        The file's text, and what was understood as lines of YAML: a key and its value, and the
        words of the sentence in a comment.

    Raises:
        InputError: the scenario cannot be like that; says which of its rules is in the way.
    """
    work = _Work(sentence, name)
    return work.text, work.lines()


class _Work:
    def __init__(self, sentence: Sentence, name: str) -> None:
        self.sentence, self.name, self.scenario = sentence, name, sentence.scenario
        self.shipped = shipped_text(self.scenario.name).decode("utf-8")
        document = read_plain_yaml(self.shipped.encode(), self.scenario.name)
        assert isinstance(document.data, dict)
        self.data, self.scalars = document.data, document.scalars
        self.reasons: list[str] = []
        limits, parameters = self._of_bodies(), self.scenario.parameters
        # One after the other: what each makes necessary is found apart.
        self.text, limits = self._narrowed(limits)
        for given in sentence.given.values():
            parameter = parameters.get(given.key.removeprefix("parameters."))
            if parameter is None:
                continue
            low, high, words = limits.get(parameter.name, (parameter.low, parameter.high, ""))
            if isinstance(given.value, Range):
                ends = given.value.within(parameter.low, parameter.high)
                assert ends is not None  # refused with the sentence
                low, high = max(low, ends[0]), min(high, ends[1])
            else:
                low = high = parameter.read(given.value)
            words = f'"{given.said}"' + (f"; {words}" if words else "")
            self.text, limits = self._narrowed({**limits, parameter.name: (low, high, words)})
        self.limits = limits

    def _of_bodies(self) -> _Limits:
        """Return the speeds that the bodies of participants can have, where another is said."""
        limits: _Limits = {}
        for given in self.sentence.given.values():
            if given.key.startswith("participants."):
                item = self.scenario.participant(given.key.split(".")[1])
                most = body_of(given.value).max_speed
                for name in speeds_of(item, self.scenario.story):
                    parameter = self.scenario.parameters.get(str(name))
                    if parameter is not None and most < parameter.high:
                        limits[parameter.name] = (parameter.low, most, f"what a {given.value} can")
        return limits

    def _narrowed(self, limits: _Limits) -> tuple[str, _Limits]:
        """Return the file with some limits, and those that it needs.

        Raises:
            InputError: there is none.
        """
        try:
            return self._file(limits), limits
        except InputError as error:
            problem = " ".join(error.problems[0].split())
        free = [
            item
            for item in self.scenario.parameters.values()
            if item.kind.name == "float" and item.low < item.high
            and not limits.get(item.name, ("", "", ""))[2].startswith('"')
        ]  # fmt: skip
        for share in _SHARES:
            for item in free:
                low, high, _ = limits.get(item.name, (item.low, item.high, ""))
                part = float(f"{share * (high - low):.2g}")
                for ends in ((low, low + part), (high - part, high)):
                    tried = {**limits, item.name: (*ends, _NARROWED)}
                    try:
                        text = self._file(tried)
                    except InputError:
                        continue
                    self.reasons.append(problem)
                    return text, tried
        raise InputError(
            f"{self.scenario.name} cannot be as '{self.sentence.text}' says: {problem}"
        )

    def _file(self, limits: _Limits) -> str:
        """Return the file with some limits.

        Raises:
            InputError: it is not valid.
        """
        parameters = dict(self.scenario.parameters)
        bounds = []
        for name, (low, high, _) in limits.items():
            parameter = parameters[name]
            if parameter.kind.names:
                parameters[name] = replace(parameter, low=low, high=high, default=low)
                continue
            if not low <= parameter.default <= high:
                parameters[name] = replace(parameter, default=0.5 * (low + high))
            bounds.append(Bound(name, parse(repr(low)), parse(repr(high)), "said", "said"))
        rules = Constraints(
            parameters, (*self.scenario.bounds, *bounds), self.scenario.derived, self.scenario.axes
        )
        # What breaks a rule is found here in a tenth of the time that a file takes.
        space = SearchSpace(rules, Axis)
        text = self._written(limits, space.values(space.row({})))
        build(read_plain_yaml(text.encode(), f"{self.name}.yaml"), None)
        return text

    def _written(self, limits: _Limits, defaults: Mapping[str, float]) -> str:
        title = self.sentence.text.strip()
        values: dict[Path, str] = {
            ("scenario",): self.name,
            ("title",): _quoted(title[:1].upper() + title[1:]),
        }
        own = self.data.get("parameters", {})
        later, bounds, added = dict(self.data.get("defaults", {})), "", ""
        for name, parameter in self.scenario.parameters.items():
            if defaults[name] != parameter.default and name in own:
                values["parameters", name, "default"] = str(parameter.kind.written(defaults[name]))
            elif defaults[name] != parameter.default:
                later[name] = parameter.kind.written(defaults[name])
        for name, (low, high, words) in limits.items():
            parameter = self.scenario.parameters[name]
            if parameter.kind.names:
                only, path = parameter.kind.names[int(low)], ("parameters", name, "default")
                values[path] = self._beside(path, only, f"only: {only}")
                continue
            ends = [f"lo: {low!r}"] * (low > parameter.low)
            ends += [f"hi: {high!r}"] * (high < parameter.high)
            why = _quoted(f"The scenario is made of a sentence: {words}.")
            if ends:
                bounds += f"  - {{target: {name}, {', '.join(ends)}, why: {why}, source: As why.}}\n"
        for given in self.sentence.given.values():
            path = tuple(given.key.split("."))
            if path in self.scalars:
                values[path] = str(given.value)
            elif path[-1] == "model":
                kind = (*path[:-1], "type")
                values[kind] = self._beside(kind, self.scalars[kind].text, f"model: {given.value}")
            elif path[0] in ("traffic", "rules"):
                added += f"{given.key}: {given.value}\n"
        text = replaced(self.shipped, values, self.scenario.name)
        if later:
            text = re.sub(r"^defaults:.*\n(?:[ \t].*\n)*", "", text, flags=re.M)
            pairs = ", ".join(f"{key}: {value}" for key, value in later.items())
            added += f"defaults: {{{pairs}}}\n"
        if "bounds" in self.data:
            text = re.sub(r"^bounds:.*\n", lambda at: at[0] + bounds, text, count=1, flags=re.M)
        elif bounds:
            added += f"bounds:\n{bounds}"
        head = f"# Of the catalogue's {self.scenario.name}: {_quoted(title)}\n"
        return head + text.rstrip("\n") + ("\n\n" + added if added else "\n")

    def _beside(self, path: Path, value: str, more: str) -> str:
        """Return a new value with another key after it, as the file writes its mapping."""
        at = self.scalars[path]
        line = self.shipped[self.shipped.rfind("\n", 0, at.start) + 1 : at.start]
        flow = self.shipped[at.end :].lstrip(" ")[:1] in (",", "}")
        indent = line[: len(line) - len(line.lstrip())]
        return f"{value}, {more}" if flow else f"{value}\n{indent}{more}"

    def lines(self) -> tuple[str, ...]:
        """Return what was understood, and what was narrowed for it."""
        rows = []
        limits = {f"parameters.{name}": limit for name, limit in self.limits.items()}
        for key, (_, value, said) in self.sentence.given.items():
            low, high, words = limits.pop(key, (0.0, 0.0, f'"{said}"'))
            if key == "like":
                words += f"; {self.scenario.title}"
            text = _interval(self._parameter(key), low, high) if isinstance(value, Range) else value
            rows.append((f"{key}: {text}", words))
        for key, (low, high, words) in limits.items():
            rows.append((f"{key}: {_interval(self._parameter(key), low, high)}", words))
        wide = max(len(row) for row, _ in rows)
        notes = [f"# {_NARROWED}, else: {reason}" for reason in self.reasons]
        for given in self.sentence.given.values():
            if given.key.startswith("participants."):
                new, item = body_of(given.value), given.key.split(".")[1]
                old = self.scenario.participant(item).body
                if abs(new.front - old.front) > 0.05 or abs(new.rear - old.rear) > 0.05:
                    notes.append(
                        f"# from {item}'s reference point to its front {new.front:.1f} m, rear "
                        f"{new.rear:.1f} m; lengths in formulas stay those of the catalogue's, "
                        f"{old.front:.1f} m and {old.rear:.1f} m"
                    )
        return (*(f"{row:{wide}}  # {words}" for row, words in rows), *notes)

    def _parameter(self, key: str) -> Parameter:
        return self.scenario.parameters[key.removeprefix("parameters.")]


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _interval(parameter: Parameter, low: float, high: float) -> str:
    unit = "" if parameter.unit in ("1", "count") else f" {parameter.unit}"
    return f"{low:g}{unit}" if low == high else f"{low:g} to {high:g}{unit}"
