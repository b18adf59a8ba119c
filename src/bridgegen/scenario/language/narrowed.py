"""A scenario of the catalogue with what a sentence says of it, as the text of a file.

What is said of ranges becomes bounds, with the words as their reason. Of what the sentence does not
say, one end of a range is narrowed where else the scenario would break its own rules; and that is
said, too.
"""

import copy
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

import yaml

from bridgegen.base.errors import InputError
from bridgegen.scenario.countries import in_the_mirror
from bridgegen.scenario.language.constraints import Constraints
from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.language.parameters import Axis, Bound
from bridgegen.scenario.language.plain_yaml import Document, read_plain_yaml
from bridgegen.scenario.language.reader import build, document_of
from bridgegen.scenario.language.rules import speeds_of
from bridgegen.scenario.language.sentence import Sentence
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.scenario.named_models import body_of

_SHARES = (0.75, 0.5, 0.25, 0.1, 0.05)
_NARROWED = "narrowed for the rest"

_Limits = dict[str, tuple[float, float, str]]  # by parameter: low, high, and the words


def narrow(sentence: Sentence, name: str) -> str:
    """Return the scenario that a sentence says, as the text of a file.

    At its head stands what was understood, in comments: lines of YAML, a key and its value, with
    the words of the sentence.

    Raises:
        InputError: the scenario cannot be like that; says which of its rules is in the way.
    """
    parameters, caps, reasons = sentence.scenario.parameters, _of_bodies(sentence), list[str]()
    said: _Limits = {}
    for key, value, text in sentence.given.values():
        if (item := parameters.get(key.removeprefix("parameters."))) is not None:
            low, high, words = caps.get(item.name, (item.low, item.high, ""))
            ends = (item.read(value),) * 2 if isinstance(value, str) else value.within(item)
            words = f'"{text}"' + (f"; {words}" if words else "")
            said[item.name] = (max(low, ends[0]), min(high, ends[1]), words)
    try:
        data, limits = _narrowed(sentence, name, caps | said, reasons)
    except InputError:  # more than one thing may be in the way: each is narrowed for apart
        data, limits = _narrowed(sentence, name, caps, reasons)
        for key, limit in said.items():
            data, limits = _narrowed(sentence, name, limits | {key: limit}, reasons)
    lines = [*_lines(sentence, limits), *(f"# {_NARROWED}, else: {text}" for text in reasons)]
    text = "".join(f"# {line}\n" for line in lines)
    text += yaml.dump(
        data, Dumper=_Dumper, sort_keys=False, allow_unicode=True, default_flow_style=None, width=99
    )
    build(read_plain_yaml(text.encode(), f"{name}.yaml"), None)
    return text


class _Dumper(yaml.SafeDumper):
    """Writes texts without the end of the line that folded ones have."""


_Dumper.add_representer(str, lambda dumper, text: dumper.represent_str(text.strip()))


def _of_bodies(sentence: Sentence) -> _Limits:
    """Return the speeds that participants can have where they are said to be something else."""
    limits: _Limits = {}
    for key, value, _ in sentence.given.values():
        if key.startswith("participants."):
            most = body_of(value).max_speed
            item = sentence.scenario.participant(key.split(".")[1])
            for name in speeds_of(item, sentence.scenario.story):
                parameter = sentence.scenario.parameters.get(str(name))
                if parameter is not None and most < parameter.high:
                    limits[parameter.name] = (parameter.low, most, f"what a {value} can do")
    return limits


def _narrowed(
    sentence: Sentence, name: str, limits: _Limits, reasons: list[str]
) -> tuple[Any, _Limits]:
    """Return a file with some limits, and those that it needs; adds the reason of more.

    Raises:
        InputError: there is none.
    """
    try:
        return _file(sentence, name, limits), limits
    except InputError as error:
        problem = " ".join(error.problems[0].split())
    for ends in _fewer(sentence, limits):
        more = {key: (*pair, _NARROWED) for key, pair in ends.items()}
        try:
            data = _file(sentence, name, limits | more)
        except InputError:
            continue
        for key in ends if len(ends) > 1 else ():  # not all of them may be in the way
            fewer = {other: limit for other, limit in more.items() if other != key}
            with suppress(InputError):
                data, more = _file(sentence, name, limits | fewer), fewer
        reasons.append(problem)
        return data, limits | more
    raise InputError(f"{sentence.scenario.name} cannot be as '{sentence.text}' says: {problem}")


def _fewer(sentence: Sentence, limits: _Limits) -> Iterator[dict[str, tuple[float, float]]]:
    """Yield ranges of what is not said: one from one end, or the weather near its defaults."""
    free = [
        (item, *limits.get(item.name, (item.low, item.high))[:2])
        for item in sentence.scenario.parameters.values()
        if item.kind.name == "float" and f"parameters.{item.name}" not in sentence.given
    ]
    for share in _SHARES:
        for item, low, high in free:
            part = float(f"{share * (high - low):.2g}")
            yield {item.name: (low, low + part)}
            yield {item.name: (high - part, high)}
    weather = [each for each in free if each[0].axis is Axis.WEATHER]
    for share in (*_SHARES, 0.0):
        yield {
            item.name: (usual - share * (usual - low), usual + share * (high - usual))
            for item, low, high in weather
            for usual in (item.default,)
        }


def _file(sentence: Sentence, name: str, limits: _Limits) -> Any:
    """Return what a file with some limits holds.

    Raises:
        InputError: it is not valid.
    """
    scenario, parameters, bounds = sentence.scenario, dict(sentence.scenario.parameters), []
    for key, (low, high, _) in limits.items():
        parameter = parameters[key]
        default = parameter.default if low <= parameter.default <= high else 0.5 * (low + high)
        if parameter.kind.names:
            parameters[key] = replace(parameter, low=low, high=high, default=low)
        else:
            parameters[key] = replace(parameter, default=default)
            bounds.append(Bound(key, parse(repr(low)), parse(repr(high)), "said", "said"))
    rules = Constraints(parameters, (*scenario.bounds, *bounds), scenario.derived, scenario.axes)
    # What breaks a rule is found here in a tenth of the time that a file takes.
    space = SearchSpace(rules, Axis)
    data = _data(sentence, name, limits, space.values(space.row({})))
    build(Document(data, {}, f"{name}.yaml"), None)
    return data


def _data(sentence: Sentence, name: str, limits: _Limits, defaults: Mapping[str, float]) -> Any:
    data: Any = copy.deepcopy(document_of(sentence.scenario.name)[0].data)
    told = in_the_mirror if sentence.is_left else str  # as the file of a mirror image is written
    said = sentence.text.strip()
    data |= {"scenario": name, "title": told(said[:1].upper() + said[1:])}
    for key, parameter in sentence.scenario.parameters.items():
        if defaults[key] != parameter.default:
            default = parameter.kind.written(defaults[key])
            if key in data.get("parameters", {}):
                data["parameters"][key]["default"] = default
            else:
                data.setdefault("defaults", {})[key] = default
        low, high, words = limits.get(key, (parameter.low, parameter.high, ""))
        if parameter.kind.names and low == high:
            data["parameters"][key]["only"] = parameter.kind.written(low)
        elif (low, high) != (parameter.low, parameter.high):
            reason = {"why": told(f"Said in a sentence: {words}."), "source": "As why."}
            data.setdefault("bounds", []).append({"target": key, "lo": low, "hi": high} | reason)
    for key, value, _ in sentence.given.values():
        *path, last = key.split(".")
        if last in ("type", "model", "lanes", "traffic", "rules"):
            at = data
            for part in path:
                at = at[part]
            at[last] = value
    return data


def _lines(sentence: Sentence, limits: _Limits) -> list[str]:
    """Return what was understood, and what was narrowed for it."""
    scenario = sentence.scenario
    rows: dict[str, tuple[object, str]] = {"like": (scenario.name, "")}
    rows |= {key: (value, f'"{said}"') for key, value, said in sentence.given.values()}
    rows["like"] = (scenario.name, f"{rows['like'][1]}: {scenario.title}".lstrip(": "))
    for name, (low, high, words) in limits.items():
        item = scenario.parameters[name]
        if not item.kind.names:
            both = f"{low:g}" if low == high else f"{low:g} to {high:g}"
            rows[f"parameters.{name}"] = (f"{both} {item.unit}", words)
    for key, (value, words) in rows.items():
        if key.startswith("participants."):
            new, old = body_of(str(value)), scenario.participant(key.split(".")[1]).body
            if (new.front, new.rear) != (old.front, old.rear):
                words += f"; from its reference point to its front {new.front:.1f} m (as shipped "
                words += f"{old.front:.1f} m), to its rear {new.rear:.1f} m ({old.rear:.1f} m)"
                rows[key] = (value, words)
    wide = max(len(f"{key}: {value}") for key, (value, _) in rows.items())
    return [f"{f'{key}: {value}':{wide}}  # {words}" for key, (value, words) in rows.items()]
