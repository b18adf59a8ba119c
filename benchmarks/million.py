"""A million evaluations through the campaign's loop: how long, and how much memory.

    .venv/bin/python benchmarks/million.py random|pso [EVALUATIONS]

The evaluation is trivial, the loop and the store are the real ones: ten parameters, the paper's
number of metrics. Prints seconds, the peak of memory [MiB] of the process, and the store's bytes.
"""

import re
import sys
import tempfile
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.jobs.search.loop import run_loop
from bridgegen.results.store import Store
from bridgegen.search.algorithms import Problem, get

PARAMETERS = tuple(f"p{i}" for i in range(10))
METRICS = tuple(f"m{i}" for i in range(11))


def evaluate(X: Float) -> SimpleNamespace:
    """Return a bowl; its inside is critical."""
    F = ((X - 0.3) ** 2).sum(axis=1, keepdims=True)
    metrics = np.repeat(F, len(METRICS), axis=1)
    status = np.zeros(len(X), np.int8)
    critical = F[:, 0] < 0.5
    return SimpleNamespace(
        messages={}, cause=None, findings=None, metrics=metrics, F=F, critical=critical,
        status=status,
    )  # fmt: skip


def main() -> None:
    name, budget = sys.argv[1], int((sys.argv[2:] or ["1000000"])[0])
    algorithm = get(name)(Problem(PARAMETERS, METRICS), 0)
    start = time.perf_counter()
    with (
        tempfile.TemporaryDirectory() as folder,
        Store.create(
            Path(folder) / "run", {}, PARAMETERS, METRICS, n_var=len(PARAMETERS), n_obj=1
        ) as store,
    ):
        result = run_loop(algorithm, lambda U: U, evaluate, store, budget)
        if result.evaluations != budget:
            sys.exit(f"{name} ended after {result.evaluations} evaluations: {result.reason}")
        size = sum(file.stat().st_size for file in store.folder.glob("run.sqlite*"))
    peak = re.search(r"VmHWM:\s+(\d+)", Path("/proc/self/status").read_text())
    assert peak is not None
    print(f"{time.perf_counter() - start:.2f} {int(peak[1]) / 1024:.0f} {size}")


if __name__ == "__main__":
    main()
