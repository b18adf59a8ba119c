"""The sensitivity of a run's verdicts: what is planted is found, what is not is not said."""

import json
import shutil
import sqlite3
from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve, refuses
from typer.testing import CliRunner

import bridgegen as bg
from bridgegen.base.errors import FileFormatError, InputError, StorageError
from bridgegen.cli import app
from bridgegen.engine.constants import try_with
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.search.report import SENSITIVITY
from bridgegen.jobs.search.sensitivity import _write_page, sensitivity_of, shares
from bridgegen.scenario.language.reader import load
from bridgegen.search.sensitivity import JSON_FILE, read_record

pytestmark = pytest.mark.thorough

FEW = {"findings": 3, "trajectories": 2}
ONE = {"findings": 1, "trajectories": 2}


@pytest.fixture(scope="module")
def cut_out(tmp_path_factory):
    """A run of which some collisions count only because a careful driver avoids them."""
    folder = tmp_path_factory.mktemp("cut-out") / "run"
    bg.run_search("cut-out", ego="route-follower", budget=200, seed=1, triage="short", out=folder)
    return folder


@pytest.fixture(scope="module")
def found(cut_out):
    return sensitivity_of(cut_out, **FEW)


def test_a_verdict_that_hangs_on_the_careful_driver_is_found(cut_out, found):
    """The stated limit is true: the finding stands there, and not a little beyond."""
    scenario = load("cut-out")
    pipeline = Pipeline(scenario, scenario.space(), PipelineOptions(ego="route-follower"))
    pipeline.choose_objective()
    hang = [
        (finding, effect)
        for finding in found.findings
        for effect in finding.effects
        if effect.name == "careful-reaction" and effect.at_most is not None
    ]
    assert hang
    rows = bg.load(cut_out).rows()
    for finding, effect in hang:
        assert any(
            text.startswith("stands only while the careful driver's reaction time is ≤")
            for text in finding.sentences
        )
        X = rows.X[[finding.evaluation]]
        stands, beyond = (
            try_with(pipeline.runner, X, X, "harm", "ego", {"careful-reaction": value})
            for value in (effect.at_most, effect.at_most + 0.02)
        )
        assert stands.harmful[0]
        assert not beyond.harmful[0]
    first = shares(found)
    assert next(one for one in first if one.kind == "constant").name == "careful-reaction"


def test_where_no_verdict_hangs_on_a_constant_nothing_is_said(tmp_path):
    folder = tmp_path / "run"
    bg.run_search("cut-in", ego="route-follower", budget=60, seed=2, triage="short", out=folder)
    record = sensitivity_of(folder, trajectories=2, findings=2)
    assert record.findings
    assert all(not finding.sentences for finding in record.findings)
    assert all(
        effect.at_least is effect.at_most is None
        for finding in record.findings
        for effect in finding.effects
    )
    assert (
        "No verdict on 2 findings hangs on one constant alone."
        in (folder / SENSITIVITY).read_text()
    )
    assert f'"beside":["{SENSITIVITY}"]' in (folder / "report.html").read_text("utf-8")


def test_the_same_seed_gives_the_same_bytes(cut_out, tmp_path):
    other = tmp_path / "run"
    shutil.copytree(cut_out, other)
    sensitivity_of(cut_out, **ONE)
    sensitivity_of(other, **ONE)
    for name in (JSON_FILE, SENSITIVITY):
        assert (cut_out / name).read_bytes() == (other / name).read_bytes()
    once = json.loads((other / JSON_FILE).read_text())
    sensitivity_of(other, **ONE, seed=7)
    again = json.loads((other / JSON_FILE).read_text())
    assert again["findings"] != once["findings"]
    assert [f["sentences"] for f in again["findings"]] == [f["sentences"] for f in once["findings"]]


def test_a_budget_is_kept_and_said_before(cut_out):
    said, done = [], []
    record = sensitivity_of(
        cut_out, findings=8, trajectories=6, budget=900, say=said.append,
        progress=lambda n, total: done.append((n, total)),
    )  # fmt: skip
    assert record.evaluations <= 900
    assert record.trajectories == 2
    assert len(record.findings) < 8
    assert record.left_out > 0
    assert done[-1][0] == record.evaluations
    approve(said, "evaluations")


def test_the_record_is_of_these_evaluations(cut_out, found):
    sensitivity_of(cut_out, **ONE)
    digest = bg.load(cut_out).rows().digest()
    assert read_record(cut_out / JSON_FILE, digest).results == digest
    with refuses(FileFormatError, "other evaluations"):
        read_record(cut_out / JSON_FILE, "0" * 64)


def test_effects_are_of_all_constants_and_of_the_parameters_that_move(found):
    (names,) = {tuple(sorted(e.name for e in f.effects)) for f in found.findings}
    assert {"careful-reaction", "road-friction", "ego_speed"} <= {*names}
    assert not {"clear-air", "brake-lag"} & {*names}
    for finding in found.findings:
        assert all(effect.flips <= effect.of <= 2 for effect in finding.effects)


@pytest.mark.parametrize(
    ("given", "named"),
    [({"findings": 0}, "findings"), ({"trajectories": 1}, "trajectories"),
     ({"budget": 10}, "budget"), ({"seed": -1}, "seed")],
)  # fmt: skip
def test_numbers_out_of_range_are_refused(cut_out, given, named):
    with refuses(InputError, named):
        sensitivity_of(cut_out, **given)


def test_a_run_that_cannot_be_analysed_says_so_in_one_line(cut_out, tmp_path):
    with refuses(StorageError):
        sensitivity_of(tmp_path)
    quiet = tmp_path / "quiet"
    bg.run_search("cut-in", ego="un-r157", budget=4, triage="none", out=quiet,
                  fixed={"gap": 60.0})  # fmt: skip
    with refuses(InputError, "no findings"):
        sensitivity_of(quiet)
    two = tmp_path / "two"
    bg.run_search("cut-in", ego="route-follower", worse_than="un-r157", budget=20,
                  triage="none", out=two)  # fmt: skip
    with refuses(InputError, "two drivers"):
        sensitivity_of(two)
    older = tmp_path / "older"
    shutil.copytree(cut_out, older)
    with sqlite3.connect(older / "run.sqlite") as database:
        database.execute("UPDATE run SET value = '\"0.0.9\"' WHERE key = 'version'")
    with refuses(InputError, "0.0.9"):
        sensitivity_of(older)
    (older / "triage.json").unlink()
    with refuses(InputError, "finished"):
        sensitivity_of(older)


def test_a_driver_in_python_has_to_be_named_and_is_evaluated(tmp_path):
    (tmp_path / "own.py").write_text(
        "import numpy as np\n"
        "from bridgegen.drivers.interface import Control\n"
        "class Coasts:\n"
        "    period = 0.5\n"
        "    def reset(self, n, scene):\n"
        "        pass\n"
        "    def act(self, observation):\n"
        "        nothing = np.zeros(len(observation.v))\n"
        "        return Control(nothing, nothing)\n"
    )
    ego = f"{tmp_path / 'own.py'}:Coasts"
    bg.run_search("cut-in", ego=ego, budget=24, seed=3, triage="short", out=tmp_path / "run")
    with refuses(InputError, "--ego"):
        sensitivity_of(tmp_path / "run")
    record = sensitivity_of(tmp_path / "run", **ONE, ego=ego)
    assert len(record.findings) == 1
    assert record.evaluations > 100


def test_texts_of_strangers_are_escaped_on_the_page(found, tmp_path):
    bad = "<img src=x onerror=alert(1)>"
    first = found.findings[0].model_copy(update={"title": bad, "sentences": (bad,)})
    _write_page(tmp_path / SENSITIVITY, found.model_copy(update={"ego": bad, "findings": (first,)}))
    text = (tmp_path / SENSITIVITY).read_text()
    assert "<img" not in text
    assert "&lt;img" in text
    assert text.count("<script") == 1


def test_the_command_prints_what_moves_what(cut_out):
    run = CliRunner().invoke(
        app, ["analyse", "sensitivity", str(cut_out), "--findings", "3", "--trajectories", "2"]
    )
    assert run.exit_code == 0, run.output
    assert "constant or parameter" in run.stdout
    assert "stands only while the careful driver's reaction time is ≤" in run.stdout
    as_json = CliRunner().invoke(
        app,
        [
            "analyse",
            "sensitivity",
            str(cut_out),
            "--findings",
            "1",
            "--trajectories",
            "2",
            "--json",
        ],
    )
    facts = json.loads(as_json.stdout)
    assert facts == json.loads(Path(cut_out / JSON_FILE).read_text())
    effect = facts["findings"][0]["effects"][0]
    assert {"name", "mu_star", "sigma", "flips", "of"} <= effect.keys()
    assert np.isfinite(effect["mu_star"])
