from pathlib import Path

import pytest
from typer.testing import CliRunner

from bridgegen.campaign import driver_contract
from bridgegen.campaign.driver_contract import check_driver
from bridgegen.cli import app

DRIVERS = Path(__file__).parents[1] / "ego" / "drivers.py"
NETWORKS = DRIVERS.with_name("network_drivers.py")
EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"


def broken(name, file=DRIVERS):
    checks = list(check_driver(f"{file}:{name}", ["crossroads-s1"], time_limit=0.5))
    found = {check.rule: check.problem for check in checks if check.problem}
    timed = "every row is driven to its end" not in found
    assert [check.rule for check in checks].count("speed") == timed
    assert len(checks) == 5 + timed
    return found


@pytest.mark.parametrize("name", ["Cruises", "LooksAhead"])
def test_a_good_driver_keeps_everything(name):
    assert broken(name) == {}


def test_a_slow_driver_is_timed_in_a_small_batch(monkeypatch):
    monkeypatch.setattr(driver_contract, "SECONDS", 0.0)
    *_, speed = driver_contract.check_driver(f"{DRIVERS}:Cruises", ["cut-in"])
    assert speed.rule == "speed"
    assert speed.figure.endswith("scenarios/s in a batch of 16")


def test_a_compiled_driver_keeps_everything_or_is_found_out():
    compiled = DRIVERS.with_name("compiled_drivers.py")
    assert broken("looks_ahead", compiled) == {}
    found = broken("nan_fast", compiled)
    assert list(found) == ["every row is driven to its end"]
    assert "acceleration must be finite, got nan" in found["every row is driven to its end"]


def test_a_driver_that_mixes_its_scenarios_is_found_out():
    found = broken("Mixes")
    assert {"a row alone moves as it does among others", "what it drove before is forgotten"} <= {
        *found
    }
    assert "and then" in next(iter(found.values()))


def test_a_driver_that_remembers_is_found_out():
    assert "the same row again gives the same motion" in broken("Remembers")


def test_a_driver_that_rounds_by_the_batch_is_told_what_to_do():
    found = broken("RoundsByBatch")
    problem = found["a row alone moves as it does among others"]
    assert "bridgegen.ego.batches.FixedBatch" in problem
    before, after = (
        words.split()[0].rstrip(";") for words in problem.split(" = ")[1].split("then ")
    )
    assert before != after  # enough digits are shown
    assert "FixedBatch" not in broken("Mixes")["a row alone moves as it does among others"]


@pytest.mark.parametrize(
    ("file", "name"),
    [
        (EXAMPLES / "my_network.py", "MyNetwork"),
        (EXAMPLES / "my_torch_network.py", "MyTorchNetwork"),
        (NETWORKS, "Policy"),
    ],
)
def test_a_network_in_a_fixed_batch_keeps_everything(file, name):
    assert broken(name, file) == {}


def test_a_driver_that_fails_is_found_out():
    found = broken("NaNFast")
    assert list(found) == ["every row is driven to its end"]
    assert "acceleration must be finite, got nan" in found["every row is driven to its end"]


def test_the_command_says_it_and_ends_with_a_status():
    run = CliRunner().invoke
    good = run(app, ["check-driver", f"{DRIVERS}:Cruises", "--scenario", "crossroads-s1"])
    assert good.exit_code == 0
    assert "ok  the order of the rows does not matter" in good.output
    bad = run(app, ["check-driver", f"{DRIVERS}:Mixes", "--scenario", "crossroads-s1", "--json"])
    assert bad.exit_code == 1
    assert '"problem": "row ' in bad.output
