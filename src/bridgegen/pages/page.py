"""Assembles the page: template, style, scripts and the data, in one file."""

import html
import re
from functools import cache
from importlib.resources import files
from pathlib import Path

from bridgegen.base.disk import write_whole
from bridgegen.pages.data import ReportData
from bridgegen.pages.modules import bundle
from bridgegen.pages.payload import to_json
from bridgegen.pages.sections import SECTIONS

WEB = files("bridgegen.pages").joinpath("web")

REPORT = (*(section.module for section in SECTIONS), "page.js")
"""Modules of the report, besides those that they import."""

SERVED = ("motion.js", *REPORT, "live.js")
"""Modules of a served report; a page on disk makes no requests."""


def write_report(path: Path, data: ReportData) -> None:
    """Write the report as one self-contained HTML file.

    The write is atomic: to a temporary file beside it, which is then renamed.

    Raises:
        StorageError: the file cannot be written (no such folder, read-only, disk full).
    """
    write_whole(Path(path), report_page(data))


def report_page(data: ReportData, *, live: bool = False) -> list[bytes]:
    """Return the report as HTML, in parts.

    Args:
        data: of the report.
        live: whether ``bridgegen view`` serves it, so that it can request updates.
    """
    title = f"{data.summary.scenario}: {data.summary.title} – BridgeGen"
    connect = b"'self'" if live else b"'none'"
    script, style = _bundled(SERVED if live else REPORT)
    code = len(script) + len(style) + len(_own("page.html")) + len(_own("player.html"))
    text = to_json(data, live=live, code=code)
    return filled(
        "page.html", title, style, data=text.encode("ascii"), script=script, connect=connect
    )


def write_page(path: Path, entry: str, title: str, data: str) -> None:
    """Write a page, whole or not at all.

    Args:
        path: of the page.
        entry: a module of ``web`` with a template beside it ("show.js", "show.html").
        title: plain text.
        data: JSON that is safe inside a ``<script>`` element, see `payload.script_json`.

    Raises:
        StorageError: the file cannot be written.
    """
    write_whole(path, page_of(entry, title, data))


def page_of(entry: str, title: str, data: str) -> list[bytes]:
    """Return a page in parts; see `write_page`."""
    script, style = _bundled((entry,))
    template = entry.replace(".js", ".html")
    return filled(template, title, style, script=script, data=data.encode("ascii"))


def code_of(entry: str) -> int:
    """Return how many characters a page has besides its title and data; see `write_page`."""
    parts = [*_bundled((entry,)), _own(entry.replace(".js", ".html")), _own("player.html")]
    return sum(map(len, parts))


def write_still_page(path: Path, template: str, title: str, body: bytes) -> None:
    """Write a page without scripts, whole or not at all.

    Args:
        path: of the page.
        template: a file of ``web``, with a style beside it.
        title: plain text.
        body: HTML.

    Raises:
        StorageError: the file cannot be written.
    """
    write_whole(path, still_page(template, title, body))


def still_page(template: str, title: str, body: bytes) -> list[bytes]:
    """Return a page without scripts, in parts; see `write_still_page`."""
    style = _own("common.css") + b"\n" + _own(template.replace(".html", ".css"))
    return filled(template, title, style, body=body)


def filled(template: str, title: str, css: bytes, **more: bytes) -> list[bytes]:
    """Return a page in parts; inserted parts are not searched for placeholders.

    Args:
        template: a file of ``web``.
        title: plain text.
        css: its style.
        more: of the template's other placeholders; ``{{player}}`` is the player of playbacks.
    """
    heading = html.escape(title).encode("utf-8", "replace")
    fill = {"title": heading, "css": css, "player": _own("player.html"), **more}
    parts = re.split(rb"\{\{(\w+)\}\}", _own(template))
    return [fill[part.decode()] if i % 2 else part for i, part in enumerate(parts)]


@cache
def _bundled(entries: tuple[str, ...]) -> tuple[bytes, bytes]:
    script, style = bundle(entries, _text)
    return script.encode(), style.encode()


def _text(name: str) -> str | None:
    file = WEB.joinpath(name)
    return file.read_text("utf-8") if file.is_file() else None


def _own(name: str) -> bytes:
    return WEB.joinpath(name).read_bytes()
