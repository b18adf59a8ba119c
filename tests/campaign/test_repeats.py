"""A search with a driver that does not repeat."""

import json
from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import InputError
from bridgegen.cli.terminal.search import verdict_lines
from bridgegen.drivers.compiled import compiled_driver
from bridgegen.drivers.noise import driver_seeds
from bridgegen.jobs import search as campaign

FLIPS = f"{Path(__file__).with_name('flips.py')}:FlipsBySeed"


def search(out, **kwargs):
    how = {"ego": FLIPS, "budget": 24, "triage": "none", "keep": 2, "repeats": 8, **kwargs}
    fixed = {"gap": 30.0, "speed_difference": 8.0}
    return campaign.run_search("cut-in", algorithm="random", fixed=fixed, out=out, **how)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return search(tmp_path_factory.mktemp("runs") / "once")


def test_findings_are_evaluated_again(run):
    again = run.triage.repeated
    assert again
    assert all(item.repeats == 8 and not item.lost for item in again)
    exported = {item.evaluation for item in run.exported()}
    assert exported <= {item.evaluation for item in again if item.failed and item.mode}
    assert any(not item.failed for item in again)  # some that came near to failing
    facts = json.loads((run.folder / "critical" / "0001.json").read_text("utf-8"))
    item = run.triage.of_repeats(facts["row"])
    low, high = facts["repeats"]["interval"]
    assert low <= item.fails / 8 <= high
    assert facts["repeats"]["fails"] == item.fails
    mean, low, high = run.triage.chance(run.modes[0])
    assert 0.0 < low < mean < high < 1.0
    lines = [line for line in verdict_lines(run, 0.0) if line.startswith("Repeats: ")]
    approve(lines[0])
    assert "fails in" in run.triage.doubts(next(i.evaluation for i in again if not i.agrees))


@pytest.mark.thorough
def test_counts_are_the_same_with_workers_and_after_a_resume(run, tmp_path):
    other = search(tmp_path / "other", workers=2)
    assert other.triage == run.triage
    assert campaign.resume(other.folder, ego=FLIPS).triage == run.triage


def test_without_repeats_nothing_is_said_of_them(tmp_path):
    run = search(tmp_path / "run", repeats=None, budget=8)
    text = (run.folder / "triage.json").read_text("utf-8")
    assert "repeat" not in text
    assert "repeats" not in json.dumps(run.settings.to_dict())


def test_a_driver_that_ships_is_not_evaluated_again(tmp_path):
    said = []
    run = search(
        tmp_path / "run", ego="route-follower", budget=8,
        callbacks=campaign.SearchCallbacks(warning=said.append),
    )  # fmt: skip
    assert not run.triage.repeated
    approve(next(text for text in said if "--repeats" in text), "route-follower")


def test_seeds_follow_from_the_row_and_the_repeat():
    keys = np.arange(1000, dtype=np.uint64)
    first, second = driver_seeds(keys), driver_seeds(keys, 1)
    assert first.dtype == np.int64
    assert 0 <= first.min() < first.max() < 2**32
    assert len({*first.tolist(), *second.tolist()}) == 2000
    assert (driver_seeds(keys[::-1], 1) == second[::-1]).all()
    with refuses(InputError, "seed"):
        compiled_driver(wants=("seed",))
