"""The drivers by name, and which of their stages are ideal."""

from pathlib import Path

import pytest
from tests.approval import approve, refuses

from bridgegen import drivers as ego
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.simulate import simulate_file
from bridgegen.jobs.search import run_search
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.jobs.search.settings import Settings
from bridgegen.openx.convert import roads_of
from bridgegen.openx.openscenario.from_owl import openscenario_from_owl
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.to_owl.scenario import individuals_from_openscenario
from bridgegen.scenario.language.reader import load


def test_stages_are_told_in_the_order_of_the_work() -> None:
    driver = ego.get("reference", ["control", "perception"])
    assert driver.ideal == {"perception", "control"}
    approve(driver.label)
    assert ego.split(" control,, perception ") == ("control", "perception")


def test_an_unknown_stage_is_refused_with_a_hint() -> None:
    with refuses(UnknownNameError, "percepton", "perception"):
        ego.get("reference", ["percepton"])


def test_a_driver_without_stages_refuses_them() -> None:
    with refuses(InputError, "control", "route-follower"):
        ego.get("route-follower", ["control"])


def test_a_run_keeps_them(tmp_path: Path) -> None:
    run = run_search(
        "pedestrian-behind-parked", algorithm="random", budget=4, ego="reference",
        ideal=["prediction", "perception"], keep=0, triage="none", out=tmp_path / "run",
    )  # fmt: skip
    assert set(run.settings.ideal) == {"perception", "prediction"}
    assert "--ideal perception,prediction" in run.settings.command(tmp_path)
    assert Settings.from_dict(run.settings.to_dict(), tmp_path) == run.settings


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scenario file, with its map, that says which stages are ideal."""
    scenario = load("lead-brakes")
    space = scenario.space()
    pipeline = Pipeline(
        scenario, space, PipelineOptions(ego="reference", ideal=["control", "perception"])
    )
    folder = tmp_path_factory.mktemp("written")
    return next(
        p for p in write_scenario(pipeline, space.row({}), folder, "a") if p.suffix == ".xosc"
    )


def test_a_file_says_them(written: Path) -> None:
    assert b'<Property name="ideal" value="perception,control"/>' in written.read_bytes()
    label = "reference (ideal perception,control)"
    assert simulate_file(written, metrics=["d_min"]).driver == label
    assert simulate_file(written, ideal=[], metrics=["d_min"]).driver == "reference"
    assert simulate_file(written, ego="route-follower", metrics=["d_min"]).driver == (
        "route-follower"
    )


def test_they_come_back_from_the_file(written: Path) -> None:
    scenario = read(written)
    individuals, _ = individuals_from_openscenario(scenario, roads_of(scenario, written), "a.xodr")
    assert openscenario_from_owl(individuals, "a.xodr").entities == scenario.entities


def test_a_file_with_an_unknown_stage_is_refused_by_line(written: Path) -> None:
    broken = written.with_name("broken.xosc")
    broken.write_bytes(written.read_bytes().replace(b"perception,control", b"thinking"))
    with refuses(InputError, "broken.xosc", "thinking"):
        simulate_file(broken)
