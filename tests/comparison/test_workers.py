"""Processes: one that dies costs its run and no other."""

import os
from pathlib import Path

from bridgegen.engine.options import SearchOptions
from bridgegen.jobs.compare.runs import RunsProgress, Task, evaluations_of, run_all
from bridgegen.jobs.frame import JobCallbacks


class Bomb(str):
    __slots__ = ()

    """Whoever unpickles it is gone."""

    def __reduce__(self):
        return os._exit, (7,)


def task(folder: Path, name: str, **more: object) -> Task:
    options = {"algorithm": "random", "budget": 40, "causes": False, **more}
    return Task(name, folder / name, "crossroads-s4", SearchOptions(**options))


def test_a_process_that_dies_costs_one_run(tmp_path):
    told: list[str] = []
    said: list[str] = []
    counts: list[tuple[int, int, str]] = []
    tasks = [task(tmp_path, "bomb", junction=Bomb()), task(tmp_path, "0")]
    callbacks = JobCallbacks(say=said.append, progress=lambda what, *more: counts.append(more))
    progress = RunsProgress(callbacks, len(tasks), 40, each=told.append)
    failures = run_all(tasks, 2, progress)
    assert list(failures) == ["bomb"]
    assert failures["bomb"] in (
        "its process ended with exit status 7",
        "its process ended by SIGKILL",
    )
    assert sorted(told) == ["0", "bomb"]
    assert said == [f"bomb failed: {failures['bomb']}"]
    assert (counts[0], counts[-1]) == ((0, 80, "0 of 2 runs"), (40, 40, "2 of 2 runs, 1 failed"))
    assert evaluations_of(tmp_path / "0") == (40, True)
    assert evaluations_of(tmp_path / "bomb") == (0, False)
