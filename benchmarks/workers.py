"""What workers gain, and what they cost: processes, and a Ray cluster on this machine.

    .venv/bin/python benchmarks/run.py workers

The simulator is a double that burns processor time, honestly: so much of its own for each row.
"""

import importlib.util
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from types import SimpleNamespace

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.engine.workers import Recipe, Stream, Workers, open_workers
from bridgegen.engine.workers.processes import Processes
from bridgegen.jobs.search.loop import run_loop
from bridgegen.results.store import Store
from bridgegen.search.algorithms import Problem, get

ROWS = 40
"""A batch of the paper's PSO."""

CLUSTER = """
import os, sys
from ray.cluster_utils import Cluster
head = {"num_cpus": 1, "include_dashboard": False}
cluster = Cluster(initialize_head=True, head_node_args=head)
cluster.add_node(num_cpus=1)
print(cluster.address, flush=True)
sys.stdin.read()
cluster.shutdown()
os._exit(0)
"""


class Burner:
    """Burns processor time for each row.

    Args:
        seconds: so much [s].
        rows_at_once: see `bridgegen.engine.workers.workers.Portable`.
    """

    runs_at_once = 1
    device = "CPU"

    def __init__(self, seconds: float, rows_at_once: int = 8) -> None:
        self.seconds, self.rows_at_once = seconds, rows_at_once

    @property
    def recipe(self) -> Recipe:
        """See `bridgegen.engine.workers.workers.Portable`."""
        return Recipe.of(Burner, self.seconds, self.rows_at_once)

    def burn(self, X: Float) -> Float:
        """Return eleven numbers for each row."""
        end = time.process_time() + self.seconds * len(X)
        while time.process_time() < end:
            pass
        return np.repeat(X[:, :1], 11, axis=1)


def seconds(pool: Workers, burner: Burner, X: Float) -> float:
    """Return what a batch takes [s]."""
    start = time.perf_counter()
    pool.map(burner, Burner.burn, X)
    return time.perf_counter() - start


def speedup(pairs: int = 7) -> tuple[float, float, float]:
    """Return how much faster two processes are than one: median, least and most of pairs."""
    X, burner = np.zeros((ROWS, 10)), Burner(0.05)
    one, two = Processes(1), Processes(2)
    seconds(one, Burner(0.0), X), seconds(two, Burner(0.0), X)
    ratios = [seconds(one, burner, X) / seconds(two, burner, X) for _ in range(pairs)]
    one.close(), two.close()
    return float(np.median(ratios)), min(ratios), max(ratios)


def overhead(pool: Workers, chunks: int = 200) -> float:
    """Return what a chunk takes that has nothing to do [s], one after the other."""
    X, burner = np.zeros((1, 10)), Burner(0.0, 1)
    seconds(pool, burner, X)
    return min(sum(seconds(pool, burner, X) for _ in range(chunks)) / chunks for _ in range(3))


@contextmanager
def cluster() -> Iterator[None]:
    """Have a cluster of two nodes with a core each, on the loopback interface."""
    os.environ |= {
        "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0",
        "RAY_USAGE_STATS_ENABLED": "0",
        "RAY_AUTH_MODE": "disabled",
        "PYTHONPATH": os.pathsep.join(sys.path),
    }
    process = subprocess.Popen(
        [sys.executable, "-c", CLUSTER],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    assert process.stdout is not None
    os.environ["RAY_ADDRESS"] = process.stdout.readline().strip()
    yield
    del os.environ["RAY_ADDRESS"]
    process.communicate()


def together(campaigns: int, batches: int = 5) -> tuple[float, float]:
    """Return what campaigns take that run at once, and the first one's end as a share of that."""
    X, burner, ends = np.zeros((ROWS, 10)), Burner(0.002), []
    ready = threading.Barrier(campaigns + 1)

    def campaign() -> None:
        with open_workers("ray") as pool:
            seconds(pool, Burner(0.0), X)
            ready.wait()
            for _ in range(batches):
                seconds(pool, burner, X)
            ends.append(time.perf_counter())

    threads = [threading.Thread(target=campaign) for _ in range(campaigns)]
    for one in threads:
        one.start()
    ready.wait()
    start = time.perf_counter()
    for one in threads:
        one.join()
    whole = max(ends) - start
    return whole, (min(ends) - start) / whole


class Uneven(Burner):
    """Waits for each row, 0.02 to 0.2 s by the row's bits, as for a simulator elsewhere."""

    @property
    def recipe(self) -> Recipe:
        """See `bridgegen.engine.workers.workers.Portable`."""
        return Recipe.of(Uneven, 0.0, 1)

    def wait(self, X: Float) -> tuple[float, float, float]:
        """Return the objective of a row, and when it began and ended [s]."""
        begun, dice = time.monotonic(), np.random.default_rng(X[0].view(np.uint64))
        time.sleep(float(np.clip(0.06 * np.exp(0.8 * dice.standard_normal()), 0.02, 0.2)))
        return float(((X - 0.3) ** 2).sum()), begun, time.monotonic()


class Timed:
    """The rows of a search, with the times at which workers evaluate them.

    Attributes:
        times: of each row its beginning and its end [s].
    """

    def __init__(self, rows: Stream[tuple[float, float, float]]) -> None:
        self._rows, self.times = rows, list[tuple[float, float]]()
        self.submit = rows.submit

    def take(self, n: int) -> SimpleNamespace:
        """See `bridgegen.jobs.search.loop.Stream`."""
        results = [one.result for one in self._rows.take(n)]
        self.times += [(begun, ended) for _, begun, ended in results]
        F = np.array([[value] for value, _, _ in results])
        return SimpleNamespace(
            messages={}, cause=None, findings=None, metrics=F, F=F, critical=F[:, 0] < 0.1,
            status=np.zeros(n, np.int8),
        )  # fmt: skip


def idle(count: int, ahead: int, method: str, budget: int = 300) -> float:
    """Return the idle share of processes between the first row's beginning and the last's end."""
    names = [f"x{k}" for k in range(8)]
    search = get(method)(Problem.unnamed(len(names)), 0)
    uneven = Uneven(0.0, 1)

    with (
        tempfile.TemporaryDirectory() as folder,
        Store.create(folder, {}, names, ["m"], n_var=len(names), n_obj=1) as store,
        closing(Processes(count)) as pool,
        closing(pool.stream(uneven, Uneven.wait)) as rows,
    ):
        rows.submit(np.random.default_rng(1).random((2 * count, len(names))))
        rows.take(2 * count)  # all have started
        timed = Timed(rows)
        run_loop(search, lambda U: U, timed, store, budget, ahead=ahead)
    begun, ended = np.array(timed.times).T
    return 1.0 - float((ended - begun).sum() / (count * (ended.max() - begun.min())))


def workers() -> list[tuple[str, str, str]]:
    """Return the table's rows."""
    load = os.getloadavg()[0]
    median, least, most = speedup()
    local = Processes(1)
    idle(2, 8, "surrogate", 40)  # compiled
    waiting = [
        (
            f"idle share, {count} processes, rows of 0.02 to 0.2 s, {method}, --ahead {ahead}",
            f"{idle(count, ahead, method):.3f}",
            "≤ 0.05" if ahead == 16 else "",
        )
        for method in ("es", "surrogate")
        for count in (2, 4)
        for ahead in (0, 8, 16)
    ]
    told = [
        *waiting,
        (f"two processes over one, 50 ms a row (load {load:.1f})", f"{median:.2f}", "≥ 1.8"),
        ("  least and most of 7 pairs", f"{least:.2f} to {most:.2f}", ""),
        ("a chunk that does nothing, a process, ms", f"{1e3 * overhead(local):.2f}", ""),
    ]
    local.close()
    if importlib.util.find_spec("ray") is None:
        return [*told, ("a Ray cluster", "no Ray", "≤ 10 ms a chunk")]
    with cluster():
        with open_workers("ray") as pool:
            told.append(
                ("a chunk that does nothing, Ray, ms", f"{1e3 * overhead(pool):.2f}", "≤ 10")
            )
        alone, _ = together(1)
        ten, first = together(10)
    told += [
        ("ten campaigns at once over ten after another, Ray", f"{ten / (10 * alone):.2f}", "≈ 1"),
        ("  the first of them ends at, of the whole", f"{first:.0%}", ""),
    ]
    return told
