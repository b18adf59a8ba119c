"""Writes the schema of the protocol for drivers in other processes, out of what drivers are given.

python docs/make_protocol.py
"""

import inspect
import json
import re
import types
import typing
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.drivers import interface
from bridgegen.drivers.interface import WANTS, Observation, Scene
from bridgegen.drivers.remote import messages

FILE = Path(messages.__file__).with_name("protocol.json")

ABOUT = (
    "Messages between BridgeGen and a driver in another process, version 1. A message is a map in"
    " msgpack, behind its length: four bytes, unsigned, little-endian, at most 67108864. Who "
    "answers hello in JSON gets JSON from then on: arrays are nested lists there, numbers that "
    "are not finite the texts Infinity, -Infinity and NaN, and an answer has at most 16777216 "
    "bytes. BridgeGen sends hello, reset and act; the driver answers each before the next is "
    "sent: hello, ready, and control or trajectory; or error. The end of the stream is the end. "
    "Readers ignore keys that they do not know. 'dtype' and 'shape' beside a $ref say what an "
    "array must be; letters stand for sizes: N scenarios, M other participants, P points of the "
    "route, H instants of the history, W ways of a participant, Q pieces of the map nearby, L "
    "lights, R road networks, K and C and V others. SI units and radians."
)

_ENTRY = re.compile(r"^ {4}(\w+): (.*?)(?=^ {4}\w+: |\Z)", re.M | re.S)
_ARRAY = re.compile(r"``\(([^`]*)\)`` (float64|int64|int32|int8|bool)")
_PLAIN: dict[Any, str] = {float: "number", int: "integer", str: "string", bool: "boolean"}


def schema() -> dict[str, Any]:
    """Return the schema."""
    defined: dict[str, Any] = {"array": _array()}
    for kind in (Scene, Observation):
        _define(kind, defined)
    text = {"type": "string"}
    version = {"const": messages.PROTOCOL, "description": "version of the protocol"}
    answers = {
        "hello": _message(
            "hello",
            protocol=version,
            name={**text, "description": "of the driver, for people"},
            wants={
                "type": ["array", "null"],
                "items": {"enum": list(WANTS)},
                "description": "; ".join(f"{name}: {what}" for name, what in WANTS.items()),
            },
            period={
                "type": ["number", "null"],
                "exclusiveMinimum": 0,
                "description": "[s] between two plans; null: asked at every instant",
            },
            max_rows={
                "type": ["integer", "null"],
                "minimum": 1,
                "description": "how many scenarios it can drive at once; null: any number",
            },
            keeps_maps={
                "type": ["boolean", "null"],
                "description": "whether it keeps road maps: resets then have 'maps'",
            },
        ),
        "ready": _message("ready"),
        "control": _message(
            "control",
            acceleration=_numbers("(N,)", "demanded, forward [m/s²]"),
            curvature=_numbers("(N,)", "of the rear axle's path [1/m], left is positive"),
            demand=_numbers("(N,)", "not 0: it demands that a human takes over; may be left out"),
        ),
        "trajectory": _message(
            "trajectory",
            time=_numbers("(K,) or (N, K)", "[s] from now on, increasing"),
            x=_numbers("(N, K)", "rear axle's centre [m]"),
            y=_numbers("(N, K)", "[m]"),
            h=_numbers("(N, K)", "heading [rad]"),
            v=_numbers("(N, K)", "forward speed [m/s]"),
        ),
        "error": _message(
            "error",
            message={**text, "description": "in one line: it is shown to the user"},
            kind={
                "enum": [messages.RAISED, messages.NONSENSE],
                "description": "the driver failed, or what it answered is no control",
            },
        ),
    }
    answers["control"]["required"] = ["type", "acceleration", "curvature"]
    answers["hello"]["required"] = ["type", "protocol", "name"]
    answers["error"]["required"] = ["type", "message"]
    requests = {
        "hello": _message(
            "hello", protocol=version, software={**text, "description": "name and version"}
        ),
        "reset": _message(
            "reset",
            n={"type": "integer", "minimum": 1, "description": "N, how many scenarios follow"},
            scene={"$ref": "#/$defs/Scene"},
            maps={
                "type": "object",
                "description": "if the driver keeps them: the scene's maps; its own are none",
                "properties": {
                    "kept": {
                        "type": "integer",
                        "minimum": 0,
                        "description": "how many it keeps, the first ones",
                    },
                    "new": {
                        "type": "array",
                        "items": {"$ref": "#/$defs/RoadMap"},
                        "description": "those that follow them",
                    },
                    "numbers": {
                        "type": "array",
                        "items": {"type": "integer", "minimum": 0},
                        "description": "which of all these the scene has, in its order, from 0 on",
                    },
                },
                "required": ["kept", "new", "numbers"],
            },
        ),
        "act": _message("act", observation={"$ref": "#/$defs/Observation"}),
    }
    requests["reset"]["required"] = ["type", "n", "scene"]
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "BridgeGen's protocol for drivers in other processes",
        "description": ABOUT,
        "oneOf": [{"$ref": "#/$defs/request"}, {"$ref": "#/$defs/answer"}],
        "$defs": {
            "request": {"oneOf": [{"$ref": f"#/$defs/request_{name}"} for name in requests]},
            "answer": {"oneOf": [{"$ref": f"#/$defs/answer_{name}"} for name in answers]},
            **{f"request_{name}": one for name, one in requests.items()},
            **{f"answer_{name}": one for name, one in answers.items()},
            **defined,
        },
    }


def _array() -> dict[str, Any]:
    return {
        "type": "object",
        "description": "an array, in C order",
        "properties": {
            "dtype": {"enum": list(messages.DTYPES)},
            "shape": {
                "type": "array",
                "items": {"type": "integer", "minimum": 0},
                "maxItems": messages.MAX_DIMENSIONS,
            },
            "data": {
                "description": "msgpack's bin: the elements, little-endian; bool: a byte, 0 or 1"
            },
        },
        "required": ["dtype", "shape", "data"],
    }


def _message(of: str, /, **properties: Any) -> dict[str, Any]:
    properties = {"type": {"const": of}, **properties}
    return {"type": "object", "properties": properties, "required": list(properties)}


def _numbers(shape: str, description: str) -> dict[str, Any]:
    return {
        "$ref": "#/$defs/array",
        "dtype": "any but bool",
        "shape": shape,
        "description": description,
    }


def _define(kind: Any, defined: dict[str, Any]) -> None:
    """Add a dataclass, and those that it holds."""
    text = inspect.getdoc(kind) or ""
    said = dict(_ENTRY.findall(text[text.index("Attributes:") :] + "\n"))
    hints = typing.get_type_hints(kind, vars(interface))
    properties = {}
    for one in fields(kind):
        description = " ".join(said[one.name].split()).removesuffix(".")
        properties[one.name] = {
            **_typed(hints[one.name], description, defined),
            "description": description,
        }
    defined[kind.__name__] = {
        "type": "object",
        "description": text.splitlines()[0],
        "properties": properties,
        "required": list(properties),
    }


def _typed(hint: Any, description: str, defined: dict[str, Any]) -> dict[str, Any]:
    if hint in _PLAIN:
        return {"type": _PLAIN[hint]}
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin in (typing.Union, types.UnionType):
        (inner,) = (one for one in arguments if one is not type(None))
        return {"anyOf": [_typed(inner, description, defined), {"type": "null"}]}
    if origin is tuple:
        return {"type": "array", "items": _typed(arguments[0], description, defined)}
    if is_dataclass(hint):
        if hint.__name__ not in defined:
            _define(hint, defined)
        return {"$ref": f"#/$defs/{hint.__name__}"}
    assert origin is np.ndarray or hint is np.ndarray, hint
    found = _ARRAY.search(description)
    assert found, description
    return {"$ref": "#/$defs/array", "dtype": found[2], "shape": f"({found[1]})"}


def text() -> str:
    """Return the file's text."""
    return json.dumps(schema(), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    FILE.write_text(text(), "utf-8")
