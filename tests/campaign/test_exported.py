"""The cost of exporting: one simulation of each exported scenario, and one opening of the store."""

from collections import Counter

import bridgegen as bg
from bridgegen.engine.runner import Runner
from bridgegen.jobs.search import SearchCallbacks
from bridgegen.results.store import Store


def test_an_exported_scenario_is_simulated_once(tmp_path, monkeypatch):
    """For its outcomes, its files, its playback and its picture together."""
    simulated, stages, run_rows = Counter(), [], Runner.run

    def counted(self, X, **more):
        if stages[-1] in ("export", "report"):
            simulated.update(x.tobytes() for x in X)
        return run_rows(self, X, **more)

    monkeypatch.setattr(Runner, "run", counted)
    run = bg.run_search(
        "crossroads-s3", budget=60, keep=3, ego="route-follower", triage="short",
        out=tmp_path / "run",
        callbacks=SearchCallbacks(stage=stages.append),
    )  # fmt: skip
    X = run.rows().X
    exported = [X[one.evaluation].tobytes() for one in run.exported()]
    assert len(exported) == 3
    assert [simulated[row] for row in exported] == [1, 1, 1]


def test_a_search_opens_its_store_once(tmp_path, monkeypatch):
    opened, connected = [], Store._connected.__func__

    def count(cls, folder, lock):
        opened.append(folder)
        return connected(cls, folder, lock)

    monkeypatch.setattr(Store, "_connected", classmethod(count))
    run = bg.run_search(
        "crossroads-s3",
        budget=60,
        keep=3,
        ego="route-follower",
        triage="short",
        out=tmp_path / "run",
    )
    assert run.summary.evaluations == 60
    assert run.failures == {}
    assert len(opened) == 1
    assert bg.Run(tmp_path / "run").summary == run.summary
