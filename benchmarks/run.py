"""Measure BridgeGen: one command, one table of figures beside their targets.

    .venv/bin/python benchmarks/run.py

Quote medians and ratios: on a shared machine absolute times wander. Each figure is the best of
three, for the machine's other work only ever makes it slower; where it matters, the processor time
stands beside it. Parts may be named: `run.py own_drivers many_actors`. What needs an extra that is
not installed is skipped, and named.
"""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from unittest import mock

import numpy as np
from perception import perception
from rates import Rate, processor_time, rate_of
from traffic import ALL, traffic_rate

from bridgegen.base.compilation.library import KernelLibrary
from bridgegen.base.extras import is_installed
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.openx.convert import import_file
from bridgegen.openx.on_map import on_map
from bridgegen.openx.opendrive.read import read as read_map
from bridgegen.openx.opendrive.road_map import load_map
from bridgegen.results.store import Rows
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.ontology.check import check
from bridgegen.scenario.ontology.files import save
from bridgegen.scenario.ontology.individuals import build
from bridgegen.search.algorithms import Problem, Results, get, names
from bridgegen.search.triage.triage import triage as triage_of
from bridgegen.simulation.embedded import specialised
from bridgegen.simulation.embedded._rollout_kernels import simulate_rows
from workers import workers

SCENARIO = "crossroads-s4"
EXAMPLES = Path(__file__).parents[1] / "docs" / "examples"
TRIVIAL = Path(__file__).with_name("cruises.py")
TOWN05 = Path(__file__).parents[2] / "shared" / "data" / "Town05.xodr"
Row = tuple[str, str, str]
SAYS_ITS_PEAK = """
import atexit, re, pathlib
status = pathlib.Path("/proc/self/status")
atexit.register(lambda: print(re.search(r"VmHWM:\\s+(\\d+)", status.read_text())[1]))
from bridgegen.cli import main; main()
"""  # [KiB]; what wait4 tells counts the parent's memory, from which the process is forked


def best(measure: Callable[[], float], times: int = 3) -> float:
    """Return the smallest of several measurements [s]."""
    return min(measure() for _ in range(times))


def seconds(job: Callable[[], object]) -> float:
    start = time.perf_counter()
    job()
    return time.perf_counter() - start


def cpu_seconds(job: Callable[[], object]) -> float:
    start = processor_time()
    job()
    return processor_time() - start


def rate(
    ego: str, axes: list[str] | None, n: int, *, also: tuple[str, ...] = (), causes: bool = False
) -> Rate:
    """Return how fast scenarios are evaluated, metrics and objective included."""
    scenario = load(SCENARIO)
    space = scenario.space(axes)
    pipeline = Pipeline(scenario, space, PipelineOptions(ego=ego, metrics=also, causes=causes))
    pipeline.choose_objective()
    X = space.decode(np.random.default_rng(0).random((n, space.n_var)))
    return rate_of(pipeline, X)


def told(name: str, rate: Rate, least: int, *, cores: int | None = os.cpu_count()) -> list[Row]:
    """Return the rate, and what it were if nothing else ran, by the time the processors took."""
    idle = (cores or 1) / rate.cpu_seconds
    cpu = f"  its processor time each, µs ({idle:,.0f}/s on {cores} idle)"
    return [
        (f"{name}, scenarios/s", f"{rate.per_second:,.0f}", f"≥ {least:,}"),
        (cpu, f"{1e6 * rate.cpu_seconds:,.0f}", ""),
    ]


def hot_paths() -> list[Row]:
    static = ["static", "participants", "weather"]
    every, usual = rate("reference", None, 4000, also=ALL), rate("reference", None, 4000)
    caused = rate("reference", None, 4000, causes=True)
    return [
        *told("route-follower", rate("route-follower", None, 8000), 10_000),
        *told("reference, perception, all metrics", every, 4000),
        *told("reference, its own metrics", usual, 5000),
        ("  with causes, times the processor time", f"{caused.cpu_seconds / usual.cpu_seconds:.2f}",
         "≤ 2"),
        *told("a road network per row", rate("route-follower", static, 400), 200),
    ]  # fmt: skip


def specialised_code() -> list[Row]:
    """Measure 20,000 rows in specialised code and in generic code, 1,000 each in turn."""
    rows: list[Row] = []
    scenario = load(SCENARIO)
    space = scenario.space()
    blocks = space.decode(np.random.default_rng(0).random((20_000, space.n_var))).reshape(
        20, 1000, -1
    )
    for ego in ("route-follower", "reference"):
        pipeline = Pipeline(scenario, space, PipelineOptions(ego=ego))
        pipeline.choose_objective()
        known = len(specialised._KNOWN)
        while not any(each.address for each in list(specialised._KNOWN.values())[known:]):
            pipeline.evaluate(blocks[0])  # until it is compiled
        special, generic = [], []
        for X in blocks:
            evaluate = partial(pipeline.evaluate, X)
            special.append(cpu_seconds(evaluate))
            with mock.patch.object(
                specialised, "simulate_rows", lambda _, *given: simulate_rows(*given)
            ):
                generic.append(cpu_seconds(evaluate))
        ratio = np.median(np.divide(generic, special))
        rows.append((f"generic code over specialised code, {ego}", f"{ratio:.2f}", "≥ 1.15"))
        each = f"{1e3 * sum(generic) / 20:,.0f} → {1e3 * sum(special) / 20:,.0f}"
        rows.append(("  processor time each, µs", each, ""))
    cost = KernelLibrary.store.read("specialised", "seconds") or 0.0
    rows.append(("  to compile it, in another process, s", f"{cost:.1f}", ""))
    return rows


def own_drivers() -> list[Row]:
    """Measure a driver that does next to nothing, in lock-step; and one that is written twice."""
    trivial = rate(f"{TRIVIAL}:Cruises", None, 1000)
    python = rate(f"{EXAMPLES}/my_driver.py:MyDriver", None, 1000)
    compiled = rate(f"{EXAMPLES}/my_compiled_driver.py:drive", None, 4000)
    return [
        *told("lock-step, a trivial class, N = 1000", trivial, 300, cores=1),
        *told("lock-step, my_driver.py, N = 1000", python, 300, cores=1),
        *told("compiled, the same driver", compiled, 3000),
    ]


def many_actors() -> list[Row]:
    """Measure 30 actors, and what one more costs beside many and beside few."""
    rows = told("30 actors, reference, all metrics", traffic_rate(30, "reference", 80, ALL), 300)
    rows += told("30 actors, route-follower", traffic_rate(30, "route-follower", 200), 300)
    for ego in ("reference", "route-follower"):
        cost = {n: traffic_rate(n, ego, 800 // n).cpu_seconds for n in (10, 40, 80)}
        growth = (cost[80] - cost[40]) / 40 / ((cost[40] - cost[10]) / 30)
        rows.append((f"an actor more among 60 over one among 25, {ego}", f"{growth:.2f}", "≤ 1.3"))
    return rows


def triage() -> list[Row]:
    """Time what is done with ten exported scenarios: robustness, causes, modes, minimal forms."""
    scenario = load("crossroads-s3")
    logical = replace(scenario, objective=replace(scenario.objective, rule="harm"))
    space, rows = logical.space(), []
    for ego in ("route-follower", "reference"):
        pipeline = Pipeline(logical, space, PipelineOptions(ego=ego, causes=True))
        pipeline.choose_objective()
        U = np.random.default_rng(0).random((1000, space.n_var))
        X = space.decode(U)
        came = pipeline.evaluate(X)
        cause = np.zeros(len(X), np.int8) if came.cause is None else came.cause
        ids = np.arange(len(X))
        done = Rows(ids, ids, ids * 0.0, U, X, came.metrics, came.F, came.status.astype(np.int64),
                    came.critical, cause, came.findings)  # fmt: skip
        found = triage_of(pipeline, done, algorithm="pso", seed=0, keep=10)
        cpu = processor_time()
        wall = best(
            lambda p=pipeline, d=done: seconds(
                lambda: triage_of(p, d, algorithm="pso", seed=0, keep=10)
            )
        )
        cpu = (processor_time() - cpu) / 3
        n = len(found.exports)
        rows += [
            (f"triage of {n} exported scenarios, {ego}, s", f"{wall:.2f}", "≤ 2"),
            ("  its processor time, s", f"{cpu:.2f}", ""),
        ]
    return rows


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
        command = [sys.executable, "-c", SAYS_ITS_PEAK]
        command += ["search", SCENARIO, "--budget", "1000", "--out", f"{folder}/run"]
        start = time.perf_counter()
        done = subprocess.run(
            command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True
        )
        peak = int(done.stdout.split()[-1])
        return time.perf_counter() - start, peak / 1024


def processes() -> list[Row]:
    cold, _ = whole_process(cold=True)
    runs = [whole_process(cold=False) for _ in range(4)][1:]
    return [
        ("search of 1000, first run ever, s", f"{cold:.1f}", "≤ 90"),
        ("search of 1000, compiled, s", f"{min(wall for wall, _ in runs):.2f}", "≤ 5"),
        ("its peak memory, MiB", f"{max(peak for _, peak in runs):.0f}", "≤ 1024"),
    ]


def one_file() -> list[Row]:
    """Time a process that simulates one file, its kernels compiled before; and --help."""
    scenario = load(SCENARIO)
    space = scenario.space()
    pipeline = Pipeline(scenario, space)
    with tempfile.TemporaryDirectory() as folder:
        pipeline.choose_objective()
        write_scenario(pipeline, space.row({}), Path(folder), "a")
        simulate = [command("simulate", f"{folder}/a.xosc") for _ in range(5)][1:]
    helps = [command("--help") for _ in range(3)]
    return [
        ("simulate FILE.xosc, whole process, s", f"{min(w for w, _ in simulate):.2f}", "≤ 2"),
        ("  its processor time, s", f"{min(cpu for _, cpu in simulate):.2f}", ""),
        ("--help, whole process, s", f"{min(wall for wall, _ in helps):.2f}", "≤ 0.2"),
    ]


def command(*words: str) -> tuple[float, float]:
    """Return wall and processor time [s] of a command."""
    code = [sys.executable, "-c", "from bridgegen.cli import main; main()", *words]
    start = time.perf_counter()
    process = subprocess.Popen(code, stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise RuntimeError(f"{words[0]} ended with status {status}")
    return time.perf_counter() - start, usage.ru_utime + usage.ru_stime


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


LEARNERS = ("nsga2-dt", "map-elites")
"""The algorithms that may take longer: they fit trees, or keep an archive."""

SURROGATES = ("turbo", "surrogate")
"""The algorithms that fit Gaussian processes: 15 ms a row."""


def algorithms() -> list[Row]:
    """Time what each algorithm takes for 40 rows, over a search of 1000, beside the simulator."""
    rows: list[Row] = []
    skipped: dict[str, list[str]] = {}
    for name in names():
        if getattr(get(name), "is_adversary", False):
            continue  # it drives within scenarios, of which there are none here
        extra = getattr(get(name), "extra", None)
        if extra and not is_installed(extra):
            skipped.setdefault(extra, []).append(name)
            continue
        target = "≤ 50" if name in LEARNERS else "≤ 5"
        if name in SURROGATES:
            target = "≤ 600"
        elif hasattr(get(name), "restore"):
            target = ""  # it trains a network
        taken = best(lambda name=name: 40 * seconds_a_row(name))
        rows.append((f"{name}, for 40 rows, ms", f"{1e3 * taken:.2f}", target))
    rows += [
        (f"{', '.join(some)}: skipped, need the extra {extra}", "–", "")
        for extra, some in skipped.items()
    ]
    return rows


def seconds_a_row(name: str) -> float:
    """Return what asking and telling takes a row [s]; a tenth of the space is critical."""
    method = get(name)
    n_obj = 2 if method.objectives == "many" else 1
    algorithm = method(Problem(tuple(f"x{i}" for i in range(10)), ("d_min", "v_d"), n_obj), 0)
    asked, taken = 0, 0.0
    while asked < 1000:
        start = time.perf_counter()
        U = algorithm.ask()
        taken += time.perf_counter() - start
        if not len(U):
            break
        F = np.stack([((U - c) ** 2).sum(axis=1) for c in (0.3, 0.5)], axis=1)
        n = len(U)
        results = Results(
            F[:, :n_obj], np.ones(n, bool), F[:, 0] < 0.85, F.copy(), np.zeros(n, np.int8)
        )
        taken += seconds(lambda U=U, results=results: algorithm.tell(U, results))
        asked += n
    return taken / asked


def million() -> list[Row]:
    """Time a million evaluations of nothing, through the loop and into the store."""
    rows = []
    for name in ("random", "pso"):
        script = Path(__file__).with_name("million.py")
        done = subprocess.run(
            [sys.executable, str(script), name], stdout=subprocess.PIPE, check=True, text=True
        )
        wall, peak, _ = done.stdout.split()
        rows += [
            (f"1,000,000 evaluations of {name}, peak memory, MiB", peak, "≤ 2,048"),
            ("  s, without the simulator", wall, ""),
        ]
    return rows


def town() -> list[Row]:
    if not TOWN05.exists():
        return [("Town05 read, s", "no map", "≤ 1")]
    with tempfile.TemporaryDirectory() as folder:

        def once() -> float:
            out = Path(folder) / "town.owl"
            out.unlink(missing_ok=True)
            return seconds(lambda: import_file(TOWN05, out))

        scenario = load(SCENARIO)
        town05 = load_map(TOWN05, None, scenario)
        placed = on_map(scenario, town05)
        pipeline = Pipeline(
            placed, placed.space(), PipelineOptions(ego="reference"), road_map=town05
        )
        model = pipeline.runner.concrete(placed.space().row({})).roads
        ready = best(lambda: seconds(lambda: pipeline.runner.simulator.roads([model])))
        tables = pipeline.runner.simulator.roads([model]).tables
        carried = sum(np.asarray(table).nbytes for table in tables)
        return [
            ("Town05 compiled for a scenario, s", f"{ready:.2f}", "≤ 2"),
            ("  what of it the rollout carries, KiB", f"{carried / 1024:,.0f}", "≤ 1,024"),
            ("Town05 read, s", f"{best(lambda: seconds(lambda: read_map(TOWN05))):.2f}", "≤ 1"),
            ("Town05 imported, s", f"{best(once):.2f}", "≤ 5"),
        ]


PARTS: dict[str, Callable[[], list[Row]]] = {
    part.__name__: part
    for part in (
        hot_paths, specialised_code, own_drivers, many_actors, triage, senses, decoder, algorithms,
        files, town, one_file, processes, million, workers,
    )
}  # fmt: skip


def main() -> None:
    unknown = [name for name in sys.argv[1:] if name not in PARTS]
    if unknown:
        sys.exit(f"no such part: {', '.join(unknown)}; known: {', '.join(PARTS)}")
    rows: list[Row] = []
    for name in sys.argv[1:] or PARTS:
        rows += PARTS[name]()
    load1 = os.getloadavg()[0]
    print(f"{os.cpu_count()} cores, load {load1:.1f}, Python {sys.version.split()[0]}")
    width = max(len(name) for name, _, _ in rows)
    for name, value, target in rows:
        print(f"{name:<{width}}  {value:>10}  {target}")


if __name__ == "__main__":
    main()
