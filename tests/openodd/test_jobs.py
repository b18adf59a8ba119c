"""Jobs in an operational design domain."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve, refuses

import bridgegen as bg
from bridgegen.base.errors import InputError, ScenarioError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.dashboard.dashboard import build_dashboard
from bridgegen.jobs.preventability.preventability import map_preventability
from bridgegen.jobs.risk.risk import estimate_risk
from bridgegen.jobs.search.campaign import resume
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.jobs.search.scenarios import load, within
from bridgegen.jobs.suite.suite import run_suite
from bridgegen.results.store import Store
from bridgegen.scenario.odd.states import states_of

pytestmark = pytest.mark.thorough

HERE = Path(__file__).parent
EXAMPLE = Path(__file__).parents[2] / "docs/examples/motorway-odd.yaml"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A run whose ODD is gone since: nothing needs the files again."""
    folder = tmp_path_factory.mktemp("project")
    for name in ("my_odd.yaml", "taxonomy.yaml"):
        shutil.copy(HERE / name, folder)
    options = {"ego": "route-follower", "budget": 60, "keep": 1, "algorithm": "random"}
    bg.run_search("cut-in", odd=folder / "my_odd.yaml", out=folder / "run", **options)
    (folder / "my_odd.yaml").unlink()
    (folder / "taxonomy.yaml").unlink()
    return folder


def test_a_search_stays_inside_and_records_the_odd_with_its_contents(folder):
    run = bg.Run(folder / "run")
    rows = run.rows()
    speed = rows.X[:, run.parameters.index("ego_speed")]
    assert (speed.min() >= 15.0, 3.6 * speed.max() <= 90.0) == (True, True)
    recorded = run.settings.odd
    assert sorted(recorded["files"]) == ["my_odd.yaml", "taxonomy.yaml"]
    assert f"--odd {folder / 'my_odd.yaml'}" in run.settings.command(folder)
    assert "ODD my_odd, 2 conditions not judged" in run.report.read_text(encoding="utf-8")


def test_what_is_said_of_the_weather_names_that_it_is_drawn_from_a_part(folder, cli):
    said = "weather as it is met within its ranges, all else uniform"
    assert bg.Run(folder / "run").triage.bound.space.measure == said


def test_what_it_exports_has_its_current_operational_domain(folder):
    (exported,) = bg.Run(folder / "run").exported()
    names = {Path(name).name for name in exported.files}
    assert "0001.cod.yaml" in names
    text = (folder / "run/critical/0001.cod.yaml").read_text(encoding="utf-8")
    assert "# inside the ODD" in text


def test_a_run_is_resumed_without_the_files(folder, tmp_path):
    whole = bg.Run(folder / "run").rows()
    half = tmp_path / "half"
    shutil.copytree(folder / "run", half)
    with Store.open(half, write=True):
        pass
    resumed = resume(half)
    assert np.array_equal(resumed.rows().X, whole.X)
    assert np.array_equal(resumed.rows().F, whole.F)


def test_coverage_of_a_run_is_counted_against_its_odd(folder, cli):
    found = json.loads(cli("analyse", "coverage", folder / "run", "--json")[1])["odd"]
    at = {each["name"]: each for each in found["attributes"]}
    assert sum(at["operational_speed"]["evaluations"]) == 60
    assert at["connectivity_bandwidth"]["problem"] == "no scenario states it"
    status, out, _ = cli("analyse", "coverage", folder / "run")
    assert status == 0
    approve(out, "Of the ODD", "connectivity_bandwidth", "agent_type")


def test_a_run_without_an_odd_records_none_and_covers_none(tmp_path):
    run = bg.run_search("cut-in", budget=2, keep=0, out=tmp_path / "run", algorithm="random")
    with Store.open(run.folder) as store:
        assert "odd" not in store.settings
    assert run.settings.odd is None
    assert not list(run.folder.glob("critical/*.cod.yaml"))


def test_the_dashboard_shows_the_projects_odd_and_counts_other_runs_against_it(folder):
    bg.run_search("cut-in", budget=20, keep=0, out=folder / "free", algorithm="random", seed=1)
    found = build_dashboard(folder).project.odd
    assert found.runs == 2
    assert found.coverage.evaluations + found.outside == 80
    assert found.outside > 0  # those of the run that no ODD bounds
    page = (folder / "dashboard.html").read_text(encoding="utf-8")
    assert "Motorway pilot (my_odd)" in page
    assert "no scenario states primary_road" in page
    other = build_dashboard(folder, odd=EXAMPLE, out=folder / "other.html").project.odd
    assert other.coverage.odd.name == "motorway-odd"
    assert other.others == {"my_odd"}


def test_a_suite_does_not_run_what_is_outside_and_counts_in_the_dashboard(tmp_path):
    run_suite("cut-in", samples=20, out=tmp_path / "free")
    suite = run_suite(["cut-in", "lead-brakes"], samples=1, odd=EXAMPLE, out=tmp_path / "suite")
    problems = {result.entry: result.problem for result in suite.results}
    assert problems["cut-in"] == ""
    assert "excludes every row of lead-brakes" in problems["lead-brakes"]
    odd = build_dashboard(tmp_path).project.odd
    assert (odd.coverage.odd.name, odd.entries, odd.unread) == ("motorway-odd", 2, 0)
    assert odd.coverage.evaluations + odd.outside == 21 + 2  # each with the defaults
    assert 0 < odd.outside < 21
    assert "0 runs and 2 entries of suites" in (tmp_path / "dashboard.html").read_text("utf-8")


def test_a_suites_variations_are_run_again_in_its_odd(tmp_path, cli):
    key, out, suite = str(tmp_path / "key"), str(tmp_path / "out"), ["suite"]
    given = ["--odd", str(EXAMPLE)]
    assert cli(*suite, "commit", "cut-in", "--key", key, "--number", "10", *given)[0] == 0
    code, _, err = cli(*suite, "cut-in", "--assessor", key)
    assert (code, "as the key says; not: odd" in err) == (2, True), err
    words = ["cut-in", "--ego", "route-follower", *given, "--out", out]
    cli(*suite, *words, "--assessor", key)
    code, said, err = cli(*suite, "verify", f"{out}/sealed.json", "cut-in", "--ego=route-follower")
    assert (code, "to the bit" in said) == (0, True), err
    _, said, err = cli(*suite, "replay", out, "cut-in", "1")
    assert "gives it, too" in said, said + err


def test_a_map_of_what_is_preventable_stays_inside(tmp_path):
    with refuses(Exception, "ego_speed"):
        map_preventability(
            "r157/cut-in", "un-r157", odd=EXAMPLE, grid=["ego_speed=20:36:3"], out=tmp_path / "map"
        )


def test_a_run_file_names_the_odd_and_is_read_again(tmp_path, cli):
    path = tmp_path / "run.yaml"
    words = ("cut-in", "--odd", EXAMPLE, "--budget", "5", "--algorithm", "random")
    assert cli("search", *words, "--save", path, "--out", tmp_path / "a")[0] in (0, 3)
    assert "motorway-odd.yaml" in path.read_text(encoding="utf-8")
    assert cli("search", path, "--out", tmp_path / "b")[0] in (0, 3)
    first, second = (bg.Run(each).settings.odd for each in (tmp_path / "a", tmp_path / "b"))
    assert first == second


def test_a_scenario_outside_is_refused():
    with refuses(ScenarioError, "roundabout-entry"):
        within(load("roundabout-entry"), EXAMPLE)


def test_a_scenario_file_is_bounded_by_its_weather_speed_and_participants(tmp_path):
    """As the scenario is that it was written of; its map is not read."""
    pipeline = Pipeline(logical := load("cut-in"), logical.space())
    row = pipeline.space.row({"fog_density": 60.0, "precipitation": 20.0, "wind_intensity": 30.0})
    write_scenario(pipeline, row, tmp_path, "exported")
    file = load(tmp_path / "exported.xosc")
    found, states = file.states(), states_of(logical)
    for name, formula in found.quantities.items():
        expected = states.quantities[name].evaluate(pipeline.space.values(row))
        assert float(formula.evaluate(file.usual_values())) == pytest.approx(
            expected, abs=0.51 * (name == "cloud")
        )
    assert {*found.quantities} == {
        "rain", "visual_range", "wind", "friction", "sun_altitude", "illuminance", "cloud",
        "ego_speed",
    }  # fmt: skip
    assert found.others == ((("car",), ""),)
    text = "ODD:\n  m:\n    INCLUDE_AND:\n      visibility: '{} 420 m'\n      lane_width: '> 9 m'\n"
    for sign in ("<", ">"):
        (tmp_path / f"{sign}.yaml").write_text(text.format(sign))
    assert within(file, tmp_path / "<.yaml").odd.gaps == {
        "lane_width > 9 m": "not read of an OpenSCENARIO file"
    }
    with refuses(ScenarioError, "visibility > 420 m"):
        within(file, tmp_path / ">.yaml")


def test_a_risk_inside_states_no_rate_of_all_encounters(tmp_path, cli):
    exposure = EXAMPLE.with_name("cut-in-exposure.yaml")
    words = ("--exposure", exposure, "--odd", EXAMPLE, "--budget", "500", "--method", "mc")
    status, out, _ = cli("risk", "cut-in", *words, "--out", tmp_path / "risk")
    assert status == 0
    approve(out, "inside it")
    assert "per km" not in out


def test_a_comparison_of_algorithms_stays_inside(tmp_path, cli):
    words = ("--algorithms", "random,pso", "--seeds", "1", "--budget", "30", "--odd", EXAMPLE)
    status, _, error = cli(
        "benchmark", "algorithms", "cut-in", *words, "--out", tmp_path / "comparison"
    )
    assert (status, error.count("Traceback")) == (0, 0)
    runs = [bg.Run(path.parent) for path in (tmp_path / "comparison").rglob("run.sqlite")]
    assert len(runs) == 2
    for run in runs:
        assert run.rows().X[:, run.parameters.index("ego_speed")].max() <= 25.0


def test_a_beta_distribution_of_a_range_that_the_odd_narrows_is_refused(tmp_path):
    text = EXAMPLE.with_name("cut-in-exposure.yaml").read_text(encoding="utf-8")
    normal = "{distribution: normal, mean: 100 km/h, deviation: 3}"
    assert normal in text
    path = tmp_path / "exposure.yaml"
    path.write_text(text.replace(normal, "{distribution: beta, alpha: 2, beta: 2}"))
    with refuses(InputError, "ego_speed"):
        estimate_risk("cut-in", exposure=path, odd=EXAMPLE, out=tmp_path / "risk")
