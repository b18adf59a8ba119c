"""A folder that belongs to one job: made for it, or of an earlier call with the same settings."""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from bridgegen.base.disk import write_whole
from bridgegen.base.errors import StorageError
from bridgegen.base.records import parse_json, read_bytes


def claim(
    folder: Path,
    settings: Mapping[str, Any],
    *,
    file: str,
    pieces: str,
    belongs: Callable[[str], bool] = lambda name: False,
    what: str,
) -> None:
    """Make a job's folder, or find the one that an earlier call with the same settings has made.

    Args:
        folder: of the job.
        settings: what its results depend on, as JSON's types.
        file: name of the file that holds them.
        pieces: name of the folder of its results, which is made.
        belongs: whether another name is one of the job's files, too.
        what: the job, for messages: "a map".

    Raises:
        StorageError: the folder holds another job or something else, or cannot be written.
    """
    made = json.loads(json.dumps(settings))
    path = folder / file
    try:
        (folder / pieces).mkdir(parents=True, exist_ok=True)
        before = parse_json(read_bytes(path)) if path.exists() else None
        names = [one.name for one in folder.iterdir()]
    except OSError as error:
        raise StorageError(f"{folder}: cannot be written: {error.strerror}") from None
    except ValueError as error:
        raise StorageError(f"{path}: is damaged: {error}") from None
    if before is None:
        if any(name not in (file, pieces) and not belongs(name) for name in names):
            raise StorageError(f"{folder}: holds something else than {what}, choose another")
        write_whole(path, [json.dumps(made, indent=1).encode()])
    elif before != made:
        known = before if isinstance(before, dict) else {}
        differs = [name for name in {**made, **known} if known.get(name) != made.get(name)]
        raise StorageError(
            f"{folder}: holds another {what.removeprefix('a ')} (it differs in "
            f"{', '.join(differs)}); choose another folder (--out), or remove it"
        )
