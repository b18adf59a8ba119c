import re
from importlib import resources
from pathlib import Path

import pytest
from tests.approval import approve
from typer.testing import CliRunner

from bridgegen.cli import app
from bridgegen.jobs.search import driver_contract
from bridgegen.jobs.search.driver_contract import check_driver
from bridgegen.testing import DriverContract

pytestmark = pytest.mark.thorough

DRIVERS = Path(__file__).parents[1] / "ego" / "drivers.py"
EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"


CROSSROADS, CUT_IN = "crossroads-s1.yaml", "cut-in.yaml"


@pytest.fixture(scope="module")
def short_scenarios(tmp_path_factory):
    """The folder of two scenarios that end after 8 s."""
    folder = tmp_path_factory.mktemp("scenarios")
    for name in (CROSSROADS, CUT_IN):
        text = resources.files("bridgegen.scenario.catalogue").joinpath(name).read_text("utf-8")
        short, n = re.subn(r"^duration: [\d.]+", "duration: 8.0", text, flags=re.M)
        assert n == 1
        (folder / name).write_text(short, "utf-8")
    return folder


@pytest.fixture(autouse=True)
def a_short_batch(short_scenarios, monkeypatch):
    """A driver's speed is measured for a tenth of a second."""
    monkeypatch.chdir(short_scenarios)
    monkeypatch.setattr(driver_contract, "SECONDS", 0.1)


def checked(name, file=DRIVERS, scenario=CROSSROADS):
    return list(check_driver(f"{file}:{name}", [scenario], time_limit=0.5))


def broken(name, file=DRIVERS):
    return {check.rule: check.problem for check in checked(name, file) if check.problem}


def in_short(checks):
    return {check.rule: check.figure for check in checks if check.scenario == "in short"}


@pytest.mark.parametrize("name", ["LooksAhead", "PlansAndControls"])
def test_a_good_driver_keeps_everything(name):
    checks = checked(name)
    assert not any(check.problem for check in checks)
    assert in_short(checks) == {
        "drives": "yes", "deterministic": "yes", "free of cross-talk": "yes"
    }  # fmt: skip
    asked = "at every instant" if name == "LooksAhead" else "every 0.2 s (4 time steps of 0.05 s)"
    answers = "controls" if name == "LooksAhead" else "controls and trajectories"
    approve(checks[0].figure, asked, answers)


def test_a_driver_is_timed_call_by_call_and_in_a_small_batch_if_it_is_slow(monkeypatch):
    monkeypatch.setattr(driver_contract, "SECONDS", 0.0)
    figures = {check.rule: check.figure for check in checked("Cruises")}
    approve(figures["speed"], "16")
    times = re.fullmatch(
        r"p50 (\S+) ms, p99 (\S+) ms with 1 scenario; p50 (\S+) ms, p99 (\S+) ms with 16",
        figures["time per call"],
    )
    median, most, *_ = map(float, times.groups())
    assert 0.0 < median <= most < 500.0


def test_a_compiled_driver_keeps_everything_or_is_found_out():
    compiled = DRIVERS.with_name("compiled_drivers.py")
    checks = checked("looks_ahead", compiled)
    assert not any(check.problem for check in checks)
    approve(checks[0].figure)
    found = broken("nan_fast", compiled)
    assert list(found) == ["every row is driven to its end"]
    approve(found["every row is driven to its end"], "acceleration", "nan")


def test_a_driver_that_mixes_its_scenarios_is_found_out():
    checks = checked("Mixes")
    found = {check.rule: check.problem for check in checks if check.problem}
    assert {"a row alone moves as it does among others", "what it drove before is forgotten"} <= {
        *found
    }
    assert in_short(checks) == {
        "drives": "yes", "deterministic": "yes", "free of cross-talk": "no, see crossroads-s1.yaml"
    }  # fmt: skip
    assert re.match(
        r"row \d+ differs first at 0 s: acceleration \[m/s²\] of 'ego' = \S+, and then ",
        found["a row alone moves as it does among others"],
    )


@pytest.mark.parametrize("name", ["Remembers", "ReadsTheClock"])
def test_a_driver_that_is_not_deterministic_is_found_out(name):
    checks = checked(name)
    found = {check.rule for check in checks if check.problem}
    assert "the same row again gives the same motion" in found
    assert in_short(checks)["deterministic"] == "no, see crossroads-s1.yaml"
    assert in_short(checks)["free of cross-talk"] == "not known"


def test_verdicts_that_change_are_counted(monkeypatch):
    monkeypatch.setattr(driver_contract, "JUDGED", 12)
    for name, said in (("Flips", "does not repeat"), ("FlipsBySeed", "by its seed")):
        checks = checked(name, Path(__file__).with_name("flips.py"), CUT_IN)
        figure = in_short(checks)["verdicts"]
        assert re.match(rf"{said}: \d+ of 12 scenarios change their verdict; ", figure), figure
        assert "--repeats 10" in figure
        assert any(check.problem for check in checks) == (name == "Flips")


def test_a_driver_that_is_another_one_in_another_process_is_found_out():
    assert {*broken("IsBornByChance")} == {"so it does in a new process"}


def test_a_driver_that_rounds_by_the_batch_is_told_what_to_do():
    found = broken("RoundsByBatch")
    problem = found["a row alone moves as it does among others"]
    assert "bridgegen.drivers.batches.FixedBatch" in problem
    before, after = (
        words.split()[0].rstrip(";") for words in problem.split(" = ")[1].split("then ")
    )
    assert before != after  # enough digits are shown
    assert "FixedBatch" not in broken("Mixes")["a row alone moves as it does among others"]


class TestGood(DriverContract):
    time_limit = 0.5

    @pytest.fixture(
        autouse=True,
        params=[
            (EXAMPLES / "my_network.py:MyNetwork", CROSSROADS),
            (EXAMPLES / "my_torch_network.py:MyTorchNetwork", CROSSROADS),
            (DRIVERS.with_name("network_drivers.py:Policy"), CROSSROADS),
            (EXAMPLES / "my_planner.py:MyPlanner", CUT_IN),
            (EXAMPLES / "my_driver.py:MyDriver", CUT_IN),
        ],
        ids=lambda given: given[0].name.partition(":")[2],
    )
    def each(self, request, short_scenarios):
        driver, scenario = request.param
        self.driver, self.scenarios = str(driver), [str(short_scenarios / scenario)]


def test_a_driver_that_fails_is_found_out_and_when():
    checks = checked("NaNLater")
    assert [check.rule for check in checks if check.problem] == ["every row is driven to its end"]
    problem = next(check.problem for check in checks if check.problem)
    assert re.fullmatch(
        r"\d+ of 16 rows failed, the first: row \d+ at 3 s: the driver answered what is no "
        r"control: acceleration must be finite, got nan",
        problem,
    )
    assert in_short(checks) == {
        "drives": "no, see crossroads-s1.yaml", "deterministic": "yes", "free of cross-talk": "yes"
    }  # fmt: skip


def test_a_driver_that_drives_nothing_is_not_tried_further():
    checks = checked("PlansThePast")
    approve(checks[1].problem, "row 0", "16", "-2 s")
    assert in_short(checks)["deterministic"] == "not known"
    assert len(checks) == 5


def test_the_command_says_it_and_ends_with_a_status():
    run = CliRunner().invoke
    good = run(app, ["validate", f"{DRIVERS}:Cruises", "--scenario", CROSSROADS])
    assert good.exit_code == 0
    approve(good.output, "matter")
    bad = run(app, ["validate", f"{DRIVERS}:Mixes", "--scenario", CROSSROADS, "--json"])
    assert bad.exit_code == 1
    assert '"problem": "row ' in bad.output
