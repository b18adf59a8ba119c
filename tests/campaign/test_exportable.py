"""What would be refused at export is refused before the search, and never stops other exports."""

import json
from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve, refuses

import bridgegen as bg
from bridgegen.base.errors import OntologyError, StorageError
from bridgegen.cli.terminal.search import print_summary
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.search import critical
from bridgegen.jobs.search.exportable import corners
from bridgegen.jobs.search.exported import NOT_EXPORTED, Refused, not_exported
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.jobs.search.validate import validate_file
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.starter import start_scenario


@pytest.fixture
def bus_on_a_shoulder(tmp_path, monkeypatch) -> Path:
    """A bus starts on the shoulder, and then pulls out: it may stand there, but not drive."""
    monkeypatch.chdir(tmp_path)
    path = start_scenario("bus", like="lead-brakes")
    text = path.read_text("utf-8")
    text = text.replace("road_type: rural}", "road_type: rural, shoulder_width: 3.0}")
    text = text.replace(
        "    type: car\n    start: {distance: lead_at}",
        "    type: bus\n    start: {lane: shoulder, distance: lead_at}",
    )
    approve(text, "shoulder")
    path.write_text(text, "utf-8")
    return path


MESSAGE = (
    "on_lane of lead (Bus) must be a lane to drive on (or a shoulder to stand on, or to pull out "
    "from)"
)


def test_validate_says_what_would_be_refused_at_export(bus_on_a_shoulder):
    (problem,) = [one for one in validate_file(bus_on_a_shoulder) if "on_lane" in one]
    assert MESSAGE in problem
    approve(problem, "bus.yaml")


def test_a_search_refuses_it_at_once(bus_on_a_shoulder, tmp_path, cli):
    code, _, err = cli("search", bus_on_a_shoulder, "--out", tmp_path / "run")
    assert code == 2
    assert MESSAGE in err
    assert "Traceback" not in err
    assert not (tmp_path / "run").exists()


def test_the_corners_of_the_ranges_are_tried():
    scenario = load("lead-brakes")
    space = scenario.space()
    X, words = corners(Pipeline(scenario, space))
    assert len(X) == len(words) == 2 * space.n_var + 3
    approve(words[0])
    np.testing.assert_array_equal(X[0], space.row({}))
    gap = X[:, space.index("gap")]
    assert gap[1], gap[2] == (12.0, 60.0)
    assert gap[words.index("with gap at its lowest")] == 12.0
    assert gap[words.index("with gap at its highest")] == 60.0
    low = X[words.index("with gap at its lowest")]
    same = [i for i, name in enumerate(space.names) if name not in ("gap", "lead_at")]
    np.testing.assert_allclose(low[same], X[0][same])
    assert space.violations(X) == []


def test_an_adversary_s_scenario_is_tried_too(tmp_path):
    run = bg.run_search(
        "crossroads-s1",
        adversary="bv",
        algorithm="random",
        budget=4,
        keep=0,
        triage="none",
        out=tmp_path / "run",
    )
    assert run.summary.evaluations == 4


def test_what_cannot_be_exported_is_left_out_and_named(tmp_path, monkeypatch, capsys):
    write = critical.write_scenario

    def refuse(pipeline, x, folder, name, *cause, **given):
        if name == "0002":
            raise OntologyError(f"{name}.owl: no such lane", f"{name}.owl: nor road")
        return write(pipeline, x, folder, name, *cause, **given)

    monkeypatch.setattr(critical, "write_scenario", refuse)
    run = bg.run_search("crossroads-s3", budget=60, keep=3, triage="none", out=tmp_path / "run")
    assert [path.stem for path in run.scenarios] == ["0001", "0003"]
    (left,) = run.not_exported
    assert left.name == "0002"
    assert left.problems == ("0002.owl: no such lane", "0002.owl: nor road")
    assert run.frame()["critical"].iloc[left.evaluation]
    assert run.report.is_file()
    print_summary(run, 1.0)
    said = f"0002, evaluation {left.evaluation + 1}: 0002.owl: no such lane; 0002.owl: nor road"
    assert said in capsys.readouterr().out

    monkeypatch.setattr(critical, "write_scenario", write)  # mended, and resumed
    again = bg.resume(run.folder)
    assert len(again.scenarios) == 3
    assert again.not_exported == ()
    assert not (run.folder / NOT_EXPORTED).exists()


def test_a_refused_scenario_leaves_no_files(bus_on_a_shoulder, tmp_path):
    scenario = load(bus_on_a_shoulder)
    pipeline = Pipeline(scenario, scenario.space())
    folder = tmp_path / "files"
    folder.mkdir()
    with refuses(OntologyError, "on_lane", "one.owl"):
        write_scenario(pipeline, pipeline.space.row({}), folder, "one")
    assert list(folder.iterdir()) == []


def test_a_damaged_list_of_refused_scenarios(tmp_path):
    path = tmp_path / NOT_EXPORTED
    path.write_text(json.dumps([{"name": "0001"}]), "utf-8")
    with pytest.raises(StorageError, match="resume"):
        not_exported(tmp_path)
    path.write_text('[{"name": "0001", "evaluation": 3, "problems": ["a"]}]', "utf-8")
    assert not_exported(tmp_path) == (Refused("0001", 3, ("a",)),)
