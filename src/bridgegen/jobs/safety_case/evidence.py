"""The files that a safety case rests on, with their digests."""

import hashlib
import os
import shlex
from collections.abc import Iterator
from pathlib import Path

from bridgegen.base.errors import StorageError
from bridgegen.drivers import file_of
from bridgegen.jobs.safety_case.facts import Facts
from bridgegen.jobs.safety_case.model import Evidence
from bridgegen.jobs.safety_case.numbers import RUN
from bridgegen.jobs.search.exported import FOLDER
from bridgegen.jobs.search.scenarios import is_file
from bridgegen.results.confirmation.record import file_name
from bridgegen.search.triage.record import JSON_FILE

MOST_SHOWN = 10
"""Failure modes that are counter goals of their own, with their files."""


class Files:
    """The evidence of one run.

    Args:
        facts: of the run.
        number: of the run, from 1.
        out: the folder of the case.

    Attributes:
        all: every file.
        run: id of the file of evaluations.
        triage: id of the record of failure modes.
        modes: ids of the exported files of each failure mode, by its number.
        confirmations: ids of the records of other simulators, by their names.
        inputs: ids of the files that the run was made from.
        driver: id of the file of a driver of the user's; "" without.
        resume: the command that makes the run's record of failure modes again.
    """

    def __init__(self, facts: Facts, number: int, out: Path) -> None:
        self._folder, self._out, self._number = facts.run.folder, out, number
        self.all: list[Evidence] = []
        settings, name = facts.run.settings, facts.run.folder.resolve().name
        self.resume = shlex.join(["bridgegen", "resume", name])
        search = settings.command(Path(name))
        self.run = self._add(self._folder / RUN, "every evaluation of the search", search)
        self.triage = self._add(
            self._folder / JSON_FILE,
            "failure modes, their neighbours, and the bound on the harmful share",
            self.resume,
        )
        self.modes = {}
        for mode in facts.triage.modes[:MOST_SHOWN]:
            stems = [*mode.exports[:1], *([mode.minimal.name] if mode.minimal else [])]
            self.modes[mode.number] = [
                self._add(path, shows, self.resume)
                for stem in stems
                for path, shows in self._scenario(stem)
            ]
        self.confirmations = {
            one.simulator: self._add(
                self._folder / file_name(one.simulator),
                f"exported scenarios simulated again in {one.label}",
                shlex.join(["bridgegen", "confirm", name, "--simulator", one.simulator]),
            )
            for one in facts.confirmations
        }
        self.inputs = [
            self._add(path, shows, "")
            for path, shows in (
                (settings.scenario if is_file(settings.scenario) else "", "the logical scenario"),
                (settings.distribution, "the distribution of its parameters"),
                (settings.road_map, "its map"),
            )
            if path and Path(path).is_file()
        ]
        code = file_of(settings.ego)
        self.driver = ""
        if code is not None and code.is_file():
            self.driver = self._add(code, "the driver, as it is at the export", "")

    def _scenario(self, stem: str) -> Iterator[tuple[Path, str]]:
        """Yield the files of an exported scenario that exist, and what each shows."""
        for kind, shows in (
            ("xosc", "the scenario"),
            ("xodr", "its road"),
            ("json", "its metrics"),
        ):
            path = self._folder / FOLDER / f"{stem}.{kind}"
            inside = path.resolve().is_relative_to(self._folder.resolve())
            if stem and inside and path.is_file():
                yield path, f"{stem}: {shows}"

    def _add(self, path: Path | str, shows: str, command: str) -> str:
        """Add a file, unless it is known; return its id.

        Raises:
            StorageError: it cannot be read.
        """
        path = Path(path)
        file = Path(os.path.relpath(path.resolve(), self._out.resolve())).as_posix()
        known = next((one.id for one in self.all if one.file == file), None)
        if known is not None:
            return known
        try:
            with path.open("rb") as data:
                digest = hashlib.file_digest(data, "sha256").hexdigest()
            size = path.stat().st_size
        except OSError as error:
            raise StorageError(f"{path}: cannot be read: {error.strerror}") from None
        one = Evidence(
            id=f"E{self._number}.{len(self.all) + 1}", file=file, sha256=digest, bytes=size,
            shows=shows, command=command,
        )  # fmt: skip
        self.all.append(one)
        return one.id
