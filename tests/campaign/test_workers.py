"""A search by several processes: the same bits, whoever is killed; and nobody is left over."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from tests.approval import refuses

import bridgegen as bg
from bridgegen.base.errors import UnknownNameError
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers.processes import Processes
from bridgegen.jobs.search import SearchCallbacks
from bridgegen.results.store import Store
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.rollout import WORKER_ENDED

DRIVERS = Path(__file__).parents[1] / "ego" / "drivers.py"
DOUBLES = Path(__file__).parents[1] / "workers" / "doubles"
SEARCH = {
    "scenario": "paper/crossroads-s4", "algorithm": "pso", "budget": 160, "seed": 5, "keep": 0,
    "triage": "none", "ego": "reference", "weights": "entropy",
    "objective": {"d_min": None, "v_d": None},
}  # fmt: skip


def rows_of(folder: Path):
    with Store.open(folder) as store:
        return store.read()


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    return bg.run_search(**SEARCH, out=tmp_path_factory.mktemp("threads") / "run")


@pytest.mark.thorough
@pytest.mark.parametrize("count", [1, 3])
def test_processes_find_what_threads_find_whoever_is_killed(
    undisturbed, tmp_path, count, same_rows
):
    pool, killed = Processes(count), []

    def kill(progress) -> None:
        if progress.evaluations in (40, 120):
            victim = next(pid for pid in reversed(pool.pids) if pid not in killed)
            os.kill(victim, signal.SIGKILL)
            killed.append(victim)

    run = bg.run_search(
        **SEARCH,
        out=tmp_path / "run",
        workers=pool,
        callbacks=SearchCallbacks(batch=kill),
    )
    pool.close()
    assert len(set(killed)) == 2
    assert same_rows(run.folder, undisturbed.folder)
    assert run.settings == undisturbed.settings
    assert not pool.pids


@pytest.mark.thorough
def test_a_row_that_takes_its_process_with_it_fails_alone(monkeypatch):
    monkeypatch.syspath_prepend(str(DOUBLES))
    from poisoned import Poisoned

    scenario = load("crossroads-s4")
    space = scenario.space()
    X = space.decode(np.random.default_rng(0).random((4, space.n_var)))
    pool = Processes(2)
    pipeline = Poisoned(scenario, space, PipelineOptions(causes=True), workers=pool)
    pipeline.choose_objective()
    pipeline.poison = X[3]
    found = pipeline.evaluate(X)
    pool.close()
    assert found.status.tolist() == [0, 0, 0, WORKER_ENDED]
    assert found.messages == {3: "by SIGSEGV"}
    assert np.isnan(found.metrics[3]).all()
    assert not found.critical[3]
    others = np.arange(3)
    calm = Pipeline(scenario, space, PipelineOptions(causes=True))
    calm.choose_objective()
    expected = calm.evaluate(X[others])
    for name in ("metrics", "F", "critical", "cause"):
        assert getattr(found, name)[others].tobytes() == getattr(expected, name).tobytes()
    assert np.isfinite(found.F).all()


@pytest.mark.thorough
def test_a_driver_of_ones_own_is_made_in_each_process(tmp_path, same_rows):
    search = {
        "scenario": "crossroads-s1",
        "algorithm": "random",
        "budget": 16,
        "keep": 0,
        "triage": "none",
    }
    ego = f"{DRIVERS}:FailsFast"
    one = bg.run_search(**search, ego=ego, out=tmp_path / "one")
    two = bg.run_search(**search, ego=ego, out=tmp_path / "two", workers=2)
    assert one.summary.failed == two.summary.failed > 0
    assert same_rows(one.folder, two.folder)
    assert one.failures == two.failures


def test_a_wrong_name_is_told_as_ever(tmp_path):
    with refuses(UnknownNameError, "d_mim"):
        bg.run_search(**SEARCH, metrics=["d_mim"], out=tmp_path / "run", workers=2)


def start(folder: Path, *more: str) -> subprocess.Popen[str]:
    code = "import sys; from bridgegen.cli import main; sys.exit(main())"
    words = ["search", "crossroads-s4", "--budget", "200000", "--workers", "2"]
    return subprocess.Popen(
        [sys.executable, "-c", code, *words, "--algorithm", "random", "--out", str(folder), *more],
        stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip


def children(pid: int) -> set[int]:
    """Return the numbers of a process's children."""
    found = set()
    for task in Path(f"/proc/{pid}/task").iterdir():
        found |= {int(one) for one in (task / "children").read_text().split()}
    return found


def workers_of(process: subprocess.Popen[str], folder: Path) -> set[int]:
    """Wait until a search is under way; return its processes."""
    end = time.monotonic() + 120.0
    while time.monotonic() < end and process.poll() is None:
        if (folder / "run.sqlite").exists() and len(rows_of(folder)) >= 100:
            return children(process.pid)
        time.sleep(0.05)
    raise AssertionError(f"no rows in time: {process.stderr and process.stderr.read()}")


def gone(pids: set[int], seconds: float) -> bool:
    end = time.monotonic() + seconds
    while any(Path(f"/proc/{pid}").exists() for pid in pids):
        if time.monotonic() > end:
            return False
        time.sleep(0.02)
    return True


@pytest.mark.thorough
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_processes_end_with_the_search_however_it_ends(tmp_path, how):
    process = start(tmp_path / "run")
    workers = workers_of(process, tmp_path / "run")
    assert len(workers) == 2
    os.kill(process.pid, how)
    _, errors = process.communicate(timeout=30)
    assert gone(workers, 10.0)
    assert len(rows_of(tmp_path / "run")) >= 100
    if how is signal.SIGINT:
        assert process.returncode == 130
        assert f"bridgegen resume {tmp_path / 'run'}" in errors
        assert "Traceback" not in errors
