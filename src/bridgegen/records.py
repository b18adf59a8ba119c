"""Records of a run that are kept as JSON, and read again as untrusted."""

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from bridgegen.errors import FileFormatError, InputError, StorageError

Model = TypeVar("Model", bound=BaseModel)


def read_model(
    path: Path, model: type[Model], not_ours: Callable[[Path, str], FileFormatError]
) -> Model | None:
    """Return a record; None where there is no file.

    Args:
        path: of the file.
        model: what it holds.
        not_ours: makes the error of a file that holds something else, from the path and why.

    Raises:
        FileFormatError: it holds something else.
        StorageError: it cannot be read.
    """
    try:
        return model.model_validate_json(path.read_bytes(), strict=True)
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
