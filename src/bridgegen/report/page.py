"""Puts the page together: template, style, scripts, Plotly and the data, all in one file."""

import html
import importlib.util
import re
from collections.abc import Iterable
from functools import cache
from importlib.resources import files
from pathlib import Path

from bridgegen.disk import write_whole
from bridgegen.errors import BridgeGenError
from bridgegen.report.data import ReportData
from bridgegen.report.payload import to_json

SCRIPTS = (
    "common.js", "page.js", "regions.js", "elsewhere.js", "filters.js", "causes.js", "modes.js",
    "notes.js", "inflate.js", "downloads.js", "playbacks.js",
    "table.js", "table_tools.js", "address.js", "series.js", "unpack.js", "geometry.js", "view.js",
    "bodies.js", "labels.js", "senses.js", "course.js", "atmosphere.js", "words.js", "conflict.js",
    "scene.js", "strip.js", "curves.js", "picture.js", "player.js", "parallel.js", "front.js",
    "near.js", "charts.js", "coverage.js", "coverage_pairs.js",
)  # fmt: skip
"""Joined in this order into one function scope; ``page.js`` holds what the others share."""

SERVED = ("live.js",)
"""Besides, where the page is served; a page on disk has nothing that could ask for anything."""

STYLES = (
    "page.css",
    "picture.css",
    "coverage.css",
    "causes.css",
    "notes.css",
    "table.css",
    "regions.css",
    "elsewhere.css",
    "playback.css",
    "live.css",
    "modes.css",
)


def write_report(path: Path, data: ReportData) -> None:
    """Write the report as one HTML file that needs nothing else to be opened.

    A reader never sees half a file: it is written beside its place and then renamed.

    Raises:
        StorageError: the file cannot be written (no such folder, read-only, disk full).
    """
    write_whole(Path(path), report_page(data))


def report_page(data: ReportData, *, live: bool = False) -> list[bytes]:
    """Return the report as HTML, in parts.

    Args:
        data: what it shows.
        live: whether it is served by ``bridgegen view``, which it may ask for what is new.
    """
    title = f"{data.summary.scenario}: {data.summary.title} – BridgeGen"
    connect = b"'self'" if live else b"'none'"
    text = to_json(data, live=live)
    scripts = (*SERVED, *SCRIPTS) if live else SCRIPTS
    return filled("page.html", scripts, title, text, plotly=_plotly(), connect=connect)


def write_page(
    path: Path,
    template: str,
    scripts: Iterable[str],
    title: str,
    data: str,
    styles: Iterable[str] = STYLES,
    **more: bytes,
) -> None:
    """Write a page, whole or not at all; arguments as for `filled`.

    Raises:
        StorageError: the file cannot be written.
    """
    write_whole(path, filled(template, scripts, title, data, styles, **more))


def filled(
    template: str,
    scripts: Iterable[str],
    title: str,
    data: str,
    styles: Iterable[str] = STYLES,
    **more: bytes,
) -> list[bytes]:
    """Return a page in parts; what is put in is never searched for placeholders again.

    Args:
        template: a file of ``web``.
        scripts: files of ``web``.
        title: plain text.
        data: JSON that is safe inside a ``<script>`` element, see `payload.script_json`.
        styles: files of ``web``.
        more: of the template's other placeholders.
    """
    fill = {
        "title": html.escape(title).encode("utf-8", "replace"),
        "css": b"\n".join(map(_own, styles)),
        "data": data.encode("ascii"),
        "scripts": b"\n".join(map(_own, scripts)),
        **more,
    }
    parts = re.split(rb"\{\{(\w+)\}\}", _own(template))
    return [fill[part.decode()] if i % 2 else part for i, part in enumerate(parts)]


@cache
def _own(name: str) -> bytes:
    return files("bridgegen.report").joinpath("web", name).read_bytes()


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
