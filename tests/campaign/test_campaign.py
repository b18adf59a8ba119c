import json
import os
import shlex
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve, refuses

import bridgegen as bg
from bridgegen.assess.conflict.findings import COLUMNS
from bridgegen.assess.metrics import METRICS
from bridgegen.base.errors import InputError, StorageError, UnknownNameError
from bridgegen.cli import main
from bridgegen.jobs.search import SearchCallbacks
from bridgegen.jobs.search.critical import most_critical
from bridgegen.openx.convert import import_file
from bridgegen.results.store import Store
from bridgegen.scenario.language.reader import load

TOWN05 = Path(__file__).parents[3] / "shared" / "data" / "Town05.xodr"


def rows_of(folder: Path):
    with Store.open(folder) as store:
        return store.read()


def same(a, b) -> bool:
    return all(
        np.array_equal(getattr(a, name), getattr(b, name), equal_nan=True)
        for name in ("id", "U", "X", "metrics", "F", "status", "critical", "cause")
    )


def variants():
    yield pytest.param({"scenario": "crossroads-s4"}, id="s4")
    near = {"criteria": ["R-1: min(gap to any) > 5 m"], "critical": "criteria"}
    yield pytest.param({"scenario": "crossroads-s2", "ego": "reference", **near}, id="reference")
    yield pytest.param({"scenario": "crossroads-s3", "algorithm": "random"}, id="random")
    yield pytest.param(
        {"scenario": "crossroads-s2", "axes": ["static", "participants", "weather"]}, id="static"
    )
    yield pytest.param(
        {"scenario": "crossroads-s4", "weights": "entropy", "scale": "standardised"}, id="entropy"
    )
    yield pytest.param(
        {"scenario": "crossroads-s4", "road_map": TOWN05},
        id="town05",
        marks=pytest.mark.skipif(not TOWN05.exists(), reason="needs Town05.xodr"),
    )


@pytest.mark.thorough
@pytest.mark.parametrize("arguments", list(variants()))
def test_a_handed_over_file_gives_the_store_s_metrics_to_the_last_bit(tmp_path, arguments):
    run = bg.run_search(**arguments, budget=100, keep=3, triage="none", out=tmp_path / "run")
    rows = rows_of(run.folder)
    assert len(rows) == run.summary.evaluations == 100
    assert run.finished
    assert run.scenarios
    assert run.report.stat().st_size > 10_000
    for path in run.scenarios:
        facts = json.loads(path.with_suffix(".json").read_text("utf-8"))
        result = bg.simulate_file(path)
        recorded = rows.metrics[facts["row"]]
        measured = [result.metrics[one] for one in facts["metrics"] if "criterion" not in one]
        assert measured == recorded.tolist()[: len(measured)]
        assert len(facts["metrics"]) - len(measured) == len(run.criteria)
        assert result.driver == run.settings.ego
        assert facts["critical"]
        for name, value in zip(facts["metrics"], measured, strict=False):
            assert facts["metrics"][name]["value"] in (value, None)


FIRST_SEVEN = ("n_collision", "ttc", "d_min", "v_d", "l_offset", "a_change", "n_brake")


def test_a_run_of_the_first_version_opens_resumes_and_is_reported(tmp_path, monkeypatch):
    """It holds seven metrics, in another order, and says nothing of more."""
    with monkeypatch.context() as patch:
        patch.setattr("bridgegen.engine.pipeline.metrics_of", lambda *_, **__: FIRST_SEVEN)
        patch.setattr("bridgegen.jobs.search.campaign._finish", lambda *_: None)
        bg.run_search("paper/crossroads-s4", algorithm="pso", budget=80, out=tmp_path / "run")
    first = load("paper/crossroads-s4")
    with sqlite3.connect(tmp_path / "run" / "run.sqlite") as connection:
        ((text,),) = connection.execute("SELECT value FROM run WHERE key = 'settings'")
        settings = json.loads(text)
        del settings["chosen"]["metrics"]
        settings["chosen"]["objective"] = None
        del settings["objective"]["gated"]
        settings["fingerprint"] = first.fingerprint
        for later in ("distribution", "ideal", "causes", "cause", "others"):
            del settings[later]
        connection.execute(
            "UPDATE run SET value = ? WHERE key = 'settings'", (json.dumps(settings),)
        )
        for name in ("cause", *COLUMNS):
            connection.execute(f"ALTER TABLE evaluations DROP COLUMN {name}")
        connection.execute("UPDATE run SET value = '1' WHERE key = 'schema'")
        connection.execute("DELETE FROM evaluations WHERE id >= 40")
    run = bg.resume(tmp_path / "run")
    assert len(run.frame()) == 80
    assert {"ttc", "n_brake"} < set(run.frame().columns)
    assert "r_red" not in run.frame().columns
    assert run.scenarios
    assert run.report.exists()
    again = bg.run_search(
        "paper/crossroads-s4", algorithm="pso", budget=80, deliver=False, out=tmp_path / "again"
    )
    assert (run.rows().X == again.rows().X).all()
    assert (run.rows().critical == again.rows().critical).all()


def test_metrics_that_are_asked_for_are_recorded_and_in_the_command(tmp_path):
    run = bg.run_search(
        "crossroads-s4", budget=40, keep=0, triage="none", metrics=["d_min"],
        out=tmp_path / "run",
    )  # fmt: skip
    assert "--metrics d_min" in run.settings.command(run.folder)


@pytest.mark.thorough
def test_a_search_that_does_not_deliver_is_delivered_by_resuming(tmp_path):
    run = bg.run_search(
        "crossroads-s4",
        budget=80,
        keep=2,
        triage="short",
        out=tmp_path / "run",
        deliver=False,
        workers=1,
    )
    assert run.finished
    assert (run.scenarios, run.report.exists()) == ((), False)
    whole = bg.run_search(
        "crossroads-s4", budget=80, keep=2, triage="short", out=tmp_path / "whole", workers=2
    )
    assert same(rows_of(run.folder), rows_of(whole.folder))
    again = bg.resume(run.folder, workers=1)
    assert len(again.scenarios) == 2
    assert again.report.exists()
    assert same(rows_of(run.folder), rows_of(whole.folder))


def test_a_search_for_a_cause_counts_and_keeps_no_other(tmp_path):
    run = bg.run_search(
        "crossroads-s3", budget=120, keep=4, cause="planning", algorithm="random",
        triage="none", out=tmp_path / "run",
    )  # fmt: skip
    frame = run.frame()
    assert (frame["critical"] == (frame["cause"] == "planning")).all()
    assert 0 < run.summary.critical < sum(run.summary.causes.values())
    assert "--cause planning" in run.settings.command(run.folder)
    for path in run.scenarios:
        assert json.loads(path.with_suffix(".json").read_text("utf-8"))["cause"] == "planning"
    with sqlite3.connect(tmp_path / "run" / "run.sqlite") as connection:
        connection.execute("DELETE FROM evaluations WHERE id >= 40")
    again = bg.resume(tmp_path / "run")
    assert again.frame()["cause"].tolist() == frame["cause"].tolist()
    assert again.summary.critical == run.summary.critical


def test_causes_can_be_left_out(tmp_path):
    run = bg.run_search(
        "crossroads-s3", budget=40, causes=False, keep=0, triage="none", out=tmp_path / "run"
    )
    assert run.summary.critical > 0
    assert run.summary.causes == {}
    assert run.frame()["cause"].isna().all()
    assert "--no-causes" in run.settings.command(run.folder)
    with refuses(InputError):
        bg.run_search("crossroads-s3", causes=False, cause="control", out=tmp_path / "other")
    with refuses(InputError):
        bg.run_search("crossroads-s3", cause="perception", out=tmp_path / "other")
    assert not (tmp_path / "other").exists()


@pytest.mark.thorough
@pytest.mark.checkers
@pytest.mark.parametrize("name", ["crossroads-s1", "crossroads-s2", "crossroads-s3"])
def test_strangers_accept_what_is_handed_over(tmp_path, name, checkers):
    run = bg.run_search(
        name, axes=["static", "participants", "weather"], budget=120, keep=3, out=tmp_path / "run"
    )
    assert len(run.scenarios) == 3
    roads = [path.with_suffix(".xodr") for path in run.scenarios]
    reports = [*checkers.qc_openscenario(*run.scenarios), *checkers.qc_opendrive(*roads)]
    assert len(reports) == 6
    for report in reports:
        assert report.clean, report
    assert checkers.netconvert(roads[0]).returncode == 0
    carla = pytest.importorskip("carla")
    for path in roads:
        assert carla.Map("handed_over", path.read_text("utf-8")).get_topology()


def test_most_critical_are_distinct_critical_and_in_order():
    rng = np.random.default_rng(3)
    U, F, critical = rng.random((300, 4)), rng.normal(size=(300, 1)), rng.random(300) < 0.5
    kept = most_critical(U, F, critical, 20)
    assert critical[kept].all()
    assert (np.diff(F[kept, 0]) >= 0.0).all()
    assert kept[0] == np.flatnonzero(critical)[np.argmin(F[critical, 0])]
    for i, a in enumerate(kept):
        for b in kept[:i]:
            assert np.sqrt(((U[a] - U[b]) ** 2).mean()) >= 0.1  # docs/decisions.md


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"algorithm": "pso"}, "pso: n_obj = 1 (it searches a single objective) must hold, got 2"),
        ({"objective": {"d_min": 1.0}}, "weights have no part in many objectives, got d_min=1"),
        ({"weights": "entropy"}, "weights have no part in many objectives, got --weights entropy"),
    ],
)
def test_many_objectives_are_refused_where_they_make_no_sense(arguments, message, tmp_path):
    arguments = {"algorithm": "random", "objectives": "many"} | arguments
    with pytest.raises(InputError) as error:
        bg.run_search("crossroads-s4", budget=40, out=tmp_path / "run", **arguments)
    assert message in str(error.value)
    assert not (tmp_path / "run").exists()


def test_of_many_objectives_the_non_dominated_come_first():
    rng = np.random.default_rng(4)
    U, F = rng.random((200, 3)), rng.normal(size=(200, 2)) * [1.0, 50.0]
    kept = most_critical(U, F, np.ones(200, dtype=bool), 200)
    dominated = ((F[:, None] >= F).all(axis=2) & (F[:, None] > F).any(axis=2)).any(axis=1)
    n_front = int((~dominated).sum())
    assert 0 < n_front < 20
    assert not dominated[kept[:n_front]].any()
    assert dominated[kept[n_front:]].all()
    again = most_critical(U, F * [100.0, 0.01], np.ones(200, dtype=bool), 200)
    assert again.tolist() == kept.tolist()  # the units of the objectives do not count


def test_near_copies_do_not_crowd_out_what_is_different():
    copies = np.full((50, 3), 0.9) + np.linspace(0.0, 0.2, 50)[:, None] * [0.2, 0.2, 0.2]
    U = np.vstack([copies, [[0.1, 0.1, 0.1]]])
    F = np.r_[np.full(50, -5.0), -1.0][:, None]
    kept = most_critical(U, F, np.ones(51, dtype=bool), 2)
    assert kept.tolist() == [0, 50]


def test_many_objectives_are_recorded_handed_over_and_reported(tmp_path):
    run = bg.run_search(
        "crossroads-s3",
        algorithm="random",
        objectives="many",
        objective="paper",
        budget=60,
        out=tmp_path / "a",
        keep=2,
        triage="none",
    )
    table = run.frame()
    ok = table[table.status == 0]
    np.testing.assert_array_equal(ok.f0, np.minimum(ok.d_min, METRICS["d_min"].cap))
    np.testing.assert_allclose(ok.f1, -3.6 * ok.v_d)
    assert len(run.scenarios) == 2
    assert "F of d_min" in run.report.read_text("utf-8")
    assert "--objectives many" in run.settings.command(tmp_path / "b")
    assert bg.resume(run.folder).frame().equals(table)


def test_the_recorded_command_makes_the_same_run(tmp_path, monkeypatch):
    first = bg.run_search(
        "crossroads-s4", budget=60, seed=5, settings={"batch": 15}, out=tmp_path / "a", keep=1,
        triage="none", fixed={"fog_density": 25.0}, weights="entropy",
    )  # fmt: skip
    words = shlex.split(first.settings.command(tmp_path / "b"))
    monkeypatch.setattr(sys, "argv", words)
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code in (0, None)
    assert same(rows_of(tmp_path / "a"), rows_of(tmp_path / "b"))


def test_one_seed_one_result_and_another_seed_another(tmp_path):
    runs = [
        bg.run_search(
            "crossroads-s1", budget=80, seed=seed, out=tmp_path / str(i), keep=0, triage="none"
        )
        for i, seed in enumerate((1, 1, 2))
    ]
    a, b, c = (rows_of(run.folder) for run in runs)
    assert same(a, b)
    assert not np.array_equal(a.U, c.U)


def start(folder: Path, budget: int) -> subprocess.Popen[str]:
    command = (
        f"search crossroads-s4 --budget {budget} --seed 3 --keep 2 --triage none --out {folder}"
    )
    code = "from bridgegen.cli import main; main()"
    return subprocess.Popen(
        [sys.executable, "-c", code, *command.split()],
        stderr=subprocess.PIPE, stdout=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip


def wait_for_rows(folder: Path, process: subprocess.Popen[str], count: int) -> None:
    end = time.monotonic() + 120
    while time.monotonic() < end and process.poll() is None:
        try:
            with Store.open(folder) as store:
                if len(store) >= count:
                    return
        except StorageError:
            pass
        time.sleep(0.01)
    raise AssertionError(f"no {count} rows in time: {process.stderr and process.stderr.read()}")


@pytest.mark.thorough
def test_killed_and_resumed_is_as_if_undisturbed(tmp_path):
    undisturbed = bg.run_search(
        "crossroads-s4", budget=600, seed=3, keep=2, triage="none", out=tmp_path / "whole"
    )
    process = start(tmp_path / "killed", 600)
    wait_for_rows(tmp_path / "killed", process, 200)
    os.killpg(process.pid, signal.SIGKILL)
    process.communicate()
    before = rows_of(tmp_path / "killed")
    assert 200 <= len(before) < 600
    resumed = bg.resume(tmp_path / "killed")
    rows = rows_of(resumed.folder)
    assert same(rows, rows_of(undisturbed.folder))
    # What was done is kept as it was, not done again.
    assert (rows.seconds[: len(before)] == before.seconds).all()
    for a, b in zip(undisturbed.scenarios, resumed.scenarios, strict=True):
        assert a.read_bytes() == b.read_bytes()


def test_ctrl_c_keeps_what_is_done_and_says_how_to_go_on(tmp_path):
    process = start(tmp_path / "run", 200_000)
    wait_for_rows(tmp_path / "run", process, 200)
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 130
    assert f"bridgegen resume {tmp_path / 'run'}" in errors
    assert "Traceback" not in errors
    assert len(rows_of(tmp_path / "run")) >= 200


def test_a_finished_run_gets_its_files_again(tmp_path):
    run = bg.run_search("crossroads-s4", budget=120, triage="none", out=tmp_path / "run", keep=1)
    run.report.unlink()
    again = bg.resume(run.folder)
    assert again.report.exists()
    assert again.summary == run.summary


def test_a_run_is_never_overwritten(tmp_path):
    bg.run_search("crossroads-s4", budget=40, out=tmp_path / "run", deliver=False)
    with pytest.raises(StorageError, match="resume"):
        bg.run_search("crossroads-s4", budget=40, out=tmp_path / "run", keep=0)


def test_a_changed_scenario_is_not_gone_on_with(tmp_path):
    text = "\n".join(
        (Path(bg.__file__).parent / "scenario" / "catalogue" / "crossroads-s4.yaml")
        .read_text("utf-8")
        .split("\n")
    ).replace("scenario: crossroads-s4", "scenario: mine")
    file = tmp_path / "mine.yaml"
    file.write_text(text, "utf-8")
    run = bg.run_search(file, budget=40, out=tmp_path / "run", keep=0, triage="none")
    assert bg.resume(run.folder).summary == run.summary
    file.write_text(text.replace("high: 3.6", "high: 3.5"), "utf-8")
    with refuses(StorageError):
        bg.resume(run.folder)


@pytest.mark.skipif(not TOWN05.exists(), reason="needs Town05.xodr")
def test_on_a_map_the_roads_are_the_map_s(tmp_path):
    with refuses(InputError):
        bg.run_search("crossroads-s4", road_map=TOWN05, axes=["static"], out=tmp_path / "none")
    run = bg.run_search(
        "crossroads-s2", road_map=TOWN05, algorithm="random", budget=400, keep=1, triage="none",
        out=tmp_path / "r",
    )  # fmt: skip
    frame = run.frame()
    assert (frame["lane_width"] == 3.5).all()
    # Road 18, where the BV starts on leg A, is 21.7 m long; the whole of the BV is on it.
    assert frame["bv_start"].max() < 21.7 - 3.0
    facts = json.loads(run.scenarios[0].with_suffix(".json").read_text("utf-8"))
    assert "lane_width" not in facts["parameters"]


@pytest.mark.thorough
@pytest.mark.skipif(not TOWN05.exists(), reason="needs Town05.xodr")
@pytest.mark.parametrize(
    ("scenario", "junction"),
    [("crossroads-s4", "965"), (Path(__file__).with_name("t-turn.yaml"), "924")],
)
def test_an_imported_map_is_searched_like_the_map(tmp_path, scenario, junction):
    road_map = tmp_path / "Town05.xodr"
    road_map.write_bytes(TOWN05.read_bytes())
    owl, _ = import_file(road_map)
    settings = {"algorithm": "random", "budget": 200, "keep": 1, "triage": "none"}
    settings |= {"junction": junction}
    one = bg.run_search(scenario, road_map=road_map, out=tmp_path / "one", **settings)
    other = bg.run_search(scenario, road_map=owl, out=tmp_path / "other", **settings)
    assert same(rows_of(one.folder), rows_of(other.folder))
    assert (other.folder / one.scenarios[0].relative_to(one.folder)).exists()
    assert bg.resume(other.folder).summary == other.summary
    road_map.write_bytes(TOWN05.read_bytes() + b"\n")
    with refuses(InputError):
        bg.run_search(scenario, road_map=owl, out=tmp_path / "third", **settings)
    assert not (tmp_path / "third").exists()


def test_the_results_are_a_data_frame(tmp_path):
    run = bg.run_search("crossroads-s4", budget=80, out=tmp_path / "run", deliver=False)
    frame = run.frame()
    assert len(frame) == 80
    assert {"ego_speed", "friction", "d_min", "v_d", "critical"} <= set(frame.columns)
    assert frame["critical"].mean() == run.summary.r_critic


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"scenario": "crossroads-s5"}, "crossroads-s"),
        ({"algorithm": "psso"}, "pso"),
        ({"ego": "referenze"}, "reference"),
        ({"objective": {"d_mim": 1.0}}, "d_min"),
        ({"axes": ["wether"]}, "weather"),
        ({"weights": "entropie"}, "entropy"),
        ({"objectives": "more"}, "more"),
    ],
)
def test_an_unknown_name_suggests_the_nearest(tmp_path, arguments, message):
    with refuses(UnknownNameError, message):
        bg.run_search(**({"scenario": "crossroads-s4", "out": tmp_path / "run"} | arguments))
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"budget": 0}, "1 <= budget"),
        ({"seed": -1}, "0 <= seed"),
        ({"keep": -1}, "0 <= keep"),
        ({"fixed": {"fog_density": 180.0}}, "fog_density"),
        ({"settings": {"batch": 0}}, "batch"),
        ({"settings": {"bach": 10}}, "batch"),
        ({"fixed": {"fog_densty": 1.0}}, "fog_density"),
        ({"road_map": Path("nowhere.xodr")}, "nowhere.xodr"),
    ],
)
def test_a_number_out_of_range_is_one_clear_error(tmp_path, arguments, message):
    with refuses(InputError, message):
        bg.run_search("crossroads-s4", out=tmp_path / "run", **arguments)
    assert not (tmp_path / "run").exists()


def test_what_an_algorithm_learnt_is_kept_and_shown(tmp_path):
    small = {"initial": 20, "population": 10, "generations": 1, "min_rows": 5}
    run = bg.run_search(
        "crossroads-s2", algorithm="nsga2-dt", budget=60, seed=1, settings=small, keep=0,
        causes=False, triage="none", objective="paper", out=tmp_path / "run",
    )  # fmt: skip
    trees, boxes = run.notes["decision trees"], run.notes["critical boxes"]
    assert trees[0]["evaluations"] == 20
    assert len([one for one in boxes if one["tree"] == 1]) == trees[0]["critical leaves"] > 0
    sample = run.frame()[:20]
    first = next(one for one in boxes if one["tree"] == 1)
    assert boxes[0]["tree"] == len(trees) > 1
    assert first["critical"] / first["rows"] >= 0.5
    assert first["critical"] <= sample["critical"].sum()
    page = run.report.read_text()
    assert '"title":"critical boxes","columns":["tree","box","rows","critical"]' in page
    assert (
        bg.run_search("crossroads-s2", budget=40, deliver=False, out=tmp_path / "pso").notes == {}
    )


def test_what_an_algorithm_refuses_leaves_no_folder(tmp_path):
    with refuses(UnknownNameError, "v_d"):
        bg.run_search(
            "crossroads-s2", algorithm="map-elites", settings={"descriptors": "v_e"},
            out=tmp_path / "run",
        )  # fmt: skip
    assert not (tmp_path / "run").exists()


@pytest.mark.skipif(os.name != "posix", reason="needs files that can be deleted while open")
@pytest.mark.parametrize("when", ["batch", "triage", "export", "report"])
def test_a_folder_that_is_deleted_in_mid_run_is_said_to_be(tmp_path, when):
    folder, batches = tmp_path / "run", []

    def on_batch(progress) -> None:
        batches.append(progress.evaluations)
        if when == "batch" and len(batches) == 2:
            shutil.rmtree(folder)

    def on_stage(name) -> None:
        if name == when:
            shutil.rmtree(folder)

    on = SearchCallbacks(batch=on_batch, stage=on_stage)
    with pytest.raises(StorageError) as stop:
        bg.run_search("crossroads-s4", budget=200, keep=1, ego="route-follower", causes=False,
                      triage="short", out=folder, callbacks=on)  # fmt: skip
    approve(str(stop.value), folder, "run.sqlite")
    if when == "batch":
        assert len(batches) == 2  # it stops with the next one


@pytest.mark.skipif(os.name != "posix", reason="needs files that can be deleted while open")
def test_ctrl_c_does_not_say_that_a_deleted_run_can_be_resumed(tmp_path):
    folder = tmp_path / "run"

    def on_batch(progress) -> None:
        shutil.rmtree(folder)
        raise KeyboardInterrupt

    with refuses(StorageError):
        bg.run_search(
            "crossroads-s4", budget=200, out=folder, callbacks=SearchCallbacks(batch=on_batch)
        )


def test_an_exported_file_that_is_deleted_while_the_report_is_made_costs_no_evaluation(tmp_path):
    folder = tmp_path / "run"

    def on_stage(name) -> None:
        if name == "report":
            shutil.rmtree(folder / "critical")

    with refuses(StorageError):
        bg.run_search(
            "crossroads-s4", budget=120, keep=1, ego="route-follower", causes=False,
            triage="none", out=folder, callbacks=SearchCallbacks(stage=on_stage),
        )  # fmt: skip
    assert bg.resume(folder).scenarios
