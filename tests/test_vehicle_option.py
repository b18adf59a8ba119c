"""``--vehicle`` in every command that takes it: what it changes, what is recorded and refused."""

import json

import numpy as np
import pytest
from tests.approval import approve
from tests.campaign.braking import scenario_text, write_pair

import bridgegen as bg
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.preventability.classes import CellClass
from bridgegen.jobs.preventability.preventability import map_preventability
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.jobs.suite.suite import FILE, read_suite
from bridgegen.scenario.language.reader import load

UNKNOWN = "unknown vehicle 'tank'; known: kinematic, multi-body, single-track"
ELSEWHERE = "the vehicle 'single-track' is of the embedded simulator; esmini moves the ego in its"


@pytest.fixture
def bend(tmp_path):
    """A file of a bend, whose ego is a single track, and a limit that only that exceeds [m]."""
    logical, wide = load("stopped-after-curve"), {}
    for name in ("kinematic", "single-track"):
        options = PipelineOptions(ego="route-follower", vehicle=name)
        pipeline = Pipeline(logical, logical.space(), options)
        pipeline.choose_objective()
        x = pipeline.space.row({"ego_speed": 20.0})
        wide[name] = np.abs(pipeline.rollout(x[np.newaxis]).offset[0, 0]).max()
    assert wide["single-track"] > 1.5 * wide["kinematic"]
    *_, path = write_scenario(pipeline, x, tmp_path, "bend")
    return path, sum(wide.values()) / 2


@pytest.fixture
def braking(tmp_path):
    """A file whose ego is driven by its storyboard."""
    path, _ = write_pair(tmp_path)
    path.write_text(scenario_text(), "utf-8")
    return path


def test_simulate_takes_the_file_s_or_another(bend, cli):
    path, _ = bend
    printed = {}
    for name in ("", "single-track", "kinematic"):
        status, printed[name], _ = cli("simulate", path, *(["--vehicle", name] if name else []))
        assert status == 0
    assert printed[""] == printed["single-track"]
    assert printed[""] != printed["kinematic"]


def test_a_suite_takes_the_file_s_or_another_and_keeps_them_apart(bend, tmp_path, cli):
    path, limit = bend
    criterion = f"W-1: always(abs(ego.offset) < {limit:.6f} m)"
    results = {}
    for name in ("", "single-track", "kinematic"):
        words = ["suite", path, "--criterion", criterion, "--workers", 1]
        words += ["--vehicle", name] if name else []
        cli(*words, "--out", tmp_path / f"out-{name}")
        (entry,) = read_suite(tmp_path / f"out-{name}").results
        results[name] = bool(entry.rows[0].violated)
    assert results == {"": True, "single-track": True, "kinematic": False}
    head = json.loads((tmp_path / "out-single-track" / FILE).read_text("utf-8").splitlines()[0])
    assert head["settings"]["vehicle"] == "single-track"
    status, _, err = cli(*words, "--out", tmp_path / "out-single-track")
    assert status == 2
    approve(err, "settings")


def test_a_map_of_preventability_and_its_record(tmp_path):
    """Brakes that build up 0.2 s later avoid no collision that others do not."""
    found = {
        name: map_preventability(
            "r157/cut-in", ["careful-fsm"], grid=["gap=1:46:10", "relative_speed=5:14:4"],
            models=["careful-fsm"], vehicle=name, out=tmp_path / name,
        )
        for name in ("kinematic", "single-track")
    }  # fmt: skip
    one, two = (found[name].classes["careful-fsm"] for name in ("kinematic", "single-track"))
    assert (one != two).any()
    avoided = [(classes == CellClass.AVOIDED).sum() for classes in (one, two)]
    assert avoided[1] < avoided[0]
    settings = json.loads((tmp_path / "single-track" / "map.json").read_text("utf-8"))
    assert '"vehicle": "single-track"' in json.dumps(settings)


@pytest.mark.parametrize("vehicle", ["single-track", "multi-body"])
def test_a_comparison_records_it_in_each_run(vehicle, tmp_path):
    given = {"algorithms": "random", "seeds": 1, "budget": 20, "workers": 1}
    out = tmp_path / "out"
    bg.compare("cut-in", ego="route-follower", vehicle=vehicle, **given, out=out)
    (run,) = (out / "runs").iterdir()
    assert bg.resume(run, deliver=False).settings.vehicle == vehicle


def test_a_comparison_refuses_an_unknown_one(tmp_path, cli):
    words = "compare cut-in --algorithms random --seeds 2 --budget 8 --vehicle tank --out"
    status, _, err = cli(*words.split(), tmp_path / "out")
    assert status == 2
    assert UNKNOWN in err


def test_a_run_file_names_it_and_the_command_line_overrides_it(tmp_path, cli):
    path = tmp_path / "run.yaml"
    path.write_text(
        "run: {scenario: cut-in, ego: route-follower, vehicle: single-track, budget: 8, keep: 0, "
        "triage: none, algorithm: random, out: out}"
    )
    assert cli("search", path)[0] == 0
    assert bg.resume(tmp_path / "out").settings.vehicle == "single-track"
    other = ["--vehicle", "kinematic", "--out", tmp_path / "other"]
    assert cli("search", path, *other)[0] == 0
    assert bg.resume(tmp_path / "other").settings.vehicle == "kinematic"


@pytest.mark.parametrize(
    "words",
    [
        "search cut-in --budget 8", "suite FILE --ego reference", "simulate FILE --ego reference",
        "preventability r157/cut-in --ego route-follower --grid gap=1:61:5",
    ],
)  # fmt: skip
def test_an_unknown_one_is_refused_before_anything_is_written(words, braking, tmp_path, cli):
    given = words.replace("FILE", str(braking)).split()
    out = tmp_path / "out"
    keeps = [] if given[0] == "simulate" else ["--out", out]
    status, _, err = cli(*given, "--vehicle", "tank", *keeps)
    assert status == 2
    assert UNKNOWN in err
    assert not out.exists()


@pytest.mark.parametrize("words", ["search cut-in --budget 8", "suite FILE --ego reference"])
def test_other_simulators_refuse_it_before_anything_is_written(words, braking, tmp_path, cli):
    out = tmp_path / "out"
    given = words.replace("FILE", str(braking)).split()
    simulator = ["--vehicle", "single-track", "--simulator", "esmini"]
    status, _, err = cli(*given, *simulator, "--out", out)
    assert status == 2
    assert ELSEWHERE in err
    assert not out.exists()


def test_an_ego_that_its_storyboard_drives_refuses_it(braking, cli):
    status, _, err = cli("simulate", braking, "--vehicle", "single-track")
    assert status == 2
    approve(err, "single-track")
