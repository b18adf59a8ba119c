"""``--device cuda`` on the command line: what it refuses, what it gives, and how it ends."""

import json

import pytest
from tests.approval import approve
from typer.testing import CliRunner

from bridgegen.cli import app
from bridgegen.jobs.search.run import Run
from bridgegen.simulation.embedded import device

OWN = """
class Own:
    def reset(self, seed): pass
    def act(self, observation): return 0.0, 0.0
"""


def call(*words):
    result = CliRunner().invoke(app, [*map(str, words)])
    if result.exception and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result


def refused(*words):
    """Return the one line that a call ends with."""
    from bridgegen.base.errors import BridgeGenError

    with pytest.raises(BridgeGenError) as caught:
        call(*words)
    return str(caught.value)


@pytest.fixture
def pretend(gpu, monkeypatch):
    """A GPU that is there, and loads no module."""
    monkeypatch.setattr(type(gpu), "cuModuleLoadDataEx", lambda *_: 0)
    return gpu


def test_without_a_gpu_one_line_says_so(tmp_path, monkeypatch):
    device._opened.cache_clear()
    monkeypatch.setattr("ctypes.CDLL", missing)
    approve(
        refused("search", "crossroads-s1", "--device", "cuda", "--out", tmp_path / "run"), "GPU"
    )
    assert not (tmp_path / "run").exists()


def missing(name):
    raise OSError(name)


def test_there_is_one_kind_of_device():
    approve(refused("search", "crossroads-s1", "--device", "tpu"), "tpu")


@pytest.mark.parametrize(
    "job", ["search", "risk", "preventability", "suite run", "resume", "analyse regions"]
)
def test_these_have_the_option(job):
    assert "--device" in call(*job.split(), "--help-all").output


def test_other_simulators_are_refused_by_name(pretend, tmp_path):
    words = ("search", "crossroads-s1", "--device", "cuda", "--out", tmp_path / "run")
    approve(refused(*words, "--simulator", "esmini", "--esmini-lib", __file__), "esmini")


def test_a_driver_in_python_is_refused_by_name(pretend, tmp_path):
    (tmp_path / "own.py").write_text(OWN)
    own = f"{tmp_path}/own.py:Own"
    words = ("search", "crossroads-s1", "--device", "cuda", "--out", tmp_path / "run")
    assert "own.py:Own" in refused(*words, "--ego", own)


def test_several_egos_are_refused(pretend, tmp_path):
    words = ("search", "two-at-crossroads", "--device", "cuda", "--out", tmp_path / "run")
    approve(refused(*words), "several")


def test_a_cluster_is_refused(pretend, tmp_path):
    words = ("search", "crossroads-s1", "--device", "cuda", "--out", tmp_path / "run")
    approve(refused(*words, "--workers", "ray"), "ray")


def test_an_error_of_the_driver_has_its_name(gpu, monkeypatch):
    monkeypatch.setattr(type(gpu), "cuModuleLoadDataEx", lambda *_: 700)
    approve(refused("search", "crossroads-s1", "--device", "cuda"), "CUDA_ERROR_ILLEGAL_ADDRESS")


SEARCH = ("search", "crossroads-s1", "--ego", "route-follower", "--algorithm", "random", "--budget")


@pytest.mark.thorough
def test_a_search_records_the_same(gpu, tmp_path):
    for name, more in (("here", ()), ("there", ("--device", "cuda"))):
        call(*SEARCH, 128, "--keep", 1, "--out", tmp_path / name, *more)
    assert gpu.launches > 0
    here, there = (Run(tmp_path / name) for name in ("here", "there"))
    assert here.rows().metrics.tobytes() == there.rows().metrics.tobytes()
    written = [path.read_bytes() for path in (tmp_path / "there").rglob("*.json")]
    assert written
    assert not any(b"cuda" in text for text in written)


@pytest.mark.thorough
def test_with_too_little_memory_it_ends_with_one_line(gpu, tmp_path):
    gpu.free = 2**20
    words = (*SEARCH, 128, "--out", tmp_path / "run", "--device", "cuda")
    approve(refused(*words), "memory")


@pytest.mark.thorough
def test_a_device_that_fails_ends_the_search_which_resumes_without_it(gpu, tmp_path):
    call(*SEARCH, 256, "--keep", 1, "--out", tmp_path / "whole")
    gpu.fails_after = 3
    said = refused(*SEARCH, 256, "--keep", 1, "--out", tmp_path / "run", "--device", "cuda")
    assert "CUDA_ERROR_LAUNCH_FAILED" in said
    assert "resume" in said
    call("resume", tmp_path / "run")
    whole, run = (Run(tmp_path / name).rows().metrics for name in ("whole", "run"))
    assert whole.tobytes() == run.tobytes()


@pytest.mark.thorough
def test_a_risk_is_the_same(gpu, tmp_path):
    words = ("risk", "crossroads-s1", "--ego", "route-follower", "--exposure", "uniform")
    for name, more in (("here", ()), ("there", ("--device", "cuda"))):
        call(
            *words,
            "--method",
            "mc",
            "--budget",
            2000,
            "--precision",
            0,
            "--out",
            tmp_path / name,
            *more,
        )
    assert gpu.launches > 0
    here, there = (
        json.loads((tmp_path / name / "risk.json").read_text()) for name in ("here", "there")
    )
    for found in (here, there):
        found.pop("command", None)
    assert here == there


@pytest.mark.thorough
def test_a_map_is_the_same(gpu, tmp_path):
    axes = ("--grid", "gap=10:60:4", "--grid", "ego_speed=15:30:4")
    words = ("preventability", "cut-in", "--ego", "route-follower", "--models", "fsm", *axes)
    for name, more in (("here", ()), ("there", ("--device", "cuda"))):
        call(*words, "--out", tmp_path / name, *more)
    assert gpu.launches > 0
    here, there = (sorted((tmp_path / name).rglob("*.csv")) for name in ("here", "there"))
    assert [path.read_bytes() for path in here] == [path.read_bytes() for path in there]
