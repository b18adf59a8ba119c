"""How the value of an option is written on a command line, and read from one."""

import json
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from numbers import Integral, Real
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bridgegen.base.errors import InputError
from bridgegen.engine.options import file_forms
from bridgegen.engine.options.file_forms import FileForm
from bridgegen.simulation.choice import EMBEDDED, SimulatorChoice, Value

if TYPE_CHECKING:  # criteria take a third of a second to import: only a run that has some waits
    from bridgegen.scenario.language.criteria import Criterion

Words = Callable[[str, Any], list[str]]
"""Function that writes an option, given its spelling and value, as words of a command line."""


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
        valid: whether a value that ``keep`` returns is one.
        must: what a value must be, in words.
    """

    kind: Any
    read: Callable[[Any, str], Any] = lambda parsed, spelling: parsed
    words: Words = lambda spelling, value: [spelling, str(value)]
    keep: Callable[[Any], Any] = lambda value: value
    in_file: FileForm = file_forms.TEXT
    valid: Callable[[Any], bool] = lambda value: isinstance(value, str | PathLike)
    must: str = "a text"

    def taken(self, value: Any, name: str, default: Any = None) -> Any:
        """Return a value that Python code gives as an option's field keeps it.

        A text is read as on the command line.

        Args:
            value: of any type.
            name: of the option, for messages.
            default: of the option; where it is None, so may the value be.

        Raises:
            InputError: no such value.
        """
        try:
            kept = value
            if isinstance(value, str) and self.kind in (str, list[str]):
                kept = self.read(value if self.kind is str else [value], name)
            kept = self.keep(kept)
            if self.valid(kept) or (kept is None and default is None):
                return kept
        except (TypeError, ValueError):
            pass
        raise InputError(f"{name} must be {self.must}, got {value!r}")


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
    given: "Iterable[str | Criterion | Mapping[str, Any]]",
) -> tuple[dict[str, Any], ...]:
    """Return criteria as plain data, of texts, plain data or themselves."""
    if not given:
        return ()
    from bridgegen.scenario.language.criteria import (
        Criterion,
        joined,
        read_criteria,
        read_criterion,
    )

    found: list[Criterion] = []
    for name in given:
        if isinstance(name, str):
            found += read_criteria([name])
        else:
            found.append(name if isinstance(name, Criterion) else read_criterion(name))
    return tuple(criterion.to_dict() for criterion in joined(found))


def _criteria_texts(given: Iterable[Mapping[str, Any]]) -> list[str]:
    from bridgegen.scenario.language.criteria import in_words, read_criterion

    return [in_words(read_criterion(record)) for record in given]


def _kept_odd(given: str | PathLike[str] | Mapping[str, Any] | None) -> dict[str, Any] | None:
    """Return an ODD as plain data, of a file's path or such data."""
    if given is None or isinstance(given, Mapping):
        return None if given is None else dict(given)
    from bridgegen.scenario.odd.reader import read_odd

    return read_odd(Path(given)).to_record()


def _kept_terms(terms: Mapping[str, float | None] | Iterable[str] | None) -> Any:
    if terms is None or isinstance(terms, Mapping):
        return None if terms is None else dict(terms)
    return dict.fromkeys(terms)


def _is_mapping(values: Any, *kinds: type) -> bool:
    return isinstance(values, dict) and all(
        isinstance(name, str) and isinstance(value, kinds) for name, value in values.items()
    )


def _is_number(value: Any, kind: type = Real) -> bool:
    return isinstance(value, kind) and not isinstance(value, bool)


def _flag_words(spelling: str, value: bool) -> list[str]:
    return [spelling if value else f"--no-{spelling.removeprefix('--')}"]


def _simulator_words(_: str, choice: SimulatorChoice) -> list[str]:
    named = [] if choice.name == EMBEDDED.name else ["--simulator", choice.name]
    return named + _repeated(_setting_texts)("--simulator-set", choice.settings)


def _kept_simulator(choice: SimulatorChoice | str | None) -> SimulatorChoice | None:
    return SimulatorChoice(choice) if isinstance(choice, str) else choice


def _screen_words(_: str, choice: SimulatorChoice) -> list[str]:
    return ["--screen", choice.name, *_repeated(_setting_texts)("--screen-set", choice.settings)]


TEXT = Form(str)
WHOLE = Form(
    int,
    keep=lambda value: int(value) if _is_number(value, Integral) else value,
    in_file=file_forms.WHOLE,
    valid=lambda value: _is_number(value, int),
    must="a whole number",
)
NUMBER = Form(
    float,
    words=lambda spelling, value: [spelling, repr(value)],
    in_file=file_forms.NUMBER,
    valid=_is_number,
    must="a number",
)
PATH = Form(Path, must="a path")

FLAG = Form(
    bool,
    words=_flag_words,
    in_file=file_forms.FLAG,
    valid=lambda value: isinstance(value, bool),
    must="True or False",
)
"""Form of a switch: ``--name``, ``--no-name``."""

NAMES = Form(
    str,
    lambda text, _: tuple(read_names(text)),
    _repeated(lambda names: [",".join(names)] if names else []),
    lambda names: None if names is None else tuple(names),
    file_forms.NAMES,
    lambda names: isinstance(names, tuple) and all(isinstance(name, str) for name in names),
    "names",
)
"""Form of a list of names: ``name,name``."""

FIXED = Form(
    list[str],
    read_fixed,
    _repeated(_fixed_texts),
    lambda values: dict(values or {}),
    file_forms.FIXED,
    lambda values: _is_mapping(values, Real, str),
    "values by name",
)
"""Form of fixed values: ``name=number`` or ``name=name``, repeated."""

SETTINGS = Form(
    list[str],
    read_settings,
    _repeated(_setting_texts),
    lambda values: dict(values or {}),
    file_forms.SETTINGS,
    lambda values: _is_mapping(values, Real, str),
    "values by name",
)
"""Form of settings: ``name=value``, repeated."""

TERMS = Form(
    str,
    read_terms,
    _repeated(_term_texts),
    _kept_terms,
    file_forms.TERMS,
    lambda terms: _is_mapping(terms, Real, type(None)),
    "a name, or metrics and their weights",
)
"""Form of weighted metrics: ``metric=weight,metric``."""

CRITERIA = Form(
    list[str],
    lambda texts, _: _kept_criteria(texts),
    _repeated(_criteria_texts),
    lambda given: _kept_criteria(given or ()),
    file_forms.CRITERIA,
    lambda given: isinstance(given, tuple),
    "criteria",
)
"""Form of criteria: ``ID: FORMULA``, a mapping in braces, or the path of a file; repeated."""

ODD = Form(
    Path,
    words=lambda spelling, odd: [spelling, str(odd["path"])],
    keep=lambda given: _kept_odd(given),
    valid=lambda odd: isinstance(odd, dict),
    must="the path of an OpenODD file",
)
"""Form of an operational design domain: its file's path; kept with all that it holds."""

SIMULATOR = Form(
    None,
    words=_simulator_words,
    keep=lambda choice: _kept_simulator(choice) or EMBEDDED,
    valid=lambda choice: isinstance(choice, SimulatorChoice),
    must="a simulator",
)
"""Form of a simulator: name and settings. Its place on this machine belongs to no run's command."""

SCREEN = Form(
    None,
    words=_screen_words,
    keep=lambda choice: _kept_simulator(choice),
    valid=lambda choice: isinstance(choice, SimulatorChoice),
    must="a simulator",
)
"""Form of the low-fidelity simulator, or none; like `SIMULATOR`."""

ANOTHER_SIMULATOR = replace(SCREEN, words=_simulator_words)
"""Form of another simulator, or none, as an option ``--simulator``."""
