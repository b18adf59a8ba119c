"""Processes: one that dies costs its run and no other."""

import os
from pathlib import Path

from bridgegen.engine.options import SearchOptions
from bridgegen.jobs.compare.runs import RunCallbacks, Task, evaluations_of, run_all


class Bomb(str):
    __slots__ = ()

    """Whoever unpickles it is gone."""

    def __reduce__(self):
        return os._exit, (7,)


def task(folder: Path, name: str, **more: object) -> Task:
    options = {"algorithm": "random", "budget": 40, "causes": False, **more}
    return Task(name, folder / name, "crossroads-s4", SearchOptions(**options))


def test_a_process_that_dies_costs_one_run(tmp_path):
    told: list[tuple[str, bool]] = []
    callbacks = RunCallbacks(ended=lambda name, failure: told.append((name, failure is None)))
    tasks = [task(tmp_path, "bomb", junction=Bomb()), task(tmp_path, "0")]
    failures = run_all(tasks, 2, callbacks)
    assert list(failures) == ["bomb"]
    assert failures["bomb"] in (
        "its process ended with exit status 7",
        "its process ended by SIGKILL",
    )
    assert sorted(told) == [("0", True), ("bomb", False)]
    assert evaluations_of(tmp_path / "0") == (40, True)
    assert evaluations_of(tmp_path / "bomb") == (0, False)
