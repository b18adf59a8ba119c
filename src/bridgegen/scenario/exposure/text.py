"""An exposure's file as text, and where one is written."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from bridgegen.base.disk import write_whole
from bridgegen.base.errors import StorageError

_HEAD = "# Fitted by 'bridgegen fit'. A later fit replaces this file."


def exposure_text(data: Mapping[str, Any]) -> str:
    """Return a file's data as YAML; numbers keep all their digits."""
    body = yaml.safe_dump(
        dict(data), sort_keys=False, allow_unicode=True, width=100, default_flow_style=None
    )
    return f"{_HEAD}\n{body}"


def refuse_other_file(path: Path) -> None:
    """Refuse a place where something else is than an earlier fit.

    Raises:
        StorageError: there is one, or it cannot be read.
    """
    try:
        with path.open("rb") as file:
            ours = file.read(len(_HEAD)) == _HEAD.encode()
    except FileNotFoundError:
        return
    except OSError as error:
        raise StorageError(f"{path}: cannot be written: {error.strerror}") from None
    if not ours:
        raise StorageError(f"{path}: exists already, is no fit of ours, and is not overwritten")


def write_exposure(path: Path, text: str) -> None:
    """Write the file of a fit; an earlier one is replaced.

    Raises:
        StorageError: something else is there, or it cannot be written.
    """
    refuse_other_file(path)
    write_whole(path, [text.encode()])
