"""What scenarios and drivers are called."""

import os
from pathlib import Path

import pytest

from bridgegen.jobs.dashboard.project import read_project
from bridgegen.jobs.dashboard.results import driver_of, place_of, scenario_name
from bridgegen.jobs.suite.results import EntryResult, Header, RowResult

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


HIT = RowResult(critical=True, harm=0.5, severity=0.1, conflict="contact", partner="bv")


def write_suite(folder: Path, time: float, ego: str, digest: str, **settings: str) -> None:
    """Write the results of a suite with one entry."""
    folder.mkdir(parents=True)
    found = EntryResult(
        entry="cut-in", ego=ego, digest="0", driver_digest=digest, scenario="cut-in", rows=[HIT]
    )
    lines = [Header(settings={"version": "0.9", **settings}), found]
    path = folder / "results.jsonl"
    path.write_text("".join(f"{line.model_dump_json()}\n" for line in lines), "utf-8")
    os.utime(path, (time, time))


def test_a_driver_is_one_whatever_path_names_it(tmp_path):
    write_suite(tmp_path / "a", 1.0, "myplan.py:V2", "d1")
    write_suite(tmp_path / "b", 2.0, "../jb/myplan.py:V2", "d1")
    found = read_project(tmp_path)
    assert {one.driver for one in found.results} == {found.results[0].driver}
    assert found.results[0].driver.label == "V2"
    assert {failure.key.driver for one in found.results for failure in one.failures} == {
        "myplan.py:V2"
    }
    assert [suite.egos for suite in found.suites] == [("V2",), ("V2",)]


def test_another_content_under_the_same_name_is_not_merged(tmp_path):
    for k, digest in enumerate(("d1", "d2", "d1")):
        write_suite(tmp_path / f"{k}", float(k), "myplan.py:V2", digest)
    labels = [one.driver.label for one in read_project(tmp_path).results]
    assert labels == ["V2", "V2 (changed)", "V2"]


def test_results_without_a_digest_are_of_the_path_that_was_typed(tmp_path):
    write_suite(tmp_path / "a", 1.0, "myplan.py:V2", "")
    write_suite(tmp_path / "b", 2.0, "../jb/myplan.py:V2", "")
    labels = {one.driver.label for one in read_project(tmp_path).results}
    assert labels == {"myplan.py:V2", "../jb/myplan.py:V2"}


def test_classes_of_one_name_in_other_files_keep_their_files(tmp_path):
    write_suite(tmp_path / "a", 1.0, "mine.py:Driver", "d1")
    write_suite(tmp_path / "b", 2.0, "theirs.py:Driver", "d2")
    labels = {one.driver.label for one in read_project(tmp_path).results}
    assert labels == {"mine.py:Driver", "theirs.py:Driver"}


def test_a_user_names_a_driver(tmp_path):
    write_suite(tmp_path / "a", 1.0, "mine.py:Driver", "d1", driver_name="planner-7")
    write_suite(tmp_path / "b", 2.0, "mine.py:Driver", "d1")
    found = {one.driver.label: one.driver for one in read_project(tmp_path).results}
    assert set(found) == {"planner-7", "Driver"}
    assert (found["planner-7"].name, found["planner-7"].version) == ("planner", "7")
