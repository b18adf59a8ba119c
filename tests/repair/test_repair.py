"""Repairs of drivers: settings and their files, the search for them, and the job."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import FileFormatError, InputError, UnknownNameError
from bridgegen.drivers import drivers
from bridgegen.drivers.driver_process import DriverProcess
from bridgegen.drivers.identity import digest_of, identity_of
from bridgegen.drivers.tunable import (
    Tunable,
    checked_tunable,
    read_settings,
    split_settings,
    values_of,
)
from bridgegen.engine.workers import CarriedDriver
from bridgegen.jobs.repair import repair
from bridgegen.jobs.repair.repair import repair_driver
from bridgegen.jobs.repair.tune import CHANGES, FAILS, PASSES, TIME, WAY, WORST, Bench, Rows
from bridgegen.jobs.search import Run
from bridgegen.jobs.search.scenarios import load
from bridgegen.jobs.suite.difference import Difference, RowChange

pytestmark = pytest.mark.thorough

DRIVERS = Path(__file__).with_name("drivers.py")
OWN = f"{DRIVERS}:BrakesTooLittle"
NUMBERS = (Tunable("headway", 0.5, 0.0, 2.0, "s"), Tunable("gain", 1.0, 0.0, 2.0))


# --- Settings ---


def test_what_is_declared_has_a_range_around_its_default():
    assert checked_tunable(None) == ()
    (found,) = checked_tunable({"headway": [1.5, 0.5, 3, "s"]})
    assert found == Tunable("headway", 1.5, 0.5, 3.0, "s")
    wrong = {"a": (1.0,), "b": (4.0, 0.0, 3.0, "m"), "c": (0.0, float("nan"), 1.0), "d": (1, 1, 1)}
    with refuses(InputError, "default=4") as caught:
        checked_tunable(wrong)
    assert len(caught.value.problems) == 4


def test_a_file_has_values_or_what_a_repair_writes(tmp_path):
    path = tmp_path / "patch.yaml"
    path.write_text("headway: {old: 1.5, new: 1.8, unit: s}\ngain: 2\n", "utf-8")
    assert read_settings(path) == (("headway", 1.8), ("gain", 2.0))
    assert values_of(NUMBERS, (("headway", 1.8),), "it") == {"headway": 1.8, "gain": 1.0}
    with refuses(InputError, "2 s", "3 s"):
        values_of(NUMBERS, (("headway", 3.0),), "it")
    with refuses(UnknownNameError, "headwy"):
        values_of(NUMBERS, (("headwy", 3.0),), "it")
    path.write_text("headway: {old: 1.5}\n", "utf-8")
    with refuses(FileFormatError, "headway", "line 1"):
        read_settings(path)


def test_settings_are_part_of_a_driver_and_travel_with_it(tmp_path):
    path = tmp_path / "patch.yaml"
    path.write_text("limit: 3.0", "utf-8")
    name = f"{OWN}@{path}"
    assert split_settings(name) == (OWN, path)
    assert split_settings("/home/me@work/my.py:Driver")[1] is None
    driver = drivers.get(name)
    assert (driver.spec, driver.settings) == (OWN, (("limit", 3.0),))
    before = digest_of(name)
    assert before not in ("", digest_of(OWN))
    assert identity_of(name, before).name == "BrakesTooLittle@patch.yaml"
    carried = CarriedDriver.of(name)
    assert carried.here() == name
    path.write_text("limit: 4.0", "utf-8")
    assert digest_of(name) != before
    assert drivers.get(carried.here()).settings == driver.settings
    with refuses(InputError, "careful"):
        drivers.get(f"careful@{path}")


def test_settings_reach_the_process_that_drives_and_are_checked_there():
    process = DriverProcess(OWN, settings=(("limit", 3.0),))
    process.start()
    assert [item.name for item in process.traits.tunable] == ["limit", "from_"]
    process.settings = (("limit", 9.0),)
    with refuses(InputError, "limit", "9 m/s²"):
        process.start()
    process.close()


# --- The search for them, with an invented driver ---


class Invented(Bench):
    """Row x is mended from a headway of x on; row -x is broken beyond x; gain is jerk."""

    knife_edge = False

    def drive(self, rows, values):
        headway, gain = values
        found = np.zeros((len(rows.X), 6))
        need = np.array([x[0] for x in rows.X])
        is_guard = need < 0.0
        found[:, PASSES] = np.where(is_guard, headway <= -need, headway >= need)
        found[:, FAILS] = 1.0 - found[:, PASSES]
        found[:, WORST] = np.clip(need - headway, 0.0, 1.0)
        found[:, [CHANGES, TIME, WAY]] = [gain, 1.0, 1.0]
        return found

    def robust(self, broken, values):
        return np.full(len(broken.X), not self.knife_edge)


def made_bench(drawn):
    made = Invented((None,), NUMBERS, (0.5, 1.0))
    made.draw(Rows.of([np.array(drawn)[:, np.newaxis]]))
    made.guard(made.drawn_that(PASSES, 4))
    return made


@pytest.fixture
def bench():
    return made_bench([-1.5] * 4)


def test_the_least_change_mends_and_numbers_that_mend_nothing_stay(bench):
    bench.failing += Rows.of([np.array([[0.8], [1.0]])])
    best = bench.tune((0.5, 1.0), 80, [1])
    assert best.is_feasible
    assert best.mends.all()
    assert 1.0 <= best.values[0] <= 1.2
    assert best.values[1] == 1.0
    assert not bench.never.any()
    again = made_bench([-1.5] * 4)
    again.failing += Rows.of([np.array([[0.8], [1.0]])])
    assert again.tune((0.5, 1.0), 80, [1]).values == best.values


def test_what_passes_is_never_broken_and_what_nothing_mends_is_known(bench):
    bench.failing += Rows.of([np.array([[1.0], [1.8], [5.0]])])
    best = bench.tune((0.5, 1.0), 80, [1])
    assert best.is_feasible
    assert best.mends.tolist() == [True, False, False]  # 1.8 s would break the guards
    assert bench.never.tolist() == [False, False, True]


def test_without_a_better_setting_it_stays_as_it_is(bench):
    bench.failing += Rows.of([np.array([[1.8]])])
    assert bench.tune((0.5, 1.0), 40, [1]).values == (0.5, 1.0)
    assert not bench.trial((0.5, 1.06)).is_feasible
    assert bench.trial((0.5, 1.04)).is_feasible


def test_what_settings_break_among_many_rows_becomes_a_guard():
    bench = made_bench([-1.6] * 300 + [-1.3])  # the last is no guard yet
    bench.failing += Rows.of([np.array([[0.9], [1.4]])])
    best = bench.tune((0.5, 1.0), 80, [1])
    assert best.mends.tolist() == [True, False]
    assert 0.9 <= best.values[0] <= 1.3
    assert -1.3 in {x[0] for x in bench.guards.X}
    assert bench.manners[best.values] == pytest.approx((1.0, 1.0))


def test_a_knife_edge_may_be_broken_where_ten_are_fixed_for_it():
    for fails, mends in [(12, True), (9, False)]:
        bench = made_bench([-1.5] * 300 + [-1.1] + [1.2] * fails)
        bench.knife_edge = True
        bench.failing += Rows.of([np.array([[1.2]])])
        assert bench.tune((0.5, 1.0), 80, [1]).mends.tolist() == [mends]


@pytest.mark.parametrize(
    ("fixed", "broken", "robust", "both_fail", "said"),
    [
        (12, 1, 0, 3, ""),
        (0, 0, 0, 0, ""),
        (12, 1, 1, 3, "1 of them robustly"),
        (1, 1, 0, 0, "not 10 to 1"),
        (0, 0, 0, 7, "fix none"),
    ],
)
def test_a_patch_needs_the_support_of_held_out_variations(fixed, broken, robust, both_fail, said):
    counts = {"fixed": fixed, "broken": broken, "robust": robust, "both fail": both_fail}
    why = repair._refused(counts, 61)
    assert (said in why) if said else why == ""


def test_the_broken_held_out_rows_are_found_again(monkeypatch):
    def job(name):
        return SimpleNamespace(entry=SimpleNamespace(name=name))

    made = object.__new__(repair._Repairer)
    made.jobs, pipelines = [job("a"), job("b")], (10.0, 20.0)
    made.bench = SimpleNamespace(pipelines=pipelines)
    monkeypatch.setattr(repair, "replace", lambda job, seed: seed)
    monkeypatch.setattr(repair, "rows_of_job", lambda k, x: k + x + np.arange(4.0)[:, np.newaxis])
    rows = [RowChange("b", 3, "broken", 0, 0), RowChange("a", 1, "fixed", 0, 0)]
    rows.append(RowChange("a", 2, "broken", 0, 0))
    found = made._broken(SimpleNamespace(difference=Difference("x", "y", tuple(rows))), 100)
    assert [x.tolist() for x in found.X] == [[123.0], [112.0]]
    assert found.scene.tolist() == [1, 0]


# --- The job ---


SMALL = {"budget": 20, "tries": 10, "rounds": 1, "samples": 40, "workers": 1}


@pytest.fixture(scope="module")
def repaired(tmp_path_factory):
    return repair_driver("cut-in", egos=OWN, **SMALL, out=tmp_path_factory.mktemp("repair") / "a")


def test_a_driver_that_brakes_too_little_is_repaired(repaired):
    figures = repaired.figures
    assert figures["mended"] > 4
    assert figures["structure"] > 5  # cut-ins that leave no room
    assert figures["broken"] == 0
    assert figures["fixed"] > 0
    assert max(figures["jerk"], figures["travel_time"]) <= 1.05
    record = repaired.to_json()
    new = {name: one["new"] for name, one in record["settings"].items()}
    (_, file) = split_settings(repaired.repaired)
    tunable = checked_tunable({"limit": (1.5, 1.0, 8.0), "from_": (1.0, 0.5, 1.4)})
    assert values_of(tunable, read_settings(file), "it") == new
    left = sum(figures[name] for name in ("late", "structure", "traded"))
    assert figures["failures"] == figures["mended"] + left
    names = set(load("cut-in").space().names)
    assert all({*one["values"]} == names for one in record["left"])
    page = (repaired.folder / "repair.html").read_text("utf-8")
    assert "diff/1/suite.html" in page
    assert (repaired.folder / "diff/1/suite.html").exists()


def test_called_again_it_gives_the_same(repaired):
    again = repair_driver("cut-in", egos=OWN, **SMALL, out=repaired.folder)
    assert again.to_json() == repaired.to_json()
    assert replace(again, held_out=None) == replace(repaired, held_out=None)


@pytest.mark.parametrize(
    ("ego", "named"), [("Fixed", "tunable"), ("Misdeclared", "default=9"), ("", "reference")]
)
def test_a_driver_without_tunable_numbers_is_refused(ego, named, tmp_path):
    with refuses(InputError, named):
        repair_driver("cut-in", egos=f"{DRIVERS}:{ego}" if ego else "reference", out=tmp_path / "a")
    assert not (tmp_path / "a").exists()


def test_where_nothing_fails_there_is_nothing_to_repair(repaired, tmp_path, monkeypatch):
    def passes(self, rows, values):
        return np.eye(6)[np.full(len(rows.X), PASSES)]

    run = Run(repaired.folder / "rounds/0/cut-in")
    monkeypatch.setattr(repair._Repairer, "_search", lambda self, job, number: run)
    monkeypatch.setattr(Bench, "drive", passes)
    with refuses(InputError, "no failure", "cut-in"):
        repair_driver("cut-in", egos=OWN, out=tmp_path / "a")
