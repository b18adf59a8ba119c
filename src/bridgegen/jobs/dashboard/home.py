"""A project as an app: its verdict, all its results on one page, statuses that a person sets."""

import html
import json
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from http import HTTPStatus
from pathlib import Path, PurePosixPath
from typing import Annotated, Any
from urllib.parse import quote

from markupsafe import Markup
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from bridgegen.base.disk import read_inside
from bridgegen.base.errors import BridgeGenError, StorageError
from bridgegen.jobs.dashboard.dashboard import PAGE, Dashboard, dashboard_of
from bridgegen.jobs.dashboard.modes import OpenMode, cleaned
from bridgegen.jobs.dashboard.page import banner, modes_table, page_of, verdicts_table
from bridgegen.jobs.dashboard.project import Project, kind_of, read_project
from bridgegen.jobs.dashboard.results_of import key_of
from bridgegen.jobs.search.run import REPORT
from bridgegen.jobs.view.folder_view import FolderView
from bridgegen.jobs.view.overview import MOST_RUNS, find_folders
from bridgegen.jobs.view.run_view import RunView
from bridgegen.jobs.view.server import OF_DISK, TYPES, Answer
from bridgegen.pages import templates
from bridgegen.pages.page import scripted
from bridgegen.pages.payload import script_json
from bridgegen.pages.templates import Banner, Cell
from bridgegen.results.failures import (
    FILE,
    MOST_TEXT,
    STATUSES,
    ChangedError,
    Failure,
    Status,
    read_failures,
    read_old_file,
    write_failures,
)
from bridgegen.search.triage.record import JSON_FILE as TRIAGE
from bridgegen.search.triage.record import read_record

MOST_MODES = 8
"""Maximum number of failure modes of the home page; the dashboard has all."""

HEAD, MOST_BYTES = 262_144, 64_000_000
"""Length of a page within which its verdict stands, maximum length of what is served [bytes]."""

SERVED = {".xosc", ".xodr", ".owl", ".json", ".csv", ".yaml", ".yml", ".txt", ".md", ".parquet"}
SERVED |= {".gif", ".webp", ".mp4", ".webm", ".png", ".svg"}
"""Endings of the files that are saved from pages of the project."""

SOURCES = Markup("script-src 'unsafe-inline'; connect-src 'self'; ")
"""What a page of ours may do where a status is set in it."""

_GENERATOR = re.compile(r'<meta name="generator" content="[Bb]ridge[Gg]en ([a-z -]{1,40})">')
# Bounded: a stranger's page must not take a long time.
_TITLE = re.compile(r'<h1 id="title">(.{0,1000}?)</h1>', re.DOTALL)
_BANNER = re.compile(
    r'<div class="banner (\w*)" role="status">(?:<b>(.{0,99}?)</b> )?<p>(.{0,4000}?)</p>', re.DOTALL
)
_FACTS = re.compile(r'<ul class="facts"[^>]{0,99}>(.{0,4000}?)</ul>', re.DOTALL)
_BRAND = re.compile(rb'<span class="brand">(.{0,999}?)</span>', re.DOTALL)

_NOT_LISTED = ("search", "dashboard", "view")
"""Kinds of pages that the home page has otherwise."""


class _Asked(BaseModel):
    """What a page asks for: the status and comment of a failure mode, and those that it showed."""

    model_config = ConfigDict(extra="forbid", strict=True)

    mode: Annotated[str, Field(max_length=200)]
    status: Status
    comment: Annotated[str, Field(max_length=MOST_TEXT)]
    was: Annotated[list[str], Field(min_length=2, max_length=2)]


@dataclass(frozen=True)
class _Page:
    """A page of a result, as its own head states it; all of it is a stranger's text."""

    path: str
    kind: str
    title: str
    verdict: Banner
    facts: tuple[str, ...]
    time: float


class Home(FolderView):
    """A project as a site; other processes may be extending its runs.

    Only ``failures.yaml`` of its folder is ever written; links are not followed.

    Args:
        folder: of the project.

    Raises:
        StorageError: there is no such folder, or no result in it.
        FileFormatError: its ``failures.yaml`` is damaged.
    """

    def __init__(self, folder: Path | str) -> None:
        super().__init__(folder)
        self._marks: list[tuple[str, int, int]] = []
        self._pages: list[_Page] = []
        self._project: Project | None = None
        if self._dashboard() is None and not self._pages:
            read_project(Path(folder))  # says what is missing

    # --- What is there ---

    def _dashboard(self) -> Dashboard | None:
        """Return what all results say now; None where there are only pages.

        Results are read again only if a file of theirs has changed.
        """
        marks: list[tuple[str, int, int]] = []
        found = find_folders(self.folder, lambda folder: self._look(folder, marks))
        if marks != self._marks:
            self._project = read_project(self.folder) if found else None
            pages = [name for name, _, _ in marks if name.endswith(".html")]
            self._pages = [page for name in pages if (page := self._page_at(name)) is not None]
            self._marks = marks
        if self._project is None:
            return None
        if (self.folder / FILE).is_symlink():
            raise StorageError(f"{self.folder / FILE}: is a link, and is not followed")
        file, old = read_failures(self.folder), read_old_file(self.folder)
        return dashboard_of(self._project, self.folder / PAGE, file, old)

    def _look(self, folder: Path, marks: list[tuple[str, int, int]]) -> bool:
        """Return whether a folder holds results; note the files that tell whether they changed."""
        try:
            with os.scandir(folder) as entries:
                for entry in entries:
                    if entry.is_file(follow_symlinks=False) and len(marks) < 10 * MOST_RUNS:
                        stat = entry.stat(follow_symlinks=False)
                        marks.append((entry.path, stat.st_mtime_ns, stat.st_size))
        except OSError:
            return False
        return kind_of(folder) is not None

    def _page_at(self, name: str) -> _Page | None:
        """Return what a page of ours says of itself; None for any other file."""
        try:
            with open(name, "rb") as file:
                text = file.read(HEAD).decode("utf-8", "replace")
            time = os.stat(name).st_mtime
        except OSError:
            return None
        kind, title, verdict = _GENERATOR.search(text), _TITLE.search(text), _BANNER.search(text)
        if kind is None or kind[1] in _NOT_LISTED:
            return None
        facts = re.findall(r"<li[^>]*>(.*?)</li>", (_FACTS.search(text) or ("", ""))[1])
        said = Banner("") if verdict is None else Banner(_text(verdict[3]), "", _text(verdict[2]))
        path = PurePosixPath(Path(name).relative_to(self.folder)).as_posix()
        words = tuple(map(_text, facts[:4]))
        return _Page(path, kind[1], _text(title[1]) if title else path, said, words, time)

    # --- What is served ---

    def page(self) -> bytes:
        """Return the home page, as HTML."""
        found = self._dashboard()
        script, css = scripted("runs.js")
        data = {"runs": self.facts(), "edits": self._edits(found, "")}
        return templates.page(
            "jobs/dashboard/home.html",
            title=self.folder.name or "project",
            home="./",
            verdict=banner(found) if found else Banner(""),
            verdicts=verdicts_table(found, "p") if found else None,
            modes=modes_table("Failing now", found.failing[:MOST_MODES], "p") if found else None,
            more=max(0, len(found.failing) - MOST_MODES) if found else 0,
            file=FILE,
            others=[_other(page) for page in sorted(self._pages, key=lambda one: -one.time)],
            css=Markup(templates.style("jobs/dashboard/page.css")) + css,
            data=Markup(script_json(data)),
            script=script,
        )

    def run(self, number: int) -> RunView | None:
        """Return the site of a run by its number; its failure modes have their statuses, too."""
        if (view := super().run(number)) is not None:
            view.also = lambda: self._of_run(view.folder)
        return view

    def _of_run(self, folder: Path) -> dict[str, Any]:
        """Return what a run's page needs to set statuses: also the ids of its failure modes."""
        found, place = self._dashboard(), folder.relative_to(self.folder).as_posix()
        runs = found.project.runs if found else ()
        result = next((run for run in runs if run.source == place), None)
        record = read_record(folder / TRIAGE)
        if result is None or record is None:
            return {}
        ids = {
            mode.number: key_of(mode, result.scenario, result.driver).id for mode in record.modes
        }
        return {"edits": self._edits(found, "../../"), "mode_ids": ids}

    def place(self, path: str) -> Answer | None:
        """Return what is at a path of the project's folder; None if nothing is served from there.

        The folder's own is the dashboard, a run's report is the one that grows with it.
        """
        parts = PurePosixPath(path).parts
        up = "../" * path.count("/")
        if path in ("", PAGE):
            if (found := self._dashboard()) is None:
                return None
            script, css = scripted("status.js")
            data = Markup(script_json({"edits": self._edits(found, "../")}))
            css = Markup(templates.style("jobs/dashboard/page.css")) + css
            page = page_of(found, home="../", css=css, sources=SOURCES, data=data, script=script)
            return Answer(HTTPStatus.OK, TYPES["html"], page)
        if any(part.startswith((".", "/")) or "\\" in part for part in parts):
            return None
        if parts[-1] == REPORT and (number := self._number(self.folder.joinpath(*parts[:-1]))):
            try:
                self.run(number - 1)
            except BridgeGenError:
                pass  # the page on the disk is what there is
            else:
                to = {"Location": f"{up}../run/{number - 1}/"}
                return Answer(HTTPStatus.FOUND, "text/plain", b"", to)
        return self._file(path, f"{up}../")

    def _number(self, run: Path) -> int:
        """Return the number of a run from 1, 0 of any other folder."""
        return self._runs.index(run) + 1 if run in self._runs else 0

    def _file(self, path: str, home: str) -> Answer | None:
        suffix = PurePosixPath(path).suffix.lower()
        if suffix != ".html" and suffix not in SERVED:
            return None
        try:
            if (self.folder / path).stat().st_size > MOST_BYTES:
                return None
            body = read_inside(self.folder, path)
        except (BridgeGenError, OSError, ValueError):  # a link that leads out of it, a NUL
            return None
        if suffix != ".html":
            saved = {**OF_DISK, "Content-Disposition": "attachment"}
            return Answer(HTTPStatus.OK, "application/octet-stream", body, saved)
        if _GENERATOR.search(body[:1000].decode("utf-8", "replace")) is None:
            return None
        # Pages on the disk lead nowhere; here their logo leads back.
        body = _BRAND.sub(
            rb'<a class="brand" href="%s" target="_top">\1</a>' % home.encode(), body, count=1
        )
        return Answer(HTTPStatus.OK, TYPES["html"], body, OF_DISK)

    # --- What a person decides ---

    def _edits(self, found: Dashboard | None, up: str) -> dict[str, Any]:
        """Return what the served page needs to set statuses."""
        modes = {}
        for mode in found.modes if found else ():
            by = "" if _own_id(mode) else mode.decided
            modes[mode.key.id] = {"status": mode.status, "comment": mode.comment, "by": by}
        return {"post": f"{up}status", "statuses": STATUSES, "modes": modes, "most": MOST_TEXT}

    def decide(self, asked: Mapping[str, Any]) -> tuple[HTTPStatus, Mapping[str, Any]]:
        """Write the status and the comment of a failure mode into ``failures.yaml``.

        Returns:
            The status, and what the page is told: CONFLICT if the block is not what the page
            showed, so that two people do not overwrite each other.

        Raises:
            StorageError: the file cannot be written.
            FileFormatError: it is damaged, or laid out so that nothing can be added.
        """
        try:
            wanted = _Asked.model_validate(asked)
        except ValidationError as error:
            first = error.errors(include_input=False, include_url=False)[0]
            text = f"{'.'.join(map(str, first['loc']))}: {first['msg']}"
            return HTTPStatus.BAD_REQUEST, {"error": [text]}
        found = self._dashboard()
        modes = found.modes if found else ()
        mode = next((mode for mode in modes if mode.key.id == wanted.mode), None)
        if found is None or mode is None:
            return HTTPStatus.NOT_FOUND, {"error": ["no result has this failure mode any more"]}
        if not (id := _own_id(mode)):
            text = f"its status stands in {mode.decided}, which is not written from here"
            return HTTPStatus.FORBIDDEN, {"error": [text]}
        file = read_failures(self.folder)
        block = {**found.own, **file.failures}.get(id)
        block = block or Failure(
            title=cleaned(mode.title),
            scenario=cleaned(mode.key.scenario),
            driver=cleaned(mode.key.driver),
        )
        if [block.status, block.comment] != wanted.was:
            said = f": {json.dumps(block.comment, ensure_ascii=False)}" if block.comment else ""
            text = f"{FILE} says '{block.status}'{said} by now; load the page again"
            return HTTPStatus.CONFLICT, {"error": [text]}
        comment = cleaned(" ".join(wanted.comment.split()))
        block = block.model_copy(update={"status": wanted.status, "comment": comment})
        try:
            write_failures(file, {id: block})
        except ChangedError as error:
            return HTTPStatus.CONFLICT, {"error": list(error.problems)}
        return HTTPStatus.OK, {}


def _own_id(mode: OpenMode) -> str:
    """Return the id of a mode's block in the project's file; "" if another file decides."""
    if not mode.decided:
        return mode.key.id
    head = f"{FILE}: "
    return mode.decided.removeprefix(head) if mode.decided.startswith(head) else ""


def _text(markup: str | None) -> str:
    """Return the text of a page's head, in one line."""
    return " ".join(html.unescape(re.sub(r"<[^>]*>", " ", markup or "")).split())[:400]


def _other(page: _Page) -> list[object]:
    """Return a line of the list of other results."""
    verdict = page.verdict
    word = {"FAILS": "bad", "PASSES": "good"}.get(verdict.word, "")
    return [
        Cell(page.title, [page.path], href=f"p/{quote(page.path, errors='replace')}"),
        page.kind,
        Cell(verdict.word or "–", [verdict.text] if verdict.text else [], kind=word),
        ", ".join(page.facts) or "–",
        templates.when(page.time),
    ]
