"""A folder that belongs to one job: new, or of an earlier call with the same settings."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from bridgegen.base.disk import write_whole
from bridgegen.base.errors import StorageError
from bridgegen.base.records import parse_json, read_bytes

MOST_SHOWN = 1000
"""Largest number of characters of one setting in a message."""

CHANGED = ("algorithm ", "scenario ", "map", "files of drivers")
"""Prefixes of the names of settings that are digests of files: only that they changed is
reported."""


def claim(
    folder: Path,
    settings: Mapping[str, Any],
    *,
    file: str,
    what: str,
    pieces: str,
    kept: str = "*",
    belongs: Callable[[str], bool] = lambda name: False,
    grows: bool = False,
    defaults: Mapping[str, Any] | None = None,
) -> None:
    """Make a job's folder, or find the one that an earlier call with the same settings has made.

    Args:
        folder: of the job.
        settings: what its results depend on, as JSON's types.
        file: name of the file that holds them.
        what: the job, for messages: "map".
        pieces: name of the folder of its results, which is made.
        kept: pattern of a result there; until there is one, settings may change.
        belongs: whether another name in the folder is one of the job's files, too.
        grows: whether a call may name more settings than before, or fewer: a grid's axes.
        defaults: of settings that did not exist when the folder may have been made.

    Raises:
        StorageError: the folder holds another job or something else, or cannot be written.
    """
    # Through JSON, as the file's are: tuples become lists, and keys texts, so that equal settings
    # compare equal.
    made: dict[str, Any] = json.loads(json.dumps(settings))
    path = folder / file
    try:
        before = parse_json(read_bytes(path)) if path.exists() else None
        if before is not None and not isinstance(before, dict):
            raise ValueError("it must hold an object")
        names = [item.name for item in folder.iterdir()] if folder.exists() else []
        has_results = any((folder / pieces).glob(kept))
        others = any(name != pieces and not belongs(name) for name in names)
        if before is None and (has_results or others):
            raise StorageError(
                f"{folder}: is not empty and holds no {what}, so it is left alone; choose another "
                "folder (--out)"
            )
        (folder / pieces).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(f"{folder}: cannot be written: {error.strerror}") from None
    except ValueError as error:
        raise StorageError(f"{path}: the file is damaged: {error}") from None
    # Until there is a result, other settings contradict nothing: a first call with a mistake need
    # not be cleared away by hand.
    known: dict[str, Any] = before if before and has_results else {}
    # A folder of an earlier version lacks settings that came later; they had their defaults then.
    compared = {**json.loads(json.dumps(defaults or {})), **known} if known else {}
    asked = made if grows else {**made, **known}
    differ = [
        name
        for name in asked
        if known and compared.get(name) != made.get(name) and (name in compared or not grows)
    ]
    if differ:
        words = ", ".join(_difference(item, compared.get(item), made.get(item)) for item in differ)
        raise StorageError(
            f"{folder}: holds a {what} with other settings, and the results of both cannot be one: "
            f"{words}; choose another folder (--out), or remove it"
        )
    if before != (now := {**known, **made}):
        write_whole(path, [json.dumps(now, indent=1).encode()])


def _difference(name: str, before: Any, now: Any) -> str:
    if name.startswith(CHANGED):
        return f"{name} has changed"
    if isinstance(before, dict) and isinstance(now, dict):
        keys = [key for key in {**before, **now} if before.get(key) != now.get(key)]
        before, now = ({key: record.get(key) for key in keys} for record in (before, now))
    return f"{name} was {_shown(before)}, is {_shown(now)}"


def _shown(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= MOST_SHOWN else f"{text[:MOST_SHOWN]} …"
