"""Processes that a driver starts: they hold nothing up, and end with the driver."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.drivers.driver_process import DriverError, DriverProcess
from bridgegen.drivers.interface import ROUTE_POINTS, Observation, Scene

pytestmark = pytest.mark.skipif(
    sys.platform != "linux", reason="only Linux tells which processes descend from one that ended"
)

DRIVERS = Path(__file__).with_name("forking_drivers.py")
SECONDS = 60.0  # a guard: what is awaited takes a fraction of a second

ASK = """
import sys
sys.path.insert(0, sys.argv[1])
from test_driver_children import DRIVERS, SECONDS, observation, scene
from bridgegen.drivers.driver_process import DriverProcess
driver = DriverProcess(f"{DRIVERS}:{sys.argv[2]}", time_limit=10 * SECONDS)
try:
    driver.reset(1, scene())
    print("ready", flush=True)
    driver.act(observation())
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""


def scene():
    return Scene(0.05, 400, ("bv",), np.zeros(1, np.int64), 4.5, 1.8, 1.4, 50.0, 3.0, 8.0, 0.2)


def observation():
    one = np.zeros(1)
    return Observation(
        time=0.0, running=np.ones(1, dtype=np.bool_), x=one, y=one, h=one, v=one, a=one,
        target_speed=one, offset=one, route=np.zeros((1, ROUTE_POINTS, 4)),
        tracks=np.zeros((1, 1, 12)), stop_distance=np.full(1, np.inf), light=np.zeros(1, np.int8),
    )  # fmt: skip


def stat(number):
    """A process's status, as Linux tells it from its state on; nothing of one that is not there."""
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return []


def children(parent):
    numbers = [int(path.name) for path in Path("/proc").glob("[0-9]*")]
    return [number for number in numbers if stat(number)[1:2] == [str(parent)]]


def runs(number):
    """Whether a process is there, and not a zombie that whoever adopted it has not collected."""
    return stat(number)[:1] not in ([], ["Z"])


@pytest.fixture
def started(tmp_path, monkeypatch):
    """The processes that drivers have started."""
    monkeypatch.setenv("FORKING_DRIVERS", str(tmp_path))

    def numbers():
        return [int(path.name) for path in tmp_path.iterdir()]

    yield numbers
    for number in filter(runs, numbers()):
        os.kill(number, signal.SIGKILL)


@pytest.fixture
def driver():
    made = []

    def make(name, time_limit=SECONDS):
        made.append(DriverProcess(f"{DRIVERS}:{name}", time_limit=time_limit))
        return made[-1]

    yield make
    for one in made:
        one.close()


def await_numbers(started):
    end = time.monotonic() + SECONDS
    while not started():
        assert time.monotonic() < end, "the driver has started no process"
        time.sleep(0.01)
    return started()


def await_end(numbers):
    end = time.monotonic() + SECONDS
    while any(map(runs, numbers)):
        assert time.monotonic() < end, "a process lives on"
        time.sleep(0.01)


@pytest.mark.parametrize(
    "name",
    ["Forks", "Spawns", "HasPool", "RunsProgram", "RunsProgramInSession", "Daemonises", "ForksOn"],
)
def test_what_a_driver_starts_ends_with_it(driver, started, name):
    one = driver(name)
    one.reset(1, scene())
    assert [part.tolist() for part in one.act(observation())] == [[0.0], [0.0]]
    numbers = await_numbers(started)
    assert all(map(runs, numbers))
    one.close()
    assert not any(map(runs, numbers))


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("ForksAndDies", "status"),
        ("ForksAndExits", "status"),
        ("DaemonisesAndDies", "status"),
    ],
)
def test_a_driver_that_dies_is_told_with_its_status(driver, started, name, message):
    one = driver(name)
    for _ in range(2):  # and is begun again
        one.reset(1, scene())
        numbers = await_numbers(started)
        with refuses(DriverError, message) as error:
            one.act(observation())
        assert error.value.kind == "died"
        assert not any(map(runs, numbers))


@pytest.mark.parametrize("name", ["ForksAndHangs", "DaemonisesAndHangs"])
def test_a_time_limit_ends_what_a_driver_started(driver, started, name):
    one = driver(name, time_limit=2.0)
    one.reset(1, scene())
    numbers = await_numbers(started)
    with refuses(DriverError, "2 s") as error:
        one.act(observation())
    assert error.value.kind == "timed out"
    assert not any(map(runs, numbers))


@pytest.mark.parametrize("name", ["ForksAndHangs", "DaemonisesAndHangs"])
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_they_end_with_whoever_asks_the_driver(started, name, how):
    process = subprocess.Popen(
        [sys.executable, "-c", ASK, str(DRIVERS.parent), name],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )  # fmt: skip
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    numbers = await_numbers(started)
    os.killpg(process.pid, how)
    out, errors = process.communicate(timeout=SECONDS)  # nobody holds its pipes
    assert (out, errors) == (("interrupted\n", "") if how is signal.SIGINT else ("", ""))
    await_end(numbers)


def test_a_killed_supervisor_is_told_and_takes_the_driver_with_it(driver, started):
    one = driver("Forks")
    one.reset(1, scene())
    child = one._process._child
    assert child is not None
    drivers = children(child.pid)
    assert len(drivers) == 1
    os.kill(child.pid, signal.SIGKILL)
    await_end(drivers)
    with refuses(DriverError):
        one.act(observation())
