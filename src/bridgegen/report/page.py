"""Puts the page together: template, style, scripts, Plotly and the data, all in one file."""

import html
import importlib.util
import os
import re
from collections.abc import Iterable
from functools import cache
from importlib.resources import files
from pathlib import Path

from bridgegen.errors import BridgeGenError, StorageError
from bridgegen.report.data import ReportData
from bridgegen.report.payload import to_json

SCRIPTS = (
    "page.js", "geometry.js", "view.js", "scene.js", "curves.js", "player.js", "parallel.js",
    "charts.js",
)  # fmt: skip
"""Joined in this order into one function scope; ``page.js`` holds what the others share."""


def write_report(path: Path, data: ReportData) -> None:
    """Write the report as one HTML file that needs nothing else to be opened.

    A reader never sees half a file: it is written beside its place and then renamed.

    Raises:
        StorageError: the file cannot be written (no such folder, read-only, disk full).
    """
    _write_atomically(Path(path), _chunks(data))


def _chunks(data: ReportData) -> list[bytes]:
    """Return the page in pieces; what is put in is never searched for placeholders again."""
    title = f"{data.summary.scenario}: {data.summary.title} – BridgeGen"
    fill = {
        "title": html.escape(title).encode("utf-8", "replace"),
        "css": _own("page.css"),
        "data": to_json(data).encode("ascii"),
        "scripts": b"\n".join(_own(name) for name in SCRIPTS),
        "plotly": _plotly(),
    }
    parts = re.split(rb"\{\{(\w+)\}\}", _own("page.html"))
    return [fill[part.decode()] if i % 2 else part for i, part in enumerate(parts)]


@cache
def _own(name: str) -> bytes:
    return files("bridgegen.report").joinpath(name).read_bytes()


@cache
def _plotly() -> bytes:
    """Return Plotly's JavaScript from the installed package, without importing the package."""
    spec = importlib.util.find_spec("plotly")
    origin = spec.origin if spec else None
    script = Path(origin or "plotly").parent / "package_data" / "plotly.min.js"
    try:
        text = script.read_bytes()
    except OSError as error:
        raise BridgeGenError(
            f"the report needs plotly's plotly.min.js, but {script}: {error.strerror}; "
            "reinstall plotly"
        ) from None
    return text.replace(b"</script", rb"<\/script")


def _write_atomically(path: Path, chunks: Iterable[bytes]) -> None:
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with part.open("wb") as file:
            for chunk in chunks:
                file.write(chunk)
        part.replace(path)
    except OSError as error:
        raise StorageError(f"{path}: the report cannot be written: {error.strerror}") from None
    finally:
        _remove(part)


def _remove(part: Path) -> None:
    try:
        part.unlink(missing_ok=True)
    except OSError:
        return  # the folder went away or read-only; the first error has been raised already
