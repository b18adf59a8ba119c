"""The failures of a benchmark: whether a careful driver avoids them, and how to reproduce them."""

import importlib
import io
import pickle
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import IO, Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from bridgegen.assess.objective import Objective
from bridgegen.base.arrays import Bool, Int
from bridgegen.base.disk import write_whole
from bridgegen.base.errors import FileFormatError, InputError
from bridgegen.base.records import read_model
from bridgegen.drivers import is_planner
from bridgegen.drivers.driver_process import make
from bridgegen.drivers.interface import BatchDriver, Observation, Scene
from bridgegen.drivers.planners import planners
from bridgegen.drivers.user_drivers import NAMES
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Threads
from bridgegen.jobs.search.restored import searched
from bridgegen.jobs.search.run import Run
from bridgegen.results.store.rows import Rows
from bridgegen.search.triage.triage import harmful_rows

# --- A driver that drives as another one does, and records what it sees: for one row at a time ---
# It is a driver of the user's own in a file, so it runs in a process of its own as any other:
# `observer` writes that file, and `recorded` reads what it has seen.


_FILE = "observer.py"
_SEEN = "seen.bin"


def observer(spec: str, folder: Path) -> str:
    """Write a driver that observes another one; return its name, as given to ``--ego``.

    Args:
        spec: of the other one.
        folder: exists, and is written to by us alone.
    """
    text = (
        "from bridgegen.jobs.benchmark.failures import observing\n\n"
        f"Observer = observing({spec!r}, {str(folder / _SEEN)!r})\n"
    )
    path = folder / _FILE
    path.write_text(text, encoding="utf-8")
    return f"{path}:Observer"


def observing(spec: str, seen: str) -> type:
    """Return the class of a driver that observes another one.

    Raises:
        InputError: the other one cannot be made, or is compiled.
    """
    inner: Any = make(spec)
    if not hasattr(inner, "act"):
        raise InputError(f"{spec} is compiled: what it sees is not recorded")

    class Observer:
        def __init__(self) -> None:
            self._driver: BatchDriver = inner
            self._file: IO[bytes] | None = None

        def reset(self, n: int, scene: Scene) -> None:
            self._write(scene, afresh=True)
            self._driver.reset(n, scene)

        def act(self, observation: Observation) -> Any:
            self._write(observation)
            return self._driver.act(observation)

        def _write(self, what: Scene | Observation, *, afresh: bool = False) -> None:
            if afresh or self._file is None:
                self._file = Path(seen).open("wb")  # noqa: SIM115 - until the next row
            pickle.dump(what, self._file)
            self._file.flush()

    for name in NAMES:
        if hasattr(inner, name):
            setattr(Observer, name, getattr(inner, name))
    return Observer


def recorded(folder: Path) -> tuple[Scene, list[Observation]]:
    """Return what the observer saw last: of one row, or of that row twice.

    Args:
        folder: of `observer`: what it holds was written by this program.
    """
    found = list(_read(folder / _SEEN))
    scene, seen = found[0], found[1:]
    assert isinstance(scene, Scene)
    return scene, [item.take(slice(0, 1)) for item in seen]


def _read(path: Path) -> Iterator[Any]:
    with path.open("rb") as file:
        while True:
            try:
                yield pickle.load(file)
            except EOFError:
                return


CAREFUL = ("un-r157", "careful")
"""The careful drivers that drive the rows of a failure again: that of UN R157, which reacts to what
its three disturbances say, and the same extended to any road."""

RESPONSIBLE = frozenset({"ego", "shared"})
"""Labels of who is responsible where the ego is."""

JSON_FILE = "careful.json"
"""File of a `Judgement` in a run's folder."""

Count = Annotated[int, Field(ge=0, le=10**8)]


class Judgement(BaseModel):
    """Which failures of a run a careful driver avoids.

    Attributes:
        results: digest of the run's evaluations.
        failures: rows in which the ego fails and is responsible.
        avoided: by driver, in how many of them it does not.
        notes: why a scenario's script could not be written, by the scenario's name.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    results: str
    failures: Count
    avoided: dict[str, Count]
    notes: dict[str, str] = {}


@dataclass(frozen=True)
class Failures:
    """The failures of a run.

    Attributes:
        rows: ``(K,)`` positions of the harmful rows for which the ego is responsible.
        ways: of each, what distinguishes ways of failing that a store knows: conflict, type and
            the other participant.
        severity: ``(K,)`` float64, probability of MAIS3+.
        others: number of further harmful rows: preventable, but others are responsible.
    """

    rows: Int
    ways: tuple[tuple[str, ...], ...]
    severity: tuple[float, ...]
    others: int


def failures_of(run: Run, rows: Rows) -> Failures:
    """Return the failures of a run.

    Args:
        run: that has ended.
        rows: all its evaluations.
    """
    harm = Objective.from_dict(run.settings.optimised).harm
    harmful, _ = harmful_rows(rows.metrics, run.metrics, harm, rows.status, rows.findings)
    own: Bool = harmful & np.isin(rows.findings.responsible.astype(str), sorted(RESPONSIBLE))
    at = np.flatnonzero(own)
    found = rows.findings.take(at)
    columns = (found.conflict, found.conflict_type, found.partner)
    severity = rows.metrics[at, run.metrics.index("severity")]
    return Failures(
        at,
        tuple(zip(*(column.tolist() for column in columns), strict=True)),
        tuple(np.nan_to_num(severity).tolist()),
        int(harmful.sum() - own.sum()),
    )


def judge(run: Run, rows: Rows) -> Judgement:
    """Drive the failures of a run again by the careful drivers.

    Raises:
        StorageError: the scenario is not what it was.
    """
    at = failures_of(run, rows).rows
    avoided = dict.fromkeys(CAREFUL, 0)
    if len(at):
        scenario, space, roads = searched(run)
        for name in CAREFUL:
            pipeline = Pipeline(
                scenario, space, PipelineOptions(ego=name), road_map=roads, workers=Threads(1)
            )
            pipeline.choose_objective(Objective.from_dict(run.settings.optimised))
            trials = pipeline.try_all(rows.X[at])
            avoided[name] = int((trials.ok & ~trials.harmful).sum())
    return Judgement(results=rows.digest(), failures=len(at), avoided=avoided)


def write_judgement(folder: Path, judgement: Judgement) -> None:
    """Write a judgement into a run's folder.

    Raises:
        StorageError: it cannot be written.
    """
    write_whole(folder / JSON_FILE, [judgement.model_dump_json(indent=1).encode(), b"\n"])


def read_judgement(folder: Path) -> Judgement | None:
    """Return a run's judgement; None if there is none.

    Raises:
        FileFormatError: it is not one.
        StorageError: it cannot be read.
    """
    return read_model(
        folder / JSON_FILE,
        Judgement,
        lambda path, why: FileFormatError(f"{path}: must be the judgement of a run: {why}"),
    )


# --- What reproduces a failure with the planner alone: what it saw in that row, and a script ---


OBSERVATIONS, SCRIPT = "-observations.npz", "-reproduce.py"
"""Endings of the names of files beside ``0001.xosc``."""


def write_reproductions(run: Run, rows: Rows) -> dict[str, str]:
    """Write a script beside each exported scenario, and what its planner saw if it needs that.

    Returns:
        By name of a scenario, why its script needs BridgeGen though its planner could do without.

    Raises:
        StorageError: a file cannot be written.
    """
    notes = {}
    adapter = _adapter(run.settings.ego)
    for exported in run.exported():
        stem = run.folder / "critical" / exported.name
        text, seen = "", {}
        if adapter is not None:
            try:
                seen = _seen(run, rows, exported.evaluation, adapter.export)
                text = adapter.reproduction(f"{exported.name}{OBSERVATIONS}")
            except Exception as error:  # of a planner, or of its adapter
                notes[exported.name] = f"{type(error).__name__}: {error}"
        if seen:
            _write_arrays(stem.with_name(f"{exported.name}{OBSERVATIONS}"), seen)
        script = text or _with_bridgegen(run, exported.name)
        write_whole(stem.with_name(f"{exported.name}{SCRIPT}"), [script.encode()])
    return notes


def _adapter(ego: str) -> ModuleType | None:
    """Return the module of a planner that can export what it saw, and say how to use that."""
    if not is_planner(ego):
        return None
    module = importlib.import_module(planners()[ego].spec.rpartition(":")[0])
    can = all(callable(getattr(module, name, None)) for name in ("export", "reproduction"))
    return module if can else None


def _seen(
    run: Run,
    rows: Rows,
    evaluation: int,
    export: Callable[[list[Observation], Scene], Mapping[str, Any]],
) -> dict[str, np.ndarray]:
    """Drive a row again, and return what its planner saw, as arrays."""
    scenario, space, roads = searched(run)
    settings = run.settings
    with tempfile.TemporaryDirectory(prefix="bridgegen-") as name:
        ego = observer(planners()[settings.ego].spec, Path(name))
        options = PipelineOptions(ego=ego, ideal=settings.ideal, time_limit=settings.time_limit)
        pipeline = Pipeline(scenario, space, options, road_map=roads, workers=Threads(1))
        pipeline.rollout(rows.X[[evaluation]])
        pipeline.runner.simulator.stop()
        scene, observations = recorded(Path(name))
    return {key: np.asarray(item) for key, item in export(observations, scene).items()}


def _write_arrays(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **arrays)
    write_whole(path, [buffer.getvalue()])


def _with_bridgegen(run: Run, name: str) -> str:
    """Return a script that drives a scenario's file by BridgeGen."""
    ego, ideal = run.settings.ego, list(run.settings.ideal)
    return f'''"""Drives {name}.xosc as in the benchmark; needs BridgeGen {run.version}."""

from pathlib import Path

from bridgegen.engine.simulate import simulate_file

result = simulate_file(Path(__file__).with_name("{name}.xosc"), ego={ego!r}, ideal={ideal!r})
for metric, value in result.metrics.items():
    print(f"{{metric:<24}} {{value}}")
'''
