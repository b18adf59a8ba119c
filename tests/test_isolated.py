"""Work in a process of its own: answers, errors, time, and the end of either side."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest
from tests.approval import refuses

from bridgegen.base.processes.isolated import CallError, IsolatedProcess

WORKER = """
import os, sys, time
from bridgegen.base.processes.isolated import CallError, serve

def answer(what, *rest):
    print("a word on the standard output, which carries the answers")
    if what == "add":
        return sum(rest)
    if what == "raise":
        raise ValueError("no idea")
    if what == "refuse":
        raise CallError("refused", "not today")
    if what == "die":
        os._exit(3)
    while True:
        time.sleep(60)

def make():
    if sys.argv[1] == "bad":
        raise OSError("cannot begin")
    return "hello " + sys.argv[1], answer

if __name__ == "__main__":
    serve(make, lambda error: f"{type(error).__name__}: {error}")
"""


@pytest.fixture
def process(tmp_path, monkeypatch):
    (tmp_path / "isolated_worker.py").write_text(WORKER)
    monkeypatch.syspath_prepend(str(tmp_path))
    return lambda word: IsolatedProcess("isolated_worker", [word])


def test_it_greets_and_answers(process):
    one = process("you")
    assert not one.runs
    assert one.start(30.0) == "hello you"
    assert [one.ask("add", 1, i, seconds=30.0) for i in range(3)] == [1, 2, 3]
    one.close()
    assert not one.runs


@pytest.mark.parametrize(
    ("what", "kind", "words", "goes_on"),
    [
        ("raise", "raised", "ValueError", True),
        ("refuse", "refused", "not today", True),
        ("die", "died", "status 3", False),
        ("hang", "timed out", "0.3 s", False),
    ],
)
def test_what_goes_wrong_is_told_and_it_can_be_begun_again(process, what, kind, words, goes_on):
    one = process("you")
    one.start(30.0)
    with refuses(CallError, words) as caught:
        one.ask(what, seconds=0.3 if what == "hang" else 30.0)
    assert caught.value.kind == kind
    assert one.runs == goes_on
    if not goes_on:
        one.start(30.0)
    assert one.ask("add", 2, 2, seconds=30.0) == 4


def test_progress_gives_more_time(process):
    one, beats = process("you"), iter(range(3))
    one.start(30.0)
    began = time.monotonic()
    with pytest.raises(CallError, match="no answer"):
        one.ask("hang", seconds=0.2, progress=lambda: next(beats, 2))
    assert time.monotonic() - began > 0.5


def test_what_cannot_begin_says_why(process):
    with refuses(CallError):
        process("bad").start(30.0)


def test_it_ends_with_whoever_asks_even_while_it_hangs(process, tmp_path):
    """Killed at once, so that nobody can say goodbye."""
    script = tmp_path / "asker.py"
    script.write_text(
        "import os, signal, sys, threading\n"
        "from bridgegen.base.processes.isolated import IsolatedProcess\n"
        "one = IsolatedProcess('isolated_worker', ['you'])\n"
        "one.start(30.0)\n"
        "print(one._child.pid, flush=True)\n"
        "threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGKILL)).start()\n"
        "one.ask('hang', seconds=60.0)\n"
    )
    done = subprocess.run(
        [sys.executable, str(script)], stdout=subprocess.PIPE, text=True, timeout=60,
        env=os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])},
    )  # fmt: skip
    pid = int(done.stdout)
    for _ in range(100):
        if not Path(f"/proc/{pid}").exists() or "Z" in Path(f"/proc/{pid}/stat").read_text():
            return
        time.sleep(0.1)
    pytest.fail("it lives on")
