"""A search ends early if the user's driver fails in every scenario."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import approve, refuses
from typer.testing import CliRunner

from bridgegen.base.errors import InputError
from bridgegen.cli import app
from bridgegen.jobs import search as campaign
from bridgegen.jobs.search.searcher import LEAST, FailingDriver
from bridgegen.results.store import Store

DRIVERS = Path(__file__).parents[1] / "ego" / "drivers.py"
COMPILED = DRIVERS.with_name("compiled_drivers.py")


def search(folder, ego, budget):
    return campaign.run_search(
        "crossroads-s1", algorithm="random", budget=budget, ego=ego, out=folder, keep=1,
        settings={"population": 12}, deliver=False,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("Raises", "the driver raised an error: ValueError: no idea (drivers.py:"),
        ("AnswersNaN", "acceleration must be finite, got nan"),
        ("AnswersNothing", "act must return a Control, (acceleration, curvature) or a Trajectory"),
        ("AnswersOneNumber", "acceleration must have the shape (2,), got ()"),
        ("AnswersOneForAll", "acceleration must have the shape (2,), got (1,)"),
        ("AnswersAColumn", "acceleration must have the shape (2,), got (2, 1)"),
    ],
)
def test_a_driver_that_fails_in_every_scenario_ends_the_search(tmp_path, name, reason):
    ego, folder = f"{DRIVERS}:{name}", tmp_path / "run"
    with pytest.raises(InputError) as first:
        search(folder, ego, 1000)
    assert reason in str(first.value)
    approve(str(first.value), "bridgegen validate", ego)
    with Store.open(folder) as store:
        assert LEAST <= len(store) < 1000
        assert f"all {len(store)} scenarios" in str(first.value)
        assert {20, 23} >= set(store.read().status.tolist())
        kept = len(store)
    with pytest.raises(InputError) as again:
        campaign.resume(folder, ego=ego)
    assert str(again.value) == str(first.value)
    with Store.open(folder) as store:
        assert len(store) == kept


def test_a_driver_whose_process_ends_every_time_and_a_small_budget(tmp_path):
    with refuses(InputError):
        search(tmp_path / "run", f"{DRIVERS}:Dies", 2)
    with pytest.raises(InputError, match="all 2 scenarios"):
        campaign.resume(tmp_path / "run", ego=f"{DRIVERS}:Dies")


def test_the_command_ends_with_status_2(tmp_path):
    ego = f"{COMPILED}:nan"
    command = ["search", "crossroads-s1", "--ego", ego, "--out", str(tmp_path / "run")]
    result = CliRunner().invoke(app, [*command, "--algorithm", "random", "--budget", "500"])
    assert isinstance(result.exception, InputError)  # `bridgegen.cli.main` makes status 2 of it
    approve(str(result.exception), "acceleration")


@given(st.lists(st.sampled_from([0, 2, 20, 21, 22, 23]), max_size=60), st.integers(1, 30),
       st.integers(1, 40))  # fmt: skip
def test_it_is_refused_as_soon_as_enough_have_failed_and_none_was_driven(statuses, budget, size):
    evaluated = []
    watch, ended = FailingDriver(SimpleNamespace(rows=lambda: ()), "a.py:B", budget), None
    watch._refuse = lambda: None  # it would read the store
    for at in range(0, len(statuses), size):
        batch = statuses[at : at + size]
        evaluated += batch
        watch.after_batch(
            SimpleNamespace(replayed=False, result=SimpleNamespace(status=np.array(batch)))
        )
        if watch.fails:
            ended = len(evaluated)
            break
    driven = [status for status in evaluated if status != 2]
    assert (ended is not None) == (len(driven) >= min(20, budget) and 0 not in driven)
