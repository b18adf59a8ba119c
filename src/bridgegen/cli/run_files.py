"""Run files: the options of one or of several calls of a command as YAML.

Their keys are the command's options, without the dashes; there is no second list.
"""

import inspect
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_origin

import typer

from bridgegen.base.disk import write_whole
from bridgegen.base.errors import BridgeGenError, FileFormatError, InputError, StorageError
from bridgegen.cli.declared import with_parameters
from bridgegen.cli.groups import RENAMED_OPTIONS
from bridgegen.engine.options import SearchOptions, file_forms, options_of
from bridgegen.engine.options.file_forms import FileForm

if TYPE_CHECKING:  # the command line starts without them
    from bridgegen.scenario.language.plain_yaml import Document

Values = Mapping[str, Any]
"""Values of the parameters of the command ``search``, by name, as its parser returns them."""

SCENARIO, SAVE, CATALOGUE = "scenario", "save", "catalogue"
_HEADS = {"run", "runs"}
MOST_SEARCHED = 10_000
"""Length of a damaged file's beginning in which its first key is sought [bytes]."""

DATABASE = "run.sqlite"
"""The file that makes a folder a run's."""

_FORMS: Mapping[Any, FileForm] = {
    int: file_forms.WHOLE,
    float: file_forms.NUMBER,
    bool: file_forms.FLAG,
    str: file_forms.TEXT,
    Path: file_forms.TEXT,
    list[str]: file_forms.TEXTS,
    list[Path]: file_forms.PATHS,
}
_CRITERIA = "criteria"
_YAML = (".yaml", ".yml")

_CODE = {"algorithm", "detector", "ego", "egos", "drivers", "metrics", "worse_than"}
"""Options whose values are a path in front of a colon, or a path if they end in ``.fmu``."""

_FILES = {SCENARIO, "scenarios", "files", "exposure", "events"}
"""Options whose values are a name, or a path if they end like one or are a folder's."""


@dataclass(frozen=True)
class Key:
    """A key of a run: an option of ``search``, or its scenario.

    Attributes:
        name: of the parameter.
        form: of its value.
        help: what it means.
        is_path: whether its value is a path, relative to the file.
        limits: the least and the greatest value; None where there are none.
    """

    name: str
    form: FileForm
    help: str
    is_path: bool
    limits: tuple[int, int] | None = None


@dataclass(frozen=True)
class FiledRun:
    """A run of a run file.

    Attributes:
        name: in a file of several runs; empty in a file of one.
        values: its options.
    """

    name: str
    values: Values


def keys_of(command: Callable[..., Any], kind: type[Any] = SearchOptions) -> dict[str, Key]:
    """Return the keys of a run, by their spelling in a file.

    Args:
        command: that makes it.
        kind: the class of its declared options.
    """
    declared = {item.name: item for item in options_of(kind)}
    found = {}
    for name, parameter in inspect.signature(command).parameters.items():
        if name in (SAVE, CATALOGUE) or get_origin(parameter.annotation) is not Annotated:
            continue
        kind, info = get_args(parameter.annotation)
        types = {*get_args(kind)} - {NoneType} or {kind}
        option = declared.get(name)
        form = _FORMS[next(iter(types))]
        if name in ("simulator_set", "screen_set"):
            form = file_forms.SETTINGS
        elif option is not None and option.form.kind is not None:
            form = option.form.in_file
        # In Annotated, typer takes the first argument of Option for a spelling.
        words = [
            decl for decl in (info.default, *(info.param_decls or ())) if isinstance(decl, str)
        ]
        spelling = words[0].partition("/")[0][2:] if words else name.replace("_", "-")
        limits = option.limits if option else None
        found[spelling] = Key(name, form, info.help or "", bool(types & {Path, list[Path]}), limits)
    return found


def is_run_file(scenario: str) -> bool:
    """Return whether the first argument of ``search`` is a run file: by its top-level keys."""
    path = Path(scenario)
    if path.suffix.lower() not in (".yaml", ".yml") or not path.is_file():
        return False
    try:
        data = read_run_document(path).data
    except BridgeGenError:  # the reader of run files, or of scenario files, says what is wrong
        try:
            with path.open("rb") as file:
                return file.read(MOST_SEARCHED).lstrip().startswith((b"run:", b"runs:"))
        except OSError:
            return False
    return isinstance(data, dict) and bool(_HEADS & {*data}) and SCENARIO not in data


def read_run_document(path: Path) -> "Document":
    """Return the contents of a YAML file.

    Raises:
        FileFormatError: it cannot be read, or is no plain YAML.
    """
    from bridgegen.scenario.language.plain_yaml import MAX_BYTES, read_plain_yaml

    try:
        with path.open("rb") as file:
            # One byte more than allowed: the reader refuses a large file that is not read whole.
            return read_plain_yaml(file.read(MAX_BYTES + 1), str(path))
    except OSError as error:
        raise FileFormatError(f"cannot be read: {error.strerror} ({path})") from None


def read_runs(path: Path, keys: Mapping[str, Key], argument: str = SCENARIO) -> list[FiledRun]:
    """Return the runs of a run file.

    Raises:
        InputError: it breaks rules; all of them, with file and line.
    """
    from bridgegen.scenario.language.parameters import nearest

    document = read_run_document(path)
    data = document.data if isinstance(document.data, dict) else {}
    problems = [
        f"unknown key '{key}'{nearest(key, _HEADS) or '; known: run, runs'} ({document.at((key,))})"
        for key in data
        if key not in _HEADS
    ]
    found: list[FiledRun] = []
    if len(_HEADS & data.keys()) != 1:
        problems.append(f"a run file must have the key 'run' or the key 'runs' ({document.at(())})")
    elif "run" in data:
        found.append(
            FiledRun("", _read_run(document, ("run",), data["run"], keys, argument, problems))
        )
    elif not isinstance(data["runs"], dict) or not data["runs"]:
        problems.append(f"runs must be a mapping, NAME: OPTIONS ({document.at(('runs',))})")
    else:
        for name, item in data["runs"].items():
            # The name becomes a folder's: no separators, and no leading dot.
            if not name.replace("-", "").replace("_", "").replace(".", "").isalnum() or (
                name.startswith(".")
            ):
                problems.append(
                    "the name of a run must be a word of letters, digits, '-', '_' and '.', got "
                    f"'{name}' ({document.at(('runs', name))})"
                )
            place = ("runs", name)
            found.append(FiledRun(name, _read_run(document, place, item, keys, argument, problems)))
    if problems:
        raise InputError(*problems)
    return found


def _read_run(
    document: "Document",
    place: tuple[str, ...],
    data: object,
    keys: Mapping[str, Key],
    argument: str,
    problems: list[str],
) -> Values:
    from bridgegen.scenario.language.parameters import nearest

    label = ".".join(place)
    if not isinstance(data, dict):
        problems.append(f"{label} must be a mapping ({document.at(place)})")
        return {}
    values = {}
    for spelling, value in data.items():
        where = document.at((*place, spelling))
        key = keys.get(spelling) or keys.get(
            RENAMED_OPTIONS["suite"].get(f"--{spelling}", "").removeprefix("--")
        )
        if key is None:
            hint = nearest(spelling, keys) or f"; known: {', '.join(keys)}"
            problems.append(f"unknown key '{spelling}' in {label}{hint} ({where})")
            continue
        try:
            parsed = key.form.parse(value)
            if key.limits and not key.limits[0] <= parsed <= key.limits[1]:
                raise ValueError("must be {} to {}".format(*key.limits))
        except ValueError as error:
            problems.append(f"{label}.{spelling} {error}, got {value!r} ({where})")
            continue
        values[key.name] = _moved(key, parsed, lambda path: Path(document.place).parent / path)
    if argument not in data:
        problems.append(f"{label} must have the key '{argument}' ({document.at(place)})")
    return values


def _moved(key: Key, value: Any, move: Callable[[str], object]) -> Any:
    """Return a value with its path, if it holds one, moved to or from the file's folder."""
    if key.name == _CRITERIA:
        return [str(move(item)) if item.lower().endswith(_YAML) else item for item in value]
    if isinstance(value, list):
        return [_moved(key, item, move) for item in value]
    if key.is_path:
        return Path(str(move(str(value))))
    if not isinstance(value, str):
        return value
    from bridgegen.drivers import is_remote

    if is_remote(value):
        return value
    if key.name in _CODE:
        path, colon, what = value.rpartition(":")
        if path.endswith(".py"):
            return f"{move(path)}{colon}{what}"
        return str(move(value)) if value.endswith(".fmu") else value
    moved = str(move(value))
    is_file = value.lower().endswith((*_YAML, ".osc", ".xosc", ".csv"))
    is_path = is_file or Path(value).is_dir() or Path(moved).is_dir()
    # A name of the catalogue stays a name, also in a file of another folder.
    return moved if key.name in _FILES and is_path else value


def save_run(path: Path, values: Values, keys: Mapping[str, Key]) -> None:
    """Write the run file of a call.

    Args:
        path: of the file, new.
        values: that the call gave.
        keys: of its command.

    Raises:
        StorageError: the file exists, or cannot be written.
    """
    if path.exists():
        raise StorageError(f"{path}: exists already, and is not overwritten")
    write_whole(path, [_text(path, values, keys).encode()])


def is_recorded(out: Path, values: Values, keys: Mapping[str, Key]) -> bool:
    """Return whether a folder holds the run of some options; if not, record that it will.

    The record is a run file, ``OUT.yaml``.

    Args:
        out: the run's folder.
        values: its options.
        keys: of a run.

    Raises:
        StorageError: it is recorded with other options.
    """
    from bridgegen.scenario.language.plain_yaml import read_plain_yaml

    record = out.parent / f"{out.name}.yaml"
    text = _text(record, values, keys)
    if record.is_file():
        # Compared as data: comments and order that people have changed are no other options.
        if read_run_document(record).data != read_plain_yaml(text.encode(), "").data:
            raise StorageError(
                f"{record}: the run in {out} was begun with these other options; name another "
                "folder (out), or remove both"
            )
        return (out / DATABASE).is_file()
    out.parent.mkdir(parents=True, exist_ok=True)
    write_whole(record, [text.encode()])
    return False


def _text(path: Path, values: Values, keys: Mapping[str, Key]) -> str:
    """Return the run file of some options, with paths relative to its place."""
    import yaml

    folder = path.resolve().parent
    data = {}
    # In the order of the command's options, whatever the order of the call.
    for spelling, key in keys.items():
        if key.name in values:
            value = _moved(key, values[key.name], lambda name: os.path.relpath(name, folder))
            data[spelling] = key.form.plain(value)
    text: str = yaml.safe_dump({"run": data}, sort_keys=False, allow_unicode=True)
    return text


def schema(keys: Mapping[str, Key], argument: str = SCENARIO) -> dict[str, Any]:
    """Return the JSON Schema of run files."""
    properties = {}
    for spelling, key in keys.items():
        described = {"description": key.help, **key.form.schema}
        if key.limits:
            described |= {"minimum": key.limits[0], "maximum": key.limits[1]}
        properties[spelling] = described
    run = {
        "type": "object",
        "properties": properties,
        "required": [argument],
        "additionalProperties": False,
    }
    return {
        "$schema": "http://json-schema.org/draft-07/schema#",
        "$id": "urn:bridgegen:run",
        "title": "BridgeGen run file",
        "type": "object",
        "properties": {
            "run": {"$ref": "#/definitions/run"},
            "runs": {
                "type": "object",
                "minProperties": 1,
                "additionalProperties": {"$ref": "#/definitions/run"},
            },
        },
        "oneOf": [{"required": ["run"]}, {"required": ["runs"]}],
        "additionalProperties": False,
        "definitions": {"run": run},
    }


def with_run_files(
    several: Callable[[Path, list[FiledRun], Mapping[str, Key], Callable[[Values], Any]], None],
    kind: type[Any] = SearchOptions,
    argument: str = SCENARIO,
    every: Callable[[dict[str, Any], Mapping[str, Key], Callable[[Values], Any]], None]
    | None = None,
) -> Callable[[Callable[..., Any]], Callable[..., None]]:
    """Return what has a command take a run file in place of a scenario.

    Args:
        several: runs a file of several runs: of the file, its runs, the keys of a run, and the
            command of one.
        kind: the class of the command's declared options.
        argument: the name of what the command takes without a spelling.
        every: of a command with ``--catalogue``, runs all scenarios of the catalogue: of what was
            given, the keys of a run, and the command of one.
    """

    def decorate(command: Callable[..., Any]) -> Callable[..., None]:
        signature = inspect.signature(command)

        @wraps(command)
        def wrapper(context: typer.Context, **values: Any) -> None:
            keys = keys_of(command, kind)
            given = {
                name: value
                for name, value in values.items()
                # Only what the command line states overrides a file: its parser's defaults do not.
                if str(getattr(context.get_parameter_source(name), "name", "")) == "COMMANDLINE"
            }
            if every is not None and values.pop(CATALOGUE):
                del given[CATALOGUE]
                every(given, keys, lambda record: command(**{**values, **record}))
                return
            save = values.pop(SAVE)
            given.pop(SAVE, None)
            named = values[argument] or ""  # a job may take none
            first = named[0] if isinstance(named, list) else named
            path, filed = Path(first), is_run_file(first)
            runs = [FiledRun("", given)]
            if filed:
                # The argument was the file itself; the scenario is in it.
                del given[argument]
                read = read_runs(path, keys, argument)
                runs = [FiledRun(run.name, _over(run.values, given)) for run in read]
            # Written here and not by the command, which cannot tell what was given from defaults.
            if save is not None:
                if len(runs) > 1 or runs[0].name:
                    raise InputError("--save writes one run, and this file has several")
                save_run(save, runs[0].values, keys)
            if filed and runs[0].name:
                several(path, runs, keys, lambda record: command(**{**values, **record}))
            else:
                # What the parser returned holds all defaults, so that a run need only have what
                # differs.
                command(**{**values, **runs[0].values})

        context = inspect.Parameter(
            "context", inspect.Parameter.POSITIONAL_OR_KEYWORD, annotation=typer.Context
        )
        return with_parameters(wrapper, [context, *signature.parameters.values()])

    return decorate


def _over(values: Values, given: Values) -> dict[str, Any]:
    """Return a file's values with those of the command line over them; lists are joined."""
    joined = {
        name: [*values[name], *value]
        for name, value in given.items()
        if name in values and isinstance(value, list | tuple)
    }
    return {**values, **given, **joined}
