"""Drivers that leave processes behind, from the command line: it ends, and says what is wrong."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from tests.approval import approve
from tests.ego.test_driver_children import DRIVERS, await_end, started

__all__ = ["started"]

pytestmark = pytest.mark.skipif(
    sys.platform != "linux", reason="only Linux tells which processes descend from one that ended"
)

CALL = [sys.executable, "-c", "from bridgegen.cli import main; main()"]
SECONDS = 240.0  # a guard against a command that hangs


def search(folder: Path, name: str) -> subprocess.CompletedProcess[str]:
    words = ["search", "stopped-after-curve", "--budget", "2", "--keep", "0", "--no-causes"]
    words += ["--triage", "none"]
    return subprocess.run(
        [*CALL, *words, "--ego", f"{DRIVERS}:{name}", "--out", "r"],
        capture_output=True, text=True, cwd=folder, env={**os.environ}, timeout=SECONDS,
        check=False,
    )  # fmt: skip


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["Forks", "Daemonises"])
def test_a_process_that_outlives_its_driver_holds_no_search_up(started, tmp_path_factory, name):
    folder = tmp_path_factory.mktemp("search")
    done = search(folder, name)
    assert done.returncode == 0, done.stderr
    assert (folder / "r" / "report.html").is_file()
    assert started()
    await_end(started())


def test_a_driver_that_forks_and_dies_at_once_is_one_clear_error(started, tmp_path_factory):
    done = search(tmp_path_factory.mktemp("search"), "ForksAndDiesAtOnce")
    assert done.returncode == 2
    approve(done.stderr.splitlines()[-1], "forking_drivers", "ForksAndDiesAtOnce")
    assert "Traceback" not in done.stderr
    assert started()
    await_end(started())
