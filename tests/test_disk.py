"""Files that are written whole, and what killed processes leave of them."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from tests.approval import refuses

from bridgegen.base.disk import write_whole
from bridgegen.base.errors import StorageError

KILLED = """
import os, signal, sys
from pathlib import Path
from bridgegen.base.disk import write_whole

def chunks():
    yield b"half"
    os.kill(os.getpid(), signal.SIGKILL)

write_whole(Path(sys.argv[1]), chunks())
"""


@pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals")
def test_what_a_killed_process_left_is_removed_by_the_next_one(tmp_path):
    page, other = tmp_path / "report[1].html", tmp_path / "other.html"
    for path in (page, other):
        done = subprocess.run([sys.executable, "-c", KILLED, path], timeout=300, check=False)
        assert done.returncode == -signal.SIGKILL
        assert not path.exists()
    ours = next(tmp_path.glob(".other.html.*.part"))
    write_whole(page, [b"whole"])
    assert sorted(tmp_path.iterdir()) == sorted([page, ours])  # the other file's is left
    assert page.read_bytes() == b"whole"


@pytest.mark.skipif(os.name != "posix", reason="needs POSIX signals")
def test_what_a_running_process_writes_is_left_alone(tmp_path):
    page = tmp_path / "report.html"
    others = [tmp_path / f".report.html.{name}.part" for name in (os.getppid(), "mine", "1" * 30)]
    for path in others:
        path.write_bytes(b"half")
    write_whole(page, [b"whole"])
    assert all(path.exists() for path in others)


@pytest.mark.skipif(os.name != "posix", reason="needs POSIX locks")
def test_what_a_process_on_another_machine_writes_is_left_alone(tmp_path):
    """It has a number that no process of this one has, and holds the lock."""
    import fcntl

    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait(timeout=300)
    part = tmp_path / f".report.html.{ended.pid}.part"
    with part.open("wb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        write_whole(tmp_path / "report.html", [b"whole"])
        assert part.exists()
    write_whole(tmp_path / "report.html", [b"whole"])
    assert not part.exists()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is full")
def test_a_device_is_written_to_and_never_replaced(tmp_path):
    """Through a link, so that no device can come to harm."""
    full, null = tmp_path / "full", tmp_path / "null"
    full.symlink_to("/dev/full")
    null.symlink_to("/dev/null")
    with refuses(StorageError):
        write_whole(full, [b"x" * 100_000])
    write_whole(null, [b"x"])
    assert full.is_symlink()
    assert null.is_symlink()
    assert sorted(tmp_path.iterdir()) == [full, null]
