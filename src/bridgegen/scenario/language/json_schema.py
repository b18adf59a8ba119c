"""The shape of scenario files as JSON Schema, which editors complete and check from.

Made of the sections' own declarations, and of those rules between keys that need no other file. A
file that the schema refuses is refused by the reader; the reader knows more (units, names, places).
JSON Schema of draft 7, which every editor knows.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from types import NoneType
from typing import Any, Literal, get_args

from bridgegen.base.disk import write_whole
from bridgegen.base.errors import StorageError, UnknownNameError
from bridgegen.scenario.language.exposure_schema import ExposureFile
from bridgegen.scenario.language.kinds import FLOAT, KINDS
from bridgegen.scenario.language.parameters import UNITS
from bridgegen.scenario.language.reader import names
from bridgegen.scenario.language.roads import KNOBS, Template
from bridgegen.scenario.language.schema import FragmentFile, ScenarioFile
from bridgegen.scenario.language.schema_types import ShapedSection
from bridgegen.scenario.language.story import CONDITIONS
from bridgegen.scenario.language.story_schema import ACTIONS

FILE = "bridgegen.schema.json"
"""File of the JSON Schema that ``bridgegen new`` writes."""

Kind = Literal["scenario", "fragment", "exposure"]
_MODELS: dict[Kind, type[ShapedSection]] = {
    "scenario": ScenarioFile,
    "fragment": FragmentFile,
    "exposure": ExposureFile,
}
_ID = "urn:bridgegen:"
_HEAD = 1000
_NULL = {"type": "null"}


def schema(kind: Kind = "scenario") -> dict[str, Any]:
    """Return the JSON Schema of scenario files, of fragments that they include, or of exposures."""
    model = _MODELS[kind]
    found = model.model_json_schema(ref_template="#/definitions/{model}")
    sections = found.pop("$defs")
    sections |= {model.__name__: found}
    _between_keys(sections)
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "$id": f"{_ID}{kind}",
        "title": f"BridgeGen {kind}",
        **_plain(sections.pop(model.__name__)),
        "definitions": {name: _plain(section) for name, section in sections.items()},
    }


def schema_text(kind: Kind = "scenario") -> str:
    """Return the JSON Schema as a file holds it."""
    return as_text(schema(kind))


def as_text(made: Mapping[str, Any]) -> str:
    """Return a JSON Schema as a file holds it."""
    return json.dumps(made, indent=2, ensure_ascii=False) + "\n"


def schema_of(kind: str) -> dict[str, Any]:
    """Return the JSON Schema of a kind of files.

    Raises:
        UnknownNameError: no such kind.
    """
    for arg in get_args(Kind):
        if kind == arg:
            return schema(arg)
    raise UnknownNameError("kind of files", kind, (*get_args(Kind), "run", "safety-case"))


def refuse_other_schema(path: Path) -> None:
    """Refuse a place where something else is than an earlier schema of ours.

    Raises:
        StorageError: there is one, or the folder cannot be read.
    """
    try:
        with path.open("rb") as file:
            ours = f'"$id": "{_ID}'.encode() in file.read(_HEAD)
    except FileNotFoundError:
        return
    except OSError as error:
        raise StorageError(f"{path}: cannot be written: {error.strerror}") from None
    if not ours:
        raise StorageError(f"{path}: exists already, is no schema of ours, and is not overwritten")


def write_schema(path: Path, made: Kind | Mapping[str, Any] = "scenario") -> None:
    """Write a JSON Schema, made already or of a kind of files; an earlier one is replaced.

    Raises:
        StorageError: something else is there, or it cannot be written.
    """
    refuse_other_schema(path)
    write_whole(path, [(schema_text(made) if isinstance(made, str) else as_text(made)).encode()])


def _plain(group: Any) -> Any:
    """Return a part without pydantic's titles and empty defaults, and as draft 7 has it.

    There, what stands beside a ``$ref`` does not count.
    """
    if isinstance(group, list):
        return [_plain(each) for each in group]
    if not isinstance(group, dict):
        return group
    kept = {
        key: {name: _plain(each) for name, each in value.items()}
        if key == "properties"
        else _plain(value)
        for key, value in group.items()
        if key != "title" and not (key == "default" and isinstance(value, dict | list | NoneType))
    }
    if "$ref" in kept and len(kept) > 1:
        kept = {"allOf": [{"$ref": kept.pop("$ref")}], **kept}
    return kept


def _between_keys(sections: dict[str, Any]) -> None:
    """Add rules between the keys of a section, as far as a schema can express them."""
    for name in {"ParameterSection", "DerivedSection"} & sections.keys():
        unit = sections[name]["properties"]["unit"]
        unit.pop("anyOf", None)
        unit |= {
            "enum": list(UNITS),
            "description": ", ".join(f"{u} {w}" for u, w in UNITS.items()),
        }
    if "ParameterSection" in sections:
        sections["ParameterSection"]["allOf"] = [_of_kind(kind) for kind in KINDS]
    for section in sections.values():
        if "parameters" in section["properties"]:
            for key in {"parameters", "derived"} & section["properties"].keys():
                section["properties"][key]["propertyNames"] = {"pattern": "^[a-z][a-z0-9_]{0,63}$"}
    if "ScenarioFile" not in sections:
        return
    scenario = sections["ScenarioFile"]
    for key in ("participants", "events"):
        scenario["properties"][key]["propertyNames"] = {"pattern": "^[A-Za-z_][A-Za-z0-9_]*$"}
    scenario["properties"]["participants"]["required"] = ["ego"]
    scenario["properties"]["include"]["items"] = {
        "anyOf": [{"enum": list(names("fragment"))}, {"type": "string", "pattern": r"\S"}]
    }
    scenario["allOf"] = [_measures(template) for template in KNOBS]
    for key, knob in _knobs().items():
        sections["RoadsSection"]["properties"][key]["description"] = knob
    sections["WaypointSection"]["allOf"] = [
        _if_there("point", {"leg": _NULL, "way": _NULL}),
    ]
    sections["ParticipantSection"] |= {
        "anyOf": [{"required": [key]} for key in ("start", "path", "place_by")],
        "allOf": [
            _if_there("place_by", {"start": _NULL, "end": _NULL, "path": {"maxItems": 0}}),
        ],
        "dependencies": {"place_by": ["places"], "places": ["place_by"]},
    }
    sections["LaneChangeSection"]["anyOf"] = [{"required": ["time"]}, {"required": ["distance"]}]
    sections["LaneChangeSection"]["properties"]["lanes"]["not"] = {"const": 0}
    sections["EventSection"] |= {
        "anyOf": [{"required": [key]} for key in ACTIONS],
        "allOf": [
            {"anyOf": [{"required": ["participant"]}, {"required": ["weather"]}]},
            _if_there("weather", {"participant": _NULL}),
            _if_there("rate", {"time": _NULL, "distance": _NULL}),
            _if_there("jerk", {"rate": {"not": _NULL}, "shape": {"const": "linear"}}),
            _if_there("time", {"distance": _NULL}),
        ],
        "dependencies": {"jerk": ["rate"]},
    }
    condition = sections["ConditionSection"]
    condition["properties"]["kind"]["description"] = "; ".join(
        f"{kind} [{condition_kind.unit}] {condition_kind.rule}: {condition_kind.meaning}"
        for kind, condition_kind in CONDITIONS.items()
    )
    condition["anyOf"] = [{"required": ["kind"]}, {"required": ["all"]}]
    condition["allOf"] = [_condition(kind) for kind in CONDITIONS]


def _of_kind(kind: str) -> dict[str, Any]:
    """Return what a kind of parameter needs, and what it does not have."""
    is_it = {"properties": {"kind": {"const": kind}}, "required": ["kind"]}
    if kind == FLOAT.name:
        is_it = {"properties": {"kind": {"const": kind}}}
    return {"if": is_it, "then": KINDS[kind].schema()}


def _if_there(key: str, then: Mapping[str, Any]) -> dict[str, Any]:
    """Return the rule for some keys that depends on another one's value."""
    there = {"properties": {key: {"not": _NULL}}, "required": [key]}
    return {"if": there, "then": {"properties": dict(then)}}


def _condition(kind: str) -> dict[str, Any]:
    """Return what a kind of condition needs, and what it does not have."""
    pair, after = CONDITIONS[kind].pair, kind in ("after", "began")
    needs = ["to"] * pair + ["event"] * after
    others = {"to": pair, "event": after}
    without = {key: _NULL for key, has in others.items() if not has}
    there = {
        "properties": {"kind": {"const": kind}, "all": {"maxItems": 0}},
        "required": ["kind"],
    }
    return {"if": there, "then": {"required": needs, "properties": without}}


def _measures(template: Template) -> dict[str, Any]:
    """Return the rule that a template has its own measures, and no others."""
    others = sorted({name for knobs in KNOBS.values() for name in knobs} - {*KNOBS[template]})
    without = {"properties": dict.fromkeys(others, _NULL)}
    is_it = {"properties": {"template": {"const": template}}, "required": ["template"]}
    return {"if": is_it, "then": {"properties": {"roads": without}}}


def _knobs() -> dict[str, str]:
    """Return what each measure is: unit, usual value, range; by template where they differ."""
    found: dict[str, dict[str, list[str]]] = {}
    for template, knobs in KNOBS.items():
        for name, knob in knobs.items():
            text = (
                f"[{knob.unit}] usually {knob.usual:g}, {knob.low:g} to {knob.high:g}. {knob.why}"
            )
            found.setdefault(name, {}).setdefault(text, []).append(template)
    return {
        name: " ".join(f"{', '.join(where)}: {text}" for text, where in texts.items())
        if len(texts) > 1
        else next(iter(texts))
        for name, texts in found.items()
    }
