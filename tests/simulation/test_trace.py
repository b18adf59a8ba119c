"""The trace of a scenario: what the rollout holds, as a table; and a step of one's own."""

import csv

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import InputError, StorageError
from bridgegen.cli import main
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.simulate import simulate_file
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.trace import COLUMNS, MORE, write_trace


@pytest.fixture(scope="module")
def xosc(tmp_path_factory):
    scenario = load("cut-in")
    pipeline = Pipeline(scenario, scenario.space())
    folder = tmp_path_factory.mktemp("scenario")
    return write_scenario(pipeline, pipeline.space.row({}), folder, "one")[2]


def table(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_it_is_the_rollout_to_the_last_bit(xosc, tmp_path, monkeypatch, capsys):
    path = tmp_path / "trace.csv"
    monkeypatch.setattr("sys.argv", ["bridgegen", "simulate", str(xosc), "--trace", str(path)])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 0
    assert "d_min" in capsys.readouterr().out
    rollout = simulate_file(xosc).rollout
    rows = table(path)
    assert tuple(rows[0]) == (*COLUMNS, *MORE)
    assert COLUMNS == ("time", "entity", "x", "y", "h", "speed")
    n = int(rollout.n_steps[0])
    assert len(rows) == n * len(rollout.names)
    for e, name in enumerate(rollout.names):
        own = [row for row in rows if row["entity"] == name]
        assert [float(row["time"]) for row in own] == [k * 0.05 for k in range(n)]
        for column, array in (("x", "x"), ("y", "y"), ("h", "h"), ("speed", "v")):
            told = [float(row[column]) for row in own]
            np.testing.assert_array_equal(told, getattr(rollout, array)[0, e, :n])


def test_a_smaller_step_tells_the_same_story(xosc):
    usual, fine = (simulate_file(xosc, time_step=step) for step in (None, 0.01))
    assert (usual.rollout.time_step, fine.rollout.time_step) == (0.05, 0.01)
    assert fine.seconds == pytest.approx(usual.seconds, abs=0.05)
    assert fine.metrics["d_min"] == pytest.approx(usual.metrics["d_min"], abs=0.2)


@pytest.mark.parametrize("step", [0.0, -0.05, 1.5, float("nan"), float("inf")])
def test_a_step_out_of_range(xosc, step):
    with refuses(InputError, "time_step", "0.0001"):
        simulate_file(xosc, time_step=step)


def test_where_it_goes(xosc, tmp_path):
    rollout = simulate_file(xosc).rollout
    with refuses(InputError):
        write_trace(tmp_path / "trace.txt", rollout)
    (tmp_path / "mine.csv").write_text("mine")
    with refuses(StorageError):
        write_trace(tmp_path / "mine.csv", rollout)
    with refuses(StorageError):
        write_trace(tmp_path / "nowhere" / "trace.csv", rollout)
    assert (tmp_path / "mine.csv").read_text() == "mine"
