"""Memory of a long run: searching it, resuming it, writing its page again, serving its page.

    .venv/bin/python benchmarks/long_run.py [ROWS ...]        # 1e4, 1e5 and 1e6 by default

The run is `crossroads-s4` by random search, with the real loop, store, triage, export and report.
Only its evaluations are not simulated: rows take, in turn, the results of some that were, of which
`CRITICAL` are critical, as in a search that finds what it looks for. Each step has a process of its
own, whose peak of resident memory [MiB] and seconds are printed. A million rows take four minutes.
"""

import re
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import Interrupted
from bridgegen.engine.evaluation import Evaluation
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.search.campaign import SearchCallbacks, resume, run_search
from bridgegen.jobs.view.run_view import RunView
from bridgegen.scenario.language.reader import load

SCENARIO = "crossroads-s4"
SIZES = (10_000, 100_000, 1_000_000)
SIMULATED, RESULTS, CRITICAL = 4_096, 2_048, 0.3
STEPS = ("search", "resume", "report", "view")


class Tiled:
    """`Pipeline.evaluate` with the results of other rows, in turn."""

    def __init__(self) -> None:
        scenario = load(SCENARIO)
        space = scenario.space()
        pipeline = Pipeline(scenario, space)
        pipeline.choose_objective()
        U = np.random.default_rng(0).random((SIMULATED, space.n_var))
        self._results = pipeline.evaluate(space.decode(U) + 0.0)
        critical = np.flatnonzero(self._results.critical)
        others = np.flatnonzero(~self._results.critical)
        hits = round(CRITICAL * RESULTS)
        rows = np.concatenate([np.resize(critical, hits), others[: RESULTS - hits]])
        self._rows = np.random.default_rng(0).permutation(rows)
        self._next = 0

    def __call__(self, X: Float) -> Evaluation:
        """Return results for as many rows as X has."""
        at = self._rows[(self._next + np.arange(len(X))) % RESULTS]
        self._next += len(X)
        all_of = self._results
        return replace(
            all_of, metrics=all_of.metrics[at], F=all_of.F[at], critical=all_of.critical[at],
            status=all_of.status[at], findings=all_of.findings.take(at), messages={},
            cause=None if all_of.cause is None else all_of.cause[at],
        )  # fmt: skip


def search(folder: Path, rows: int, *, until: int | None = None) -> None:
    """Make a run; until so many rows are recorded, if that is said."""
    tiled = Tiled()
    Pipeline.evaluate = lambda self, X: tiled(X)  # type: ignore[method-assign]

    def batch(progress: object) -> None:
        if until is not None and progress.evaluations >= until:  # type: ignore[attr-defined]
            raise KeyboardInterrupt

    try:
        run_search(
            SCENARIO, algorithm="random", settings={"population": 400}, budget=rows, seed=0,
            out=folder, callbacks=SearchCallbacks(batch=batch),
        )  # fmt: skip
    except Interrupted:
        if until is None:
            raise


def step(name: str, folder: Path, rows: int) -> None:
    """Do one step, and print its seconds, its peak of memory [MiB] and the page's bytes."""
    start, page = time.perf_counter(), 0
    if name == "search":
        search(folder, rows)
    elif name == "begin":
        search(folder, rows, until=rows - 800)
    elif name in ("resume", "report"):  # of a finished run: its files are written again
        resume(folder)
    else:
        page = len(RunView(folder).page())
    if name != "begin":
        page = page or (folder / "report.html").stat().st_size
    peak = re.search(r"VmHWM:\s+(\d+)", Path("/proc/self/status").read_text())
    assert peak is not None
    print(f"{time.perf_counter() - start:.1f} {int(peak[1]) / 1024:.0f} {page}")


def main() -> None:
    if sys.argv[1:2] == ["--step"]:
        step(sys.argv[2], Path(sys.argv[3]), int(sys.argv[4]))
        return
    sizes = [int(float(one)) for one in sys.argv[1:]] or SIZES
    print(f"{'rows':>10}{'step':>10}{'seconds':>10}{'memory, MiB':>14}{'page, MB':>11}", flush=True)
    for rows in sizes:
        with tempfile.TemporaryDirectory() as folder:
            whole, cut = Path(folder) / "whole", Path(folder) / "cut"
            made = {"search": whole, "begin": cut, "resume": cut, "report": whole, "view": whole}
            for name, run in made.items():
                command = [sys.executable, __file__, "--step", name, str(run), str(rows)]
                done = subprocess.run(command, stdout=subprocess.PIPE, check=True)
                seconds, peak, page = map(float, done.stdout.split())
                if name in STEPS:
                    print(
                        f"{rows:>10,}{name:>10}{seconds:>10.1f}{peak:>14.0f}{page / 1e6:>11.1f}",
                        flush=True,
                    )


if __name__ == "__main__":
    main()
