"""Measure BridgeGen: one command, one table of figures beside their targets.

    .venv/bin/python benchmarks/run.py

Quote medians and ratios: on a shared machine absolute times wander. Each figure is the best of
three, for the machine's other work only ever makes it slower.
"""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
from perception import perception

from bridgegen.campaign.handover import write_scenario
from bridgegen.odd.reader import load
from bridgegen.odd.scenario import LogicalScenario
from bridgegen.ontology.check import check
from bridgegen.ontology.files import save
from bridgegen.ontology.individuals import build
from bridgegen.openx.convert import import_file
from bridgegen.openx.opendrive.read import read as read_map
from bridgegen.pipeline import Pipeline
from bridgegen.search import get, names

SCENARIO = "crossroads-s4"
TOWN05 = Path(__file__).parents[2] / "shared" / "data" / "Town05.xodr"
Row = tuple[str, str, str]


def best(measure: Callable[[], float], times: int = 3) -> float:
    """Return the smallest of several measurements [s]."""
    return min(measure() for _ in range(times))


def seconds(job: Callable[[], object]) -> float:
    start = time.perf_counter()
    job()
    return time.perf_counter() - start


def rate(ego: str, axes: list[str] | None, n: int) -> float:
    """Return scenarios a second, metrics and objective included."""
    scenario = load(SCENARIO)
    space = scenario.space(axes)
    pipeline = Pipeline(scenario, space, ego=ego)
    pipeline.choose_objective()
    X = space.decode(np.random.default_rng(0).random((n, space.n_var)))
    pipeline.evaluate(X[:64])
    return n / best(lambda: seconds(lambda: pipeline.evaluate(X)))


def hot_paths() -> list[Row]:
    return [
        ("route-follower, scenarios/s", f"{rate('route-follower', None, 8000):,.0f}", "≥ 10,000"),
        ("reference, scenarios/s", f"{rate('reference', None, 8000):,.0f}", "≥ 5,000"),
        (
            "a road network per row, scenarios/s",
            f"{rate('route-follower', ['static', 'participants', 'weather'], 400):,.0f}",
            "≥ 200",
        ),
    ]


def senses() -> list[Row]:
    """Time perception and tracking alone, on one core."""
    return [
        ("perception of 1 body for 20 s, µs", f"{1e6 * perception(1, 100):.0f}", "≤ 150"),
        ("perception of 30 bodies for 20 s, µs", f"{1e6 * perception(30, 5):.0f}", "≤ 6,000"),
    ]


def whole_process(cold: bool) -> tuple[float, float]:
    """Return wall time [s] and peak memory [MiB] of a search of 1000 evaluations."""
    with tempfile.TemporaryDirectory() as folder:
        environment = dict(os.environ)
        if cold:
            environment["NUMBA_CACHE_DIR"] = f"{folder}/cache"
        command = [sys.executable, "-c", "from bridgegen.cli import main; main()"]
        command += ["search", SCENARIO, "--budget", "1000", "--out", f"{folder}/run"]
        start = time.perf_counter()
        process = subprocess.Popen(
            command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        _, status, usage = os.wait4(process.pid, 0)
        if status:
            raise RuntimeError(f"the search ended with status {status}")
        return time.perf_counter() - start, usage.ru_maxrss / 1024


def processes() -> list[Row]:
    cold, _ = whole_process(cold=True)
    runs = [whole_process(cold=False) for _ in range(4)][1:]
    return [
        ("search of 1000, first run ever, s", f"{cold:.1f}", "≤ 90"),
        ("search of 1000, compiled, s", f"{min(wall for wall, _ in runs):.2f}", "≤ 5"),
        ("its peak memory, MiB", f"{max(peak for _, peak in runs):.0f}", "≤ 1024"),
    ]


def files() -> list[Row]:
    """Time one scenario's owl + xodr + xosc, SHACL-checked."""
    scenario = load(SCENARIO)
    space = scenario.space()
    pipeline = Pipeline(scenario, space)
    pipeline.choose_objective()
    X = space.decode(np.random.default_rng(1).random((12, space.n_var)))
    with tempfile.TemporaryDirectory() as folder:
        each = [seconds(lambda x=x: write_scenario(pipeline, x, Path(folder), "a")) for x in X]
        crowd = best(lambda: seconds(lambda: thirty(Path(folder) / "crowd.owl")))
    return [
        ("one scenario's files, checked, ms", f"{1e3 * float(np.median(each[2:])):.0f}", "≤ 100"),
        ("30 participants built, saved, checked, ms", f"{1e3 * crowd:.0f}", "≤ 150"),
    ]


@cache
def crowd_of() -> tuple[LogicalScenario, dict[str, float]]:
    scenario = load(Path(__file__).with_name("crowd.yaml"))
    space = scenario.space()
    return scenario, space.values(space.row({}))


def thirty(path: Path) -> None:
    """Build, save and check a scenario of thirty participants."""
    scenario, values = crowd_of()
    individuals = build(scenario, values, driver="reference")
    save(individuals, path)
    if check(individuals, scenario):
        raise RuntimeError("the crowd breaks a rule")


def decoder() -> list[Row]:
    space = load(SCENARIO).space()
    U = np.random.default_rng(2).random((1000, space.n_var))
    fastest = best(lambda: seconds(lambda: space.decode(U)), 30)
    return [("decoder at 1000 rows, rows/ms", f"{1.0 / fastest:,.0f}", "≥ 1,000")]


def algorithms() -> list[Row]:
    """Time ask and tell of a batch of 40 beside the simulator."""
    rows = []
    for name in names():
        algorithm = get(name)(10, 1, 0)
        tell = algorithm.tell
        times = []
        for _ in range(25):
            start = time.perf_counter()
            U = algorithm.ask()
            asked = time.perf_counter() - start
            F = ((U - 0.3) ** 2).sum(axis=1, keepdims=True)
            ok = np.ones(len(U), dtype=bool)
            times.append(asked + seconds(lambda U=U, F=F, ok=ok, tell=tell: tell(U, F, ok)))
        rows.append((f"{name}, a batch of 40, ms", f"{1e3 * float(np.median(times)):.2f}", "≤ 5"))
    return rows


def town() -> list[Row]:
    if not TOWN05.exists():
        return [("Town05 read, s", "no map", "≤ 1")]
    with tempfile.TemporaryDirectory() as folder:

        def once() -> float:
            out = Path(folder) / "town.owl"
            out.unlink(missing_ok=True)
            return seconds(lambda: import_file(TOWN05, out))

        return [
            ("Town05 read, s", f"{best(lambda: seconds(lambda: read_map(TOWN05))):.2f}", "≤ 1"),
            ("Town05 imported, s", f"{best(once):.2f}", "≤ 5"),
        ]


def main() -> None:
    rows: list[Row] = []
    for part in (hot_paths, senses, decoder, algorithms, files, town, processes):
        rows += part()
    load1 = os.getloadavg()[0]
    print(f"{os.cpu_count()} cores, load {load1:.1f}, Python {sys.version.split()[0]}")
    width = max(len(name) for name, _, _ in rows)
    for name, value, target in rows:
        print(f"{name:<{width}}  {value:>10}  {target}")


if __name__ == "__main__":
    main()
