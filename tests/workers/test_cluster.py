"""A Ray cluster of two nodes on this machine: killed workers, a killed node, a lost cluster.

Needs the extra 'ray'. Everything talks over the loopback interface.
"""

import importlib.util
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from tests.approval import refuses

import bridgegen as bg
from bridgegen.base.errors import UnknownNameError, WorkersError
from bridgegen.engine.workers import Lost, open_workers
from bridgegen.engine.workers.cluster import Cluster
from bridgegen.jobs.search import SearchCallbacks
from bridgegen.results.store import Store

pytestmark = [
    pytest.mark.ray,
    pytest.mark.skipif(importlib.util.find_spec("ray") is None, reason="ray is not installed"),
]
NODES = Path(__file__).parent / "doubles" / "two_nodes.py"
DRIVERS = Path(__file__).parents[1] / "ego" / "drivers.py"
LOCAL = {
    "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0",  # loopback, not this machine's address
    "RAY_AUTH_MODE": "disabled",  # whatever token somebody keeps in the home folder
    "RAY_health_check_period_ms": "500",
    "RAY_health_check_timeout_ms": "10000",  # a busy node is not a dead one
    "RAY_health_check_failure_threshold": "2",
    "RAY_USAGE_STATS_ENABLED": "0",
    "BRIDGEGEN_IDLE_SECONDS": "600",
}
X = np.arange(20.0)


def free_port() -> int:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return int(taken.getsockname()[1])


CLIENT_PORT = free_port()


class TwoNodes:
    """Two nodes with a core each."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, NODES, str(CLIENT_PORT)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
        )  # fmt: skip
        self.address = self._answer()

    def obey(self, order: str) -> None:
        """Have a node killed ("kill node") or added ("grow"), or the head ("kill head")."""
        self._process.stdin.write(f"{order}\n")
        self._process.stdin.flush()
        assert self._answer() == "done"

    def end(self) -> None:
        self._process.communicate(timeout=30)

    def _answer(self) -> str:
        return self._process.stdout.readline().strip()


@pytest.fixture(autouse=True)
def in_time() -> Iterator[None]:
    """A test that hangs ends, with where it was."""

    def too_late(*_):
        raise TimeoutError("four minutes")

    usual = signal.signal(signal.SIGALRM, too_late)
    signal.alarm(240)  # Ray's client tries for 40 s, thrice at most
    yield
    signal.alarm(0)
    signal.signal(signal.SIGALRM, usual)


@pytest.fixture(scope="module")
def doubles(doubles_can_be_imported):
    import worker_doubles

    return worker_doubles


@pytest.fixture(scope="module")
def nodes(doubles) -> Iterator[TwoNodes]:
    with pytest.MonkeyPatch.context() as patch:
        for name, value in LOCAL.items():
            patch.setenv(name, value)
        patch.setenv("PYTHONPATH", os.pathsep.join(sys.path))  # where actors find our doubles
        made = TwoNodes()
        patch.setenv("RAY_ADDRESS", made.address)
        yield made
        made.end()


@pytest.fixture
def cluster(nodes) -> Iterator[Cluster]:
    with open_workers("ray") as workers:
        assert isinstance(workers, Cluster)
        yield workers


def joined(parts) -> np.ndarray:
    return np.concatenate([part.result for part in parts])


def actors() -> list[int]:
    """Return the numbers of our actors' processes."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        try:
            if b"ray::_RemoteActor" in path.read_bytes():
                found.append(int(path.parent.name))
        except (FileNotFoundError, ProcessLookupError):
            continue
    return found


def wait_for(what) -> None:
    end = time.monotonic() + 30.0
    while not what():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_from_outside_of_the_cluster(nodes, doubles, monkeypatch):
    """By Ray's own client, as from a machine that is no node of it."""
    monkeypatch.setenv("BRIDGEGEN_IDLE_SECONDS", "1")
    with open_workers(f"ray://127.0.0.1:{CLIENT_PORT}") as workers:
        assert (joined(workers.map(doubles.Doubler(), doubles.Doubler.double, X)) == 2.0 * X).all()


def test_actors_that_nobody_needs_make_room(nodes, doubles, monkeypatch):
    monkeypatch.setenv("BRIDGEGEN_IDLE_SECONDS", "1")
    with open_workers("ray") as workers:
        workers.map(doubles.Doubler(), doubles.Doubler.double, X)
        assert 1 <= len(actors()) <= 2
    wait_for(lambda: not actors())


def test_rows_come_back_in_order_from_both_nodes(cluster, doubles):
    doubler = doubles.Doubler()
    assert (joined(cluster.map(doubler, doubles.Doubler.double, X)) == 2.0 * X).all()
    assert cluster.count == 2
    pids = {
        part.result for part in cluster.map(doubler, doubles.Doubler.process_id, np.arange(400.0))
    }
    assert pids <= set(actors())


def test_campaigns_share_the_same_actors(nodes, doubles):
    """Ten at once: no more workers than cores, and nobody waits for another one's end."""
    done = []

    def campaign(k: int) -> None:
        with open_workers("ray") as workers:
            for _ in range(3):
                parts = workers.map(doubles.Doubler(), doubles.Doubler.double, X + k)
            done.append((joined(parts) == 2.0 * (X + k)).all())

    threads = [threading.Thread(target=campaign, args=(k,)) for k in range(10)]
    for one in threads:
        one.start()
    for one in threads:
        one.join()
    assert done == [True] * 10
    assert 1 <= len(actors()) <= 2  # one may have done all before the other has started


def test_a_killed_worker_costs_nothing_and_rows_that_kill_are_lost_alone(
    cluster, doubles, tmp_path
):
    parts = cluster.map(doubles.Doubler(), doubles.Doubler.double_once_killed, X, tmp_path)
    assert (joined(parts) == 2.0 * X).all()
    few = X[5:9]
    parts = cluster.map(doubles.Doubler(2), doubles.Doubler.double_but, few, (6.0,))
    found = [
        x for part in parts for x in ([None] if isinstance(part.result, Lost) else part.result)
    ]
    assert found == [None if x == 6.0 else 2.0 * x for x in few]


def test_what_is_raised_arrives_as_it_was(cluster, doubles):
    with refuses(UnknownNameError, "seven"):
        cluster.map(doubles.Doubler(), doubles.Doubler.refuse, X)
    with pytest.raises(ZeroDivisionError, match="by design"):
        cluster.map(doubles.Doubler(), doubles.Doubler.fail, X)


SEARCH = {
    "scenario": "crossroads-s4", "algorithm": "pso", "budget": 120, "seed": 5, "keep": 0,
    "ego": "reference", "weights": "entropy", "objective": {"d_min": None, "v_d": None},
}  # fmt: skip


def rows_of(folder: Path):
    with Store.open(folder) as store:
        return store.read()


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    return bg.run_search(**SEARCH, triage="short", out=tmp_path_factory.mktemp("threads") / "run")


def test_a_killed_worker_and_a_killed_node_in_mid_run_change_nothing(
    nodes, cluster, undisturbed, tmp_path, same_rows
):
    done = threading.Event()

    def disturb(progress) -> None:
        if progress.evaluations == 40:
            # While the next batch is worked on.
            threading.Timer(0.05, lambda: os.kill(actors()[0], signal.SIGKILL)).start()
        if progress.evaluations == 80:
            threading.Timer(0.02, lambda: (nodes.obey("kill node"), done.set())).start()

    run = bg.run_search(
        **SEARCH,
        triage="short",
        out=tmp_path / "run",
        workers=cluster,
        callbacks=SearchCallbacks(batch=disturb),
    )
    assert done.wait(60.0)
    assert same_rows(run.folder, undisturbed.folder)
    nodes.obey("grow")


def test_a_comparisons_runs_share_the_cluster(nodes, tmp_path, monkeypatch):
    """Two runs at a time, each with its own way to the cluster, which it finds by itself."""
    monkeypatch.delenv("RAY_ADDRESS")
    grid = {"algorithms": ["random", "pso"], "seeds": 1, "budget": 40, "deliver": False}
    there = bg.compare("crossroads-s4", **grid, workers="ray", out=tmp_path / "there")
    here = bg.compare("crossroads-s4", **grid, workers=1, out=tmp_path / "here")
    assert not there.gaps
    for cell in there.plan.cells:
        one, other = there.plan.folder(cell), here.plan.folder(cell)
        assert rows_of(one).F.tobytes() == rows_of(other).F.tobytes()
        assert rows_of(one).X.tobytes() == rows_of(other).X.tobytes()


def test_a_driver_of_ones_own_is_carried_to_where_it_is_not(
    cluster, undisturbed, tmp_path, monkeypatch, same_rows
):
    monkeypatch.chdir(tmp_path)  # actors are elsewhere: a relative path leads nowhere for them
    Path("mine.py").write_text(DRIVERS.read_text("utf-8"), "utf-8")
    search = {"scenario": "crossroads-s1", "algorithm": "random", "budget": 16, "keep": 0}
    here = bg.run_search(**search, ego="mine.py:FailsFast", triage="short", out="here")
    there = bg.run_search(
        **search, ego="mine.py:FailsFast", triage="short", out="there", workers=cluster
    )
    assert same_rows(here.folder, there.folder)
    assert here.failures == there.failures != {}


def test_a_cluster_that_is_lost_is_told_and_the_run_can_be_gone_on_with(
    nodes, undisturbed, tmp_path, monkeypatch, same_rows
):
    monkeypatch.setenv("RAY_gcs_rpc_server_reconnect_timeout_s", "2")  # Ray tries for a minute

    def lose(progress) -> None:
        if progress.evaluations == 40:
            nodes.obey("kill head")

    place = tmp_path / "run"
    with pytest.raises(
        WorkersError, match=f"is lost: .*GCS.*; [48]0 .* 'bridgegen resume {place}'"
    ):
        bg.run_search(
            **SEARCH, triage="short", out=place, workers="ray",
            callbacks=SearchCallbacks(batch=lambda progress: (lose(progress), time.sleep(4.0))),
        )  # fmt: skip
    resumed = bg.resume(place)
    assert same_rows(resumed.folder, undisturbed.folder)


def test_no_cluster_there(doubles, monkeypatch):
    for name, value in LOCAL.items():
        monkeypatch.setenv(name, value)
    for wait in ("connect", "reconnect"):  # 5 s and 60 s by default
        monkeypatch.setenv(f"RAY_gcs_rpc_server_{wait}_timeout_s", "1")
    monkeypatch.setenv("RAY_ADDRESS", f"127.0.0.1:{free_port()}")
    with (
        open_workers("ray") as workers,
        pytest.raises(WorkersError, match=r"cannot be reached|is lost"),
    ):
        workers.map(doubles.Doubler(), doubles.Doubler.double, X)
