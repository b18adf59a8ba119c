"""Planners by name: those with an adapter here, and those of installed packages."""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen import drivers as ego
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.drivers import planners as registry
from bridgegen.drivers.planners import DOMAINS, Planner
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.simulate import simulate_file
from bridgegen.jobs.search import Run, resume, run_search
from bridgegen.scenario.language.reader import load

pytestmark = pytest.mark.thorough

ROOT = Path(__file__).parents[2]


@pytest.fixture
def package(add_planners):
    add_planners(**{"house:cruises": "CRUISES", "absent": "ABSENT", "old": "OLD"})
    return add_planners


def test_what_is_declared_here_is_complete():
    for name, one in registry.planners().items():
        assert isinstance(one, Planner)
        assert one.name == name
        assert one.domain
        assert one.domain <= DOMAINS.keys()
        assert all((one.description, one.licence, one.source))
        assert one.spec.rpartition(":")[2].isidentifier()
        assert not ego.is_spec(name)


def test_reading_the_declarations_imports_no_planner():
    """Nor does the command line read them before it must."""
    code = (
        "import sys; from bridgegen.drivers.planners import planners, missing\n"
        "found = [missing(one) for one in planners().values()]\n"
        "print(*sys.modules)"
    )
    names = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    foreign = {
        "fiss_planner",
        "highway_env",
        "metadrive",
        "libsumo",
        "traci",
        "acados",
        "gymnasium",
    }
    assert not foreign & {*names.stdout.split()}
    assert not {one for one in names.stdout.split() if one.startswith("commonroad")}
    code = "import sys, bridgegen.cli; print(*sys.modules)"
    names = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    ours = {one for one in names.stdout.split() if one.startswith("bridgegen.adapters.planners.")}
    assert ours <= {"bridgegen.drivers.planners"}
    assert "packaging.requirements" not in names.stdout.split()


def test_a_name_comes_before_a_class_of_that_spelling(package):
    assert ego.is_spec("house:other")
    assert not ego.is_spec("house:cruises")
    driver = ego.get("house:cruises", ["perception"], 3.0)
    assert (driver.name, driver.spec, driver.is_own) == ("house:cruises", "drivers:Cruises", True)
    assert (driver.time_limit, driver.label) == (3.0, "house:cruises (ideal perception)")
    assert ego.get("house:other").spec == "house:other"


def test_the_nearest_name_is_named(package):
    with refuses(UnknownNameError, "house-cruises", "house:cruises"):
        ego.get("house-cruises")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "absent",
            "the planner 'absent' needs no-such-planner>=1.0,<2: no-such-planner is not installed; "
            "get it by pip install 'no-such-planner>=1.0,<2'; It needs a checkout.",
        ),
        ("old", "the planner 'old' needs numpy<1.0: numpy must be <1.0, is "),
    ],
)
def test_one_that_is_not_installed_says_how_to_get_it(package, name, message):
    with pytest.raises(InputError) as error:
        ego.get(name)
    assert str(error.value).startswith(message)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        (
            "lost",
            "LOST",
            "sea",
        ),
        ("one", "OTHER", "another"),
        ("none", "NO_PLANNER", "bridgegen"),
        ("gone", "NOTHING", "AttributeError"),
    ],
)
def test_a_package_that_is_wrong_is_named(package, name, value, message):
    package(**{name: value})
    with refuses(InputError, message):
        ego.get(name)


def test_a_run_keeps_the_name_and_resumes_by_it(package, tmp_path):
    """Another process drives by the same planner; its files name it, too."""
    run = run_search(
        "lead-brakes", algorithm="random", budget=6, ego="house:cruises", keep=1, seed=1,
        causes=False, triage="short", out=tmp_path / "run",
    )  # fmt: skip
    assert run.settings.ego == "house:cruises"
    assert "--ego house:cruises" in run.settings.command(tmp_path)
    assert run.triage is not None
    assert run.triage.ego == "house:cruises"
    assert not run.failures
    before = run.rows()
    again = resume(tmp_path / "run")  # by its name: it is no code of a stranger
    assert again.rows().digest() == before.digest()
    assert Run(tmp_path / "run").scenarios
    outcome = simulate_file(again.scenarios[0])
    assert outcome.rollout.status[0] == 0


def test_a_file_that_names_one_which_is_not_installed_is_refused(package, tmp_path):
    run = run_search(
        "lead-brakes", algorithm="random", budget=6, ego="house:cruises", keep=1, seed=1,
        causes=False, triage="short", out=tmp_path / "run",
    )  # fmt: skip
    file = run.scenarios[0]
    file.write_text(file.read_text().replace("house:cruises", "absent"))
    with pytest.raises(InputError, match="pip install"):
        simulate_file(file)


def test_the_list_says_which_are_installed(package, cli):
    code, out, _ = cli("list", "drivers", "--json")
    rows = {row["driver"]: row for row in json.loads(out)}
    assert code == 0
    assert rows["house:cruises"]["available"].startswith("installed: numpy 2")
    assert rows["house:cruises"]["domain"] == "motorway, road"
    assert rows["un-r157"]["domain"] == "motorway"
    assert rows["reference"]["domain"] == ""
    approve(rows["absent"]["available"], "no-such-planner>=1.0,<2")
    assert rows["reference"]["available"] == "ships"
    code, out, _ = cli("list", "drivers")
    assert code == 0
    lines = [line.rstrip() for line in out.splitlines()]
    assert "absent" in lines
    assert lines[lines.index("    can be ideal: perception,prediction,control") + 1].endswith(
        "ships"
    )
    assert max(map(len, lines)) <= 80
    code, out, _ = cli("doctor", "--json")
    found = {row["subject"]: row for row in json.loads(out)}
    assert code == 0
    approve(found["planner absent"]["advice"], "no-such")
    assert found["planner house:cruises"]["advice"] == ""


@pytest.mark.planners
@pytest.mark.parametrize(
    "name", [name for name, one in registry.planners().items() if not registry.missing(one)]
)
def test_each_that_is_installed_drives_the_nominal_cut_in(name):
    logical = load("cut-in")
    pipeline = Pipeline(logical, logical.space(), PipelineOptions(ego=name, ideal=["perception"]))
    rollout = pipeline.rollout(pipeline.space.row({})[np.newaxis])
    assert rollout.status[0] == 0, rollout.messages
    assert rollout.x[0, 0].max() - rollout.x[0, 0].min() > 50.0


def test_the_extra_installs_what_the_adapters_need():
    """But for what it cannot install beside the others; see docs/planners.md."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    extra = {one.partition(";")[0].strip() for one in project["optional-dependencies"]["planners"]}
    for name, one in registry.planners().items():
        if one.spec.startswith("bridgegen.") and name != "commonroad-reactive":
            assert {*one.requires} <= extra, name
