"""How the value of an option is written on a command line, and read from one."""

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bridgegen.errors import InputError
from bridgegen.odd.criteria import Criterion, in_words, joined, read_criteria, read_criterion
from bridgegen.options import file_forms
from bridgegen.options.file_forms import FileForm
from bridgegen.simulation.choice import EMBEDDED, SimulatorChoice, Value

Words = Callable[[str, Any], list[str]]
"""Of an option's spelling and its value: the words of a command line."""


def _repeated(texts: Callable[[Any], list[str]]) -> Words:
    """Return how an option is written that is given once for each text."""
    return lambda spelling, value: [word for text in texts(value) for word in (spelling, text)]


@dataclass(frozen=True)
class Form:
    """How values of one type are written.

    Attributes:
        kind: what the command line's parser makes of the text; None of a value that one option
            cannot express.
        read: the value of what the parser returns, given with the option's spelling for messages.
        words: the words of a command line that give an option a value.
        keep: the value as an option's field keeps it, of any that Python code may give.
        in_file: how it is written in a run file.
    """

    kind: Any
    read: Callable[[Any, str], Any] = lambda parsed, spelling: parsed
    words: Words = lambda spelling, value: [spelling, str(value)]
    keep: Callable[[Any], Any] = lambda value: value
    in_file: FileForm = file_forms.TEXT


def read_names(text: str | None) -> list[str]:
    """Read ``name,…``; nothing is none."""
    return [name for part in (text or "").split(",") if (name := part.strip())]


def read_numbers(pairs: Iterable[str] | None, spelling: str) -> dict[str, float]:
    """Read ``name=number`` pairs.

    Raises:
        InputError: a pair reads otherwise.
    """
    values, problems = {}, []
    for pair in pairs or ():
        name, equals, text = pair.partition("=")
        try:
            values[name] = float(text)
        except ValueError:
            equals = ""
        if not equals:
            problems.append(f"{spelling} must read NAME=NUMBER, got '{pair}'")
    if problems:
        raise InputError(*problems)
    return values


def read_fixed(pairs: Iterable[str] | None, spelling: str) -> dict[str, float | str]:
    """Read ``name=value`` pairs: numbers, or names of categories' values.

    Raises:
        InputError: a pair has no value.
    """
    values: dict[str, float | str] = {}
    problems = []
    for pair in pairs or ():
        name, equals, text = pair.partition("=")
        try:
            values[name] = float(text)
        except ValueError:
            values[name] = text
        if not equals or not text:
            problems.append(f"{spelling} must read NAME=VALUE, got '{pair}'")
    if problems:
        raise InputError(*problems)
    return values


def read_terms(text: str | None, spelling: str) -> dict[str, float | None] | None:
    """Read ``metric=weight,…`` or ``metric,…``; nothing is the scenario's choice.

    Raises:
        InputError: a weight is no number.
    """
    if not text:
        return None
    pairs = read_names(text)
    weighted = read_numbers([pair for pair in pairs if "=" in pair], spelling)
    return {name: weighted.get(name) for name in (pair.partition("=")[0] for pair in pairs)}


def read_settings(pairs: Iterable[str] | None, spelling: str) -> dict[str, Value]:
    """Read ``name=value`` pairs; a value is a number, true, false, or a text.

    Raises:
        InputError: a pair has no value.
    """
    values: dict[str, Value] = {}
    for pair in pairs or ():
        name, equals, text = pair.partition("=")
        if not equals:
            raise InputError(f"{spelling} must read NAME=VALUE, got '{pair}'")
        values[name] = read_value(text)
    return values


def read_value(text: str) -> Value:
    """Read the value of a setting: a number, true, false, or else a text."""
    try:
        value = json.loads(text)
    except json.JSONDecodeError:
        return text
    return value if isinstance(value, bool | int | float | str) else text


def _setting_texts(settings: Mapping[str, Value]) -> list[str]:
    return [f"{name}={json.dumps(value)}" for name, value in settings.items()]


def _fixed_texts(values: Mapping[str, float | str]) -> list[str]:
    return [f"{name}={value}" for name, value in values.items()]


def _term_texts(terms: Mapping[str, float | None]) -> list[str]:
    return [",".join(m if w is None else f"{m}={w!r}" for m, w in terms.items())] if terms else []


def _kept_criteria(
    given: Iterable[str | Criterion | Mapping[str, Any]],
) -> tuple[dict[str, Any], ...]:
    """Return criteria as plain data, of texts, plain data or themselves."""
    found: list[Criterion] = []
    for one in given:
        if isinstance(one, str):
            found += read_criteria([one])
        else:
            found.append(one if isinstance(one, Criterion) else read_criterion(one))
    return tuple(one.to_dict() for one in joined(found))


def _flag_words(spelling: str, value: bool) -> list[str]:
    return [spelling if value else f"--no-{spelling.removeprefix('--')}"]


def _simulator_words(_: str, choice: SimulatorChoice) -> list[str]:
    named = [] if choice.name == EMBEDDED.name else ["--simulator", choice.name]
    return named + _repeated(_setting_texts)("--simulator-set", choice.settings)


def _screen_words(_: str, choice: SimulatorChoice) -> list[str]:
    return ["--screen", choice.name, *_repeated(_setting_texts)("--screen-set", choice.settings)]


TEXT = Form(str)
WHOLE = Form(int, in_file=file_forms.WHOLE)
NUMBER = Form(
    float, words=lambda spelling, value: [spelling, repr(value)], in_file=file_forms.NUMBER
)
PATH = Form(Path)

FLAG = Form(bool, words=_flag_words, in_file=file_forms.FLAG)
"""On or off: ``--name``, ``--no-name``."""

NAMES = Form(
    str,
    lambda text, _: tuple(read_names(text)),
    _repeated(lambda names: [",".join(names)] if names else []),
    lambda names: None if names is None else tuple(names),
    file_forms.NAMES,
)
"""``name,name``."""

FIXED = Form(
    list[str],
    read_fixed,
    _repeated(_fixed_texts),
    lambda values: dict(values or {}),
    file_forms.FIXED,
)
"""``name=number`` or ``name=name``, repeated."""

SETTINGS = Form(
    list[str],
    read_settings,
    _repeated(_setting_texts),
    lambda values: dict(values or {}),
    file_forms.SETTINGS,
)
"""``name=value``, repeated."""

TERMS = Form(
    str,
    read_terms,
    _repeated(_term_texts),
    lambda terms: None if terms is None else dict(terms),
    file_forms.TERMS,
)
"""``metric=weight,metric``."""

CRITERIA = Form(
    list[str],
    lambda texts, _: _kept_criteria(texts),
    _repeated(lambda given: [in_words(read_criterion(one)) for one in given]),
    lambda given: _kept_criteria(given or ()),
    file_forms.CRITERIA,
)
"""``ID: FORMULA``, a mapping in braces, or the path of a file; repeated."""

SIMULATOR = Form(None, words=_simulator_words, keep=lambda choice: choice or EMBEDDED)
"""Its name and its settings. Where it is on this machine belongs to no run's command."""

SCREEN = Form(None, words=_screen_words)
"""Likewise, or none."""
