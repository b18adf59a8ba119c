"""How the value of an option is written in a run file (YAML), and read from one."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class FileForm:
    """How values of one type are written in a run file.

    Attributes:
        schema: of the value, as JSON Schema.
        parse: returns what the parser of the command line would return for a file's value; raises
            a ValueError with the rule that it breaks, "must be …".
        plain: returns the file's value for what that parser returned.
    """

    schema: dict[str, Any]
    parse: Callable[[Any], Any]
    plain: Callable[[Any], Any] = lambda parsed: parsed


def _typed(kind: type | tuple[type, ...], what: str) -> Callable[[Any], Any]:
    def parse(value: Any) -> Any:
        # A Boolean is an int to Python, and no whole number to a user.
        if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool):
            raise ValueError(f"must be {what}")
        return value

    return parse


def _number(value: Any) -> float:
    return float(_typed((int, float), "a number")(value))


def _word(value: Any) -> str:
    """Return a text; a number stands for its digits, as the id of a junction may."""
    if isinstance(value, bool) or not isinstance(value, str | int | float) or value == "":
        raise ValueError("must be a text")
    return str(value)


def _words(value: Any) -> list[str]:
    if isinstance(value, list):
        return [_word(item) for item in value]
    return [_word(value)]


def _pairs(value: Any, text: Callable[[Any], str]) -> list[str]:
    if not isinstance(value, dict):
        raise ValueError("must be a mapping, NAME: VALUE")
    wrong = [name for name, item in value.items() if not isinstance(item, bool | int | float | str)]
    if wrong or "" in value.values():
        raise ValueError("must be a mapping of names to numbers or texts")
    return [f"{name}={text(item)}" for name, item in value.items()]


def _setting(text: str) -> Any:
    try:
        value = json.loads(text)
    except json.JSONDecodeError:
        return text
    return value if isinstance(value, bool | int | float | str) else text


def _fixed(text: str) -> Any:
    try:
        return float(text)
    except ValueError:
        return text


def _split(pairs: list[str], value: Callable[[str], Any]) -> dict[str, Any]:
    parts = [pair.partition("=") for pair in pairs]
    return {name: value(text) for name, _, text in parts}


def _criteria(value: Any) -> list[str]:
    """Return criteria as texts; mappings become JSON, which is YAML in braces."""
    given = value if isinstance(value, list) else [value]
    if not all(isinstance(item, str | dict) for item in given):
        raise ValueError("must be a list of criteria: mappings, or texts ID: FORMULA")
    return [
        item if isinstance(item, str) else json.dumps(item, ensure_ascii=False) for item in given
    ]


def _plain_criteria(texts: list[str]) -> list[Any]:
    from bridgegen.scenario.language.plain_yaml import read_plain_yaml

    return [
        read_plain_yaml(text.encode(), "--criterion").data if text.startswith("{") else text
        for text in texts
    ]


def _terms(value: Any) -> str:
    if isinstance(value, dict):
        weights = {_word(name): w if w is None else _number(w) for name, w in value.items()}
        return ",".join(name if w is None else f"{name}={w!r}" for name, w in weights.items())
    return ",".join(_words(value))


def _plain_terms(text: str) -> Any:
    parts = [part.partition("=") for part in text.split(",")]
    if any(equals for _, equals, _ in parts):
        return {name.strip(): float(w) if equals else None for name, equals, w in parts}
    names = [name.strip() for name, _, _ in parts]
    return names[0] if len(names) == 1 else names


_TEXT = {"type": ["string", "number"]}
_TEXTS = {"anyOf": [_TEXT, {"type": "array", "items": _TEXT}]}
_PAIRS = {"type": "object", "additionalProperties": {"type": ["boolean", "number", "string"]}}
_WEIGHTED = {"type": "object", "additionalProperties": {"type": ["number", "null"]}}

TEXT = FileForm(_TEXT, _word, str)
WHOLE = FileForm({"type": "integer"}, _typed(int, "a whole number"))
NUMBER = FileForm({"type": "number"}, _number)
FLAG = FileForm({"type": "boolean"}, _typed(bool, "true or false"))
TEXTS = FileForm(_TEXTS, _words, list)
PATHS = FileForm(_TEXTS, _words, lambda paths: [str(path) for path in paths])
NAMES = FileForm(
    _TEXTS,
    lambda value: ",".join(_words(value)),
    lambda text: [name for part in text.split(",") if (name := part.strip())],
)
_CRITERION = {"anyOf": [{"type": "string"}, {"type": "object"}]}
CRITERIA = FileForm(
    {"anyOf": [_CRITERION, {"type": "array", "items": _CRITERION}]}, _criteria, _plain_criteria
)
FIXED = FileForm(
    _PAIRS,
    lambda value: _pairs(
        value, lambda value: repr(value) if isinstance(value, float) else str(value)
    ),
    lambda pairs: _split(pairs, _fixed),
)
SETTINGS = FileForm(
    _PAIRS, lambda value: _pairs(value, json.dumps), lambda pairs: _split(pairs, _setting)
)
TERMS = FileForm({"anyOf": [_WEIGHTED, *_TEXTS["anyOf"]]}, _terms, _plain_terms)
