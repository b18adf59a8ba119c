"""Drivers in other processes in the simulator: the same bits as in Python, whatever fails."""

import shlex
import shutil
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import InputError
from bridgegen.drivers.remote import process as remote_process
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load

TESTS = Path(__file__).parents[2]
DRIVERS = TESTS / "ego" / "drivers.py"
OTHERS = TESTS / "ego" / "remote" / "remote_drivers.py"
EXAMPLES = TESTS.parent / "docs" / "examples"
FIELDS = ("x", "y", "h", "v", "a", "offset", "n_steps", "status")
N = 12


def made(ego, scenario="crossroads-s1", **kwargs):
    logical = load(scenario)
    return Pipeline(logical, logical.space(), PipelineOptions(ego=str(ego), **kwargs))


def command(name, file=DRIVERS):
    return "exec:" + shlex.join(
        [sys.executable, "-m", "bridgegen.drivers.remote", f"{file}:{name}"]
    )


def rows(pipeline, n=N):
    return pipeline.space.decode(np.random.default_rng(4).random((n, pipeline.space.n_var)))


def serve(path, name):
    process = subprocess.Popen(
        [sys.executable, "-m", "bridgegen.drivers.remote", f"{DRIVERS}:{name}", f"unix:{path}"],
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    approve(process.stderr.readline(), path)
    return process


def end(process):
    process.kill()
    process.wait()
    process.stderr.close()


def test_a_program_drives_to_the_bit_as_its_class():
    here, there = made(f"{DRIVERS}:LooksAhead"), made(command("LooksAhead"))
    X = rows(here)
    one, two = here.rollout(X), there.rollout(X)
    assert (one.status == 0).all()
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))


@pytest.mark.parametrize(
    ("name", "status", "message"),
    [
        ("FailsFast", 20, "ValueError: too fast for me"),
        ("HangsFast", 21, "no answer within 0.3 s"),
        ("DiesFast", 22, "ended with status 3"),
        ("NaNFast", 23, "acceleration must be finite, got nan"),
    ],
)
def test_a_failure_costs_the_row_that_it_belongs_to(name, status, message):
    pipeline = made(command(name), time_limit=0.3)
    X = rows(pipeline)
    fast = X[:, pipeline.space.names.index("ego_speed")] > 7.5
    X = np.concatenate([X[fast][:1], X[~fast][:2]])
    rollout = pipeline.rollout(X)
    assert rollout.status.tolist() == [status, 0, 0]
    assert message in rollout.messages[0]


def test_a_driver_of_one_row_at_a_time_drives_them_one_by_one():
    alone, whole = made(command("TakesOne", OTHERS)), made(f"{DRIVERS}:Cruises")
    X = rows(alone, 3)
    one, two = alone.rollout(X), whole.rollout(X)
    assert (one.status == 0).all()
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))


def test_a_killed_server_ends_the_job_and_a_new_one_goes_on(tmp_path, monkeypatch):
    monkeypatch.setattr(remote_process, "AGAIN_SECONDS", 0.2)
    path = tmp_path / "socket"
    server = serve(path, "Cruises")
    pipeline = made(f"unix:{path}")
    X = rows(pipeline, 4)
    before = pipeline.rollout(X)
    end(server)
    with refuses(InputError):
        pipeline.rollout(X)
    server = serve(path, "Cruises")
    try:
        for again in (pipeline.rollout(X), made(f"unix:{path}").rollout(X)):
            for name in FIELDS:
                np.testing.assert_array_equal(getattr(again, name), getattr(before, name))
    finally:
        end(server)


@pytest.fixture(scope="module")
def in_cpp(tmp_path_factory):
    compiler = shutil.which("g++")
    if compiler is None:
        pytest.skip("there is no g++")
    program = tmp_path_factory.mktemp("cpp") / "my_driver"
    warnings = ["-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]
    source = EXAMPLES / "cpp" / "main.cpp"
    subprocess.run([compiler, "-std=c++17", "-O1", *warnings, "-o", program, source], check=True)
    return program


def test_the_driver_in_cpp_drives_as_the_one_in_python(in_cpp):
    """The same formulas: other libraries round sine and cosine otherwise in the last digit."""
    here, there = (
        made(EXAMPLES / "my_driver.py:MyDriver", "cut-in"),
        made(f"exec:{in_cpp}", "cut-in"),
    )
    X = rows(here)
    one, two = here.rollout(X), there.rollout(X)
    assert (one.status == 0).all()
    assert (one.a[:, 0] < -4.0).any()
    for name in FIELDS:
        np.testing.assert_allclose(getattr(two, name), getattr(one, name), rtol=0.0, atol=1e-6)


def test_the_driver_in_cpp_is_a_server_of_several_connections(in_cpp):
    with socket.create_server(("127.0.0.1", 0)) as one:
        port = one.getsockname()[1]
    server = subprocess.Popen([in_cpp, str(port)])
    try:
        pipelines = [made(f"connect:127.0.0.1:{port}", "cut-in") for _ in range(2)]
        wait_for(port)
        X = rows(pipelines[0], 3)
        one, two = (pipeline.rollout(X) for pipeline in pipelines)
        assert (one.status == 0).all()
        for name in FIELDS:
            np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    finally:
        server.kill()
        server.wait()


def wait_for(port):
    deadline = time.monotonic() + 30.0
    while time.monotonic() < deadline:
        with socket.socket() as one:
            if one.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.01)


@pytest.mark.parametrize("example", ["my_lane_changer.py:MyLaneChanger", "my_planner.py:MyPlanner"])
def test_the_map_and_plans_pass_the_protocol_to_the_bit(example):
    file, _, name = example.partition(":")
    here = made(EXAMPLES / example, "cut-in")
    there = made(command(name, EXAMPLES / file), "cut-in")
    X = rows(here, 2)
    one, two = here.rollout(X), there.rollout(X)
    assert (one.status == 0).all()
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(one, field), getattr(two, field))
