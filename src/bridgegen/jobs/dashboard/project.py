"""A project's folder → all that is found in it: runs, suites, maps, comparisons, and problems."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bridgegen.base.errors import BridgeGenError, StorageError
from bridgegen.jobs.compare.plan import FILE as COMPARISON_FILE
from bridgegen.jobs.dashboard.of_odd import ProjectOdd
from bridgegen.jobs.dashboard.results import Result, place_of
from bridgegen.jobs.dashboard.results_of import (
    ComparisonLine,
    MapLine,
    SuiteLine,
    read_comparison,
    read_map,
    read_run,
    read_suite_line,
    with_drivers_as_one,
)
from bridgegen.jobs.dashboard.scenery import Sceneries, Scenery
from bridgegen.jobs.preventability.result import SETTINGS as MAP_FILE
from bridgegen.jobs.suite.entries import RESULTS as SUITE_FILE
from bridgegen.jobs.view.overview import MOST_RUNS, find_folders
from bridgegen.results.failures import FILE as FAILURES
from bridgegen.results.failures import FailureFile, read_failures
from bridgegen.results.store.run_file import FILE as RUN_FILE
from bridgegen.scenario.odd.reader import odd_of

_FILES = (RUN_FILE, SUITE_FILE, MAP_FILE, COMPARISON_FILE)


@dataclass(frozen=True)
class Problem:
    """A folder, or a scenario, that cannot be read.

    Attributes:
        place: folder as seen from the project's, or the scenario.
        why: in words.
    """

    place: str
    why: str


@dataclass(frozen=True)
class Project:
    """All that is found in a folder.

    Attributes:
        folder: absolute.
        runs: each with its result.
        suites: each with those of its entries.
        maps: of preventability.
        comparisons: of algorithms; their runs are not among ``runs``.
        sceneries: what each scenario states, by the name that results have it under.
        problems: what cannot be read.
        decisions: the files ``failures.yaml`` below the folder and beside the scenarios of suites,
            by folder; not that of the folder itself.
        odd: its operational design domain, and what its runs have of that.
    """

    folder: Path
    runs: tuple[Result, ...]
    suites: tuple[SuiteLine, ...]
    maps: tuple[MapLine, ...]
    comparisons: tuple[ComparisonLine, ...]
    sceneries: dict[str, Scenery]
    problems: tuple[Problem, ...]
    decisions: Mapping[Path, FailureFile] = field(default_factory=dict)
    odd: ProjectOdd = field(default_factory=ProjectOdd)

    @property
    def results(self) -> tuple[Result, ...]:
        """Of all runs and of all entries of suites."""
        return (*self.runs, *(result for suite in self.suites for result in suite.results))


def read_project(
    folder: Path,
    begun: Callable[[int, int], None] | None = None,
    odd: Mapping[str, Any] | None = None,
) -> Project:
    """Read all runs, suites, maps and comparisons below a folder.

    Args:
        folder: of the project.
        begun: called with the number of folders that are read, and of all.
        odd: the project's operational design domain; that of its first run by default.

    Raises:
        StorageError: there is no such folder, or none of these is in it.
    """
    root = folder.resolve()
    if not root.is_dir():
        raise StorageError(f"{folder}: there is no such folder")
    reader = _Reader(root, ProjectOdd.of(None if odd is None else odd_of(odd)))
    found = find_folders(root, reader.is_result)
    if not found:
        raise StorageError(
            f"{folder}: contains no run, suite, preventability map or comparison, nor does any "
            "folder below it"
        )
    for number, path in enumerate(found):
        if begun is not None:
            begun(number, len(found))
        reader.read(path)
    # Said on the page: a cut that is not seen would look like success.
    if len(found) >= MOST_RUNS:
        why = f"a dashboard reads at most {MOST_RUNS:,} folders; the others are left out"
        reader.problems.append(Problem(".", why))
    return reader.project()


def kind_of(folder: Path) -> str | None:
    """Return the file that identifies a folder of results; None if it is another folder."""
    for name in _FILES:
        file = folder / name
        # Links are not followed: they may lead out of the project.
        if file.is_file() and not file.is_symlink():
            return name
    return None


class _Reader:
    def __init__(self, root: Path, odd: ProjectOdd) -> None:
        self.root, self.odd = root, odd
        self.sceneries = Sceneries()
        self.runs: list[Result] = []
        self.suites: list[SuiteLine] = []
        self.maps: list[MapLine] = []
        self.comparisons: list[ComparisonLine] = []
        self.problems: list[Problem] = []
        self.deciding: list[Path] = []

    def is_result(self, folder: Path) -> bool:
        """Return whether a folder holds results; note it if it holds decisions."""
        file = folder / FAILURES
        if file.is_file() and not file.is_symlink():
            self.deciding.append(folder)
        return kind_of(folder) is not None

    def read(self, folder: Path) -> None:
        """Read a folder; what is wrong with it is a problem of the project."""
        place = folder.relative_to(self.root).as_posix()
        try:
            kind = kind_of(folder)
            if kind == RUN_FILE:
                self.runs.append(read_run(self.root, folder, self.sceneries, self.odd))
            elif kind == SUITE_FILE:
                suite = read_suite_line(self.root, folder, self.sceneries, self.odd)
                self.suites.append(suite)
                self.problems += [Problem(f"{place}: {name}", why) for name, why in suite.lost]
            elif kind == MAP_FILE:
                self.maps.append(read_map(self.root, folder))
            else:
                self.comparisons.append(read_comparison(self.root, folder))
        except BridgeGenError as error:
            self.problems.append(Problem(place, self._short("; ".join(error.problems))))
        except OSError as error:  # it was removed meanwhile
            self.problems.append(Problem(place, f"cannot be read: {error.strerror}"))

    def project(self) -> Project:
        """Return all that was read."""
        decisions = self._decisions()
        runs, suites = with_drivers_as_one(self.runs, self.suites)
        results = (*runs, *(result for suite in suites for result in suite.results))
        unread = sorted(
            {result.scenario for result in results if result.seen is None and result.finished}
        )
        problems = [*self.problems]
        for name in unread:
            why = "is missing, or has changed since it was tested; its coverage is not counted"
            problems.append(Problem(f"scenario {name}", why))
        return Project(
            self.root,
            runs,
            suites,
            tuple(self.maps),
            tuple(self.comparisons),
            self.sceneries.by_name(self.root),
            tuple(problems),
            decisions,
            self.odd,
        )

    def _decisions(self) -> dict[Path, FailureFile]:
        beside = [path.parent for suite in self.suites for path in suite.files.values()]
        found = {}
        # That of the project's own folder is read by `build_dashboard`.
        for folder in sorted({*self.deciding, *beside} - {self.root}):
            try:
                found[folder] = read_failures(folder)
            except BridgeGenError as error:
                place = place_of(str(folder / FAILURES), self.root)
                self.problems.append(Problem(place, self._short("; ".join(error.problems))))
        return found

    def _short(self, text: str) -> str:
        """Return a message without the path of the project, cut where it is long."""
        text = text.replace(f"{self.root}/", "")
        return text if len(text) <= 400 else f"{text[:400]} …"
