"""What scenarios and drivers are called."""

from pathlib import Path

import pytest

from bridgegen.jobs.dashboard.results import driver_of, place_of, scenario_name

PROJECT = Path("/srv/project")


@pytest.mark.parametrize(
    ("text", "name", "version"),
    [
        ("/srv/project/drivers/stack-1.2.py:Stack", "drivers/stack.py:Stack", "1.2"),
        ("/srv/project/stack_v3.py:Stack", "stack.py:Stack", "3"),
        ("/srv/project/stack@7/driver.py:Stack", "stack/driver.py:Stack", "7"),
        ("/srv/project/stack-2_1.fmu", "stack.fmu", "2_1"),
        ("/srv/stack.py:Stack2", "../stack.py:Stack2", ""),
        ("connect:localhost:5555", "connect:localhost:5555", ""),
        ("exec:./stack-1.2 --net a.py:B", "exec:./stack-1.2 --net a.py:B", ""),
        ("reference", "reference", "BridgeGen 0.9"),
        ("un-r157", "un-r157", "BridgeGen 0.9"),  # r157 is no version
    ],
)
def test_a_version_ends_the_name(text, name, version):
    found = driver_of(text, PROJECT, "0.9")
    assert (found.name, found.version) == (name, version)


def test_two_versions_of_a_driver_are_one_driver():
    one, two = (driver_of(f"/srv/project/stack-{v}.py:S", PROJECT, "") for v in ("1.2", "1.10"))
    assert one.name == two.name
    assert one.label != two.label


def test_names_do_not_depend_on_where_the_project_is(tmp_path):
    other = tmp_path / "elsewhere"
    other.mkdir()
    (other / "scenarios").mkdir()
    (other / "scenarios" / "mine.yaml").write_text("", "utf-8")
    here = scenario_name("/srv/project/scenarios/mine.yaml", PROJECT)
    assert here == scenario_name("scenarios/mine.yaml", other) == "scenarios/mine.yaml"


def test_a_distribution_names_its_scenario():
    found = scenario_name("a/cut.xosc", PROJECT, "/srv/project/a/ranges.xosc")
    assert found == "a/ranges.xosc"


def test_a_name_of_the_catalogue_stays():
    assert scenario_name("r157/cut-in", PROJECT) == "r157/cut-in"


def test_no_absolute_path_is_shown():
    assert place_of("/home/somebody/secret/files/mine.yaml", PROJECT) == "files/mine.yaml"
