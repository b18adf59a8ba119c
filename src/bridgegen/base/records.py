"""Records of a run as JSON files, which are untrusted when they are read."""

import json
import math
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn, TypeVar

from pydantic import BaseModel, ValidationError

from bridgegen.base.errors import FileFormatError, InputError, StorageError

Model = TypeVar("Model", bound=BaseModel)

MOST_BYTES = 2**26
"""Maximum size of a record; BridgeGen writes far smaller ones."""


def parse_json(text: str | bytes) -> Any:
    """Return the value of a JSON text, under the rules of BridgeGen's records.

    Raises:
        ValueError: it is not JSON, contains a number that is not finite, an integer of more than
            64 bits or a lone surrogate, or is nested too deeply.
    """
    try:
        value = json.loads(text, parse_constant=_refuse, parse_float=_finite, parse_int=_whole)
        json.dumps(value, ensure_ascii=False).encode()  # fails at a lone surrogate
    except RecursionError:
        raise ValueError("it is nested too deeply") from None
    return value


def read_bytes(path: Path) -> bytes:
    """Return the content of a record.

    Raises:
        OSError: it cannot be read.
        ValueError: it is not a regular file, or too large.
    """
    kind = path.stat().st_mode
    if not stat.S_ISREG(kind) and not stat.S_ISDIR(kind):  # the system refuses a folder
        raise ValueError("it is not a regular file")
    with path.open("rb") as file:
        data = file.read(MOST_BYTES + 1)
    if len(data) > MOST_BYTES:
        raise ValueError(f"it is larger than {MOST_BYTES >> 20} MiB")
    return data


def _refuse(name: str) -> NoReturn:
    raise ValueError(f"numbers must be finite, got {name}")


def _finite(text: str) -> float:
    value = float(text)
    return value if math.isfinite(value) else _refuse(text[:40])


def _whole(text: str) -> int:
    if len(text) > 20 or not -(2**63) <= int(text) < 2**64:
        raise ValueError(f"whole numbers must have at most 64 bits, got {text[:40]}")
    return int(text)


def read_model(
    path: Path, model: type[Model], not_ours: Callable[[Path, str], FileFormatError]
) -> Model | None:
    """Return a record; None if the file does not exist.

    Args:
        path: of the file.
        model: its schema.
        not_ours: returns the error for another kind of file, from the path and a reason.

    Raises:
        FileFormatError: its content does not fit the schema.
        StorageError: it cannot be read.
    """
    try:
        data = read_bytes(path)
        record = model.model_validate_json(data, strict=True)
        parse_json(data)  # rules that the schema does not contain, for every value
        return record
    except FileNotFoundError:
        return None
    except OSError as error:
        raise StorageError(f"{path}: cannot be read: {error.strerror}") from None
    except ValidationError as error:
        first = error.errors(include_input=False, include_url=False)[0]
        place = ".".join(map(str, first["loc"]))
        raise not_ours(path, f"{place}: {first['msg']}" if place else first["msg"]) from None
    except InputError as error:
        raise not_ours(path, "; ".join(error.problems)) from None
    except ValueError as error:
        raise not_ours(path, str(error)) from None
