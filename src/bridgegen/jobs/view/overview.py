"""The runs below a folder, one line each: read quickly, whatever state they are in."""

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from bridgegen.assess.criteria import CriterionSummary
from bridgegen.base.errors import BridgeGenError
from bridgegen.jobs.search.run import judged
from bridgegen.jobs.search.settings import Settings
from bridgegen.results.store import Store
from bridgegen.results.store.run_file import FILE
from bridgegen.search.triage.record import JSON_FILE, Mode, Triage, read_record

MOST_RUNS = 2000
DEEPEST = 8
"""Maximum number of folders between the folder and a run."""

MOST_FOLDERS = 100_000


@dataclass(frozen=True)
class RunLine:
    """What is known of a run without its rows.

    Attributes:
        path: of its folder, relative to the folder of all.
        scenario: name, or path of the file.
        ego: driver.
        algorithm: name.
        seed: of the run.
        evaluations: number recorded.
        critical: number of critical ones.
        budget: number wanted.
        finished: whether it has ended.
        changed: when its file, or the log of its writer, was last written [s since 1970].
        size: of its folder on disk [bytes].
        triage: its failure modes; None before it has finished.
        criteria: how its evaluations meet its pass criteria.
        settings: of the run.
        version: of BridgeGen that made it.
        problem: why it cannot be read; empty if it can. All else but path, changed and size is
            then empty.
    """

    path: str
    changed: float
    size: int
    scenario: str = ""
    ego: str = ""
    algorithm: str = ""
    seed: int = 0
    evaluations: int = 0
    critical: int = 0
    budget: int = 0
    finished: bool = False
    triage: Triage | None = field(default=None, repr=False)
    criteria: tuple[CriterionSummary, ...] = ()
    settings: Settings | None = field(default=None, repr=False)
    version: str = ""
    problem: str = ""

    @property
    def modes(self) -> tuple[Mode, ...]:
        """Failure modes, robust ones first."""
        return self.triage.modes if self.triage else ()


def is_run(folder: Path) -> bool:
    """Whether a folder is that of a run."""
    file = folder / FILE
    return file.is_file() and not file.is_symlink()


def find_runs(folder: Path) -> list[Path]:
    """Return the folders of runs below a folder; see `find_folders`."""
    return find_folders(folder, is_run)


def find_folders(folder: Path, is_wanted: Callable[[Path], bool]) -> list[Path]:
    """Return the wanted folders below a folder, sorted; links are not followed.

    At most `MOST_RUNS`, at most `DEEPEST` folders deep; none inside another.
    """
    found: list[Path] = []
    level, seen = [folder], 0
    for _ in range(DEEPEST + 2):
        below: list[Path] = []
        for path in level:
            seen += 1
            if len(found) >= MOST_RUNS or seen > MOST_FOLDERS:
                return sorted(found)
            if path != folder and is_wanted(path):
                found.append(path)
            else:
                below += _folders_in(path)
        level = below
    return sorted(found)


def _folders_in(folder: Path) -> list[Path]:
    try:
        with os.scandir(folder) as entries:
            inner = [entry.path for entry in entries if entry.is_dir(follow_symlinks=False)]
    except OSError:
        return []  # not ours to read
    return [Path(name) for name in sorted(inner) if not Path(name).name.startswith(".")]


def read_line(
    folder: Path, run: Path, also: Callable[[Store, Settings], None] | None = None
) -> RunLine:
    """Return what is known of a run; a run that cannot be read has its problem.

    Args:
        folder: of all runs.
        run: folder of the run.
        also: called with the open store, to read more of it.
    """
    path = run.relative_to(folder).as_posix()
    try:
        # While a search writes, SQLite's log grows beside the file.
        changed = max(path.stat().st_mtime for path in run.glob(f"{FILE}*"))
    except (OSError, ValueError):
        changed = 0.0
    size = sum(_sizes(run))
    try:
        with Store.open(run) as store:
            settings, n = Settings.from_dict(store.settings, run), len(store)
            finished, criteria = store.finished is not None, judged(store, settings)
            version, critical = store.version, store.n_critical
            if also is not None:
                also(store, settings)
        triage = read_record(run / JSON_FILE)
    except BridgeGenError as error:
        return RunLine(path, changed, size, problem="; ".join(error.problems))
    return RunLine(
        path,
        changed,
        size,
        scenario=settings.scenario,
        ego=settings.called,
        algorithm=settings.algorithm,
        seed=settings.seed,
        evaluations=n,
        critical=critical,
        budget=settings.budget,
        finished=finished,
        triage=triage,
        criteria=criteria,
        settings=settings,
        version=version,
    )


def _sizes(folder: Path, depth: int = 2) -> Iterator[int]:
    try:
        with os.scandir(folder) as entries:
            for entry in entries:
                if entry.is_file(follow_symlinks=False):
                    yield entry.stat(follow_symlinks=False).st_size
                elif depth and entry.is_dir(follow_symlinks=False):
                    yield from _sizes(Path(entry.path), depth - 1)
    except OSError:
        return
