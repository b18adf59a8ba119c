"""What reproduces a failure with the planner alone: what it saw in that row, and a script."""

import importlib
import io
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from bridgegen.base.disk import write_whole
from bridgegen.drivers import is_planner
from bridgegen.drivers.interface import Observation, Scene
from bridgegen.drivers.planners import planners
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Threads
from bridgegen.jobs.benchmark.observing import observer, recorded
from bridgegen.jobs.search.restored import searched
from bridgegen.jobs.search.run import Run
from bridgegen.results.store.rows import Rows

OBSERVATIONS, SCRIPT = "-observations.npz", "-reproduce.py"
"""Ends of the names of the files, beside ``0001.xosc``."""


def write_reproductions(run: Run, rows: Rows) -> dict[str, str]:
    """Write a script beside each exported scenario, and what its planner saw if it needs that.

    Returns:
        By name of a scenario, why its script needs BridgeGen though its planner could do without.

    Raises:
        StorageError: a file cannot be written.
    """
    notes = {}
    adapter = _adapter(run.settings.ego)
    for one in run.exported():
        stem = run.folder / "critical" / one.name
        text, seen = "", {}
        if adapter is not None:
            try:
                seen = _seen(run, rows, one.evaluation, adapter.export)
                text = adapter.reproduction(f"{one.name}{OBSERVATIONS}")
            except Exception as error:  # of a planner, or of its adapter
                notes[one.name] = f"{type(error).__name__}: {error}"
        if seen:
            _write_arrays(stem.with_name(f"{one.name}{OBSERVATIONS}"), seen)
        script = text or _with_bridgegen(run, one.name)
        write_whole(stem.with_name(f"{one.name}{SCRIPT}"), [script.encode()])
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
        pipeline.simulator.stop()
        scene, observations = recorded(Path(name))
    return {key: np.asarray(one) for key, one in export(observations, scene).items()}


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
