"""A driver's file is where the worker is: itself, or a copy of what it was."""

from pathlib import Path

import pytest

from bridgegen.engine.workers import CarriedDriver


@pytest.fixture
def driver(tmp_path, monkeypatch) -> Path:
    monkeypatch.setenv("TMPDIR", str(tmp_path / "temporary"))
    monkeypatch.setattr("tempfile.tempdir", None)
    (tmp_path / "temporary").mkdir()
    path = tmp_path / "mine.py"
    path.write_text("class Mine: ...", "utf-8")
    return path


def test_it_stays_where_it_is_the_same(driver):
    assert CarriedDriver.of(f"{driver}:Mine").here() == f"{driver}:Mine"


@pytest.mark.parametrize("how", ["missing", "changed", "made a folder"])
def test_a_copy_takes_its_place(driver, how):
    carried = CarriedDriver.of(f"{driver}:Mine")
    driver.unlink()
    if how == "changed":
        driver.write_text("class Mine: 'another'", "utf-8")
    elif how == "made a folder":
        driver.mkdir()
    path, _, name = carried.here().rpartition(":")
    assert name == "Mine"
    assert Path(path) != driver
    assert Path(path).name == "mine.py"
    assert Path(path).read_text("utf-8") == "class Mine: ..."
    assert carried.here() == f"{path}:Mine"  # again, the same


def test_a_unit_is_carried_whole(driver):
    unit = driver.with_suffix(".fmu")
    unit.write_bytes(b"\x00\x01")
    carried = CarriedDriver.of(str(unit))
    unit.unlink()
    assert carried.here() != str(unit)
    assert Path(carried.here()).read_bytes() == b"\x00\x01"


@pytest.mark.parametrize("name", ["reference", "package.module:Class", "nowhere.py:Class"])
def test_what_has_no_file_is_named_as_it_was(name):
    assert CarriedDriver.of(name).here() == name


@pytest.mark.parametrize("name", ["exec:run {}:Mine", "exec:run x.fmu", "unix:{}", "connect:a:5"])
def test_a_driver_in_another_process_carries_no_file(driver, name):
    carried = CarriedDriver.of(name.format(driver))
    assert carried.data is None
    assert carried.here() == name.format(driver)
