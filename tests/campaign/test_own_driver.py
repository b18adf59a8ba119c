"""A search with a driver of the user's own, from the command line to the folder."""

from pathlib import Path

import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import InputError, UnsupportedError
from bridgegen.engine.simulate import simulate_file
from bridgegen.jobs import search as campaign
from bridgegen.results.store import Store

DRIVERS = Path(__file__).parents[1] / "ego" / "drivers.py"
COMPILED = DRIVERS.with_name("compiled_drivers.py")


def search(tmp_path, name, budget=30, file=DRIVERS, triage="none", **kwargs):
    ego = f"{file}:{name}"
    out = tmp_path / name
    return campaign.run_search(
        "crossroads-s1",
        algorithm="random",
        budget=budget,
        ego=ego,
        triage=triage,
        out=out,
        keep=2,
        **kwargs,
    )


@pytest.mark.thorough
def test_a_search_outlives_its_driver(tmp_path):
    run = search(tmp_path, "FailsFast", triage="short")
    assert 0 < run.summary.failed < run.summary.evaluations == 30
    (reason, count) = next(iter(run.failures.items()))
    approve(reason, "ValueError", "drivers.py")
    assert count == run.summary.failed
    with Store.open(run.folder) as store:
        assert len(store.failures()) == count


@pytest.mark.parametrize(("file", "name"), [(DRIVERS, "Cruises"), (COMPILED, "cruises")])
def test_what_a_folder_or_file_names_is_not_imported(tmp_path, file, name):
    run = search(tmp_path, name, file=file)
    ego = run.settings.ego
    with pytest.raises(InputError, match=f"--ego {ego}"):
        campaign.resume(run.folder)
    with refuses(InputError, name, "reference"):
        campaign.resume(run.folder, ego="reference")
    assert campaign.resume(run.folder, ego=ego, deliver=False).summary == run.summary
    assert run.scenarios
    with pytest.raises(UnsupportedError, match=f"--ego {ego}"):
        simulate_file(run.scenarios[0])
    again = simulate_file(run.scenarios[0], ego=ego)
    kept = run.frame().query("critical").d_min
    assert again.metrics["d_min"] in kept.to_list()


@pytest.mark.parametrize(
    ("file", "name", "message"),
    [
        (DRIVERS, "CannotBeMade", "OSError"),
        (COMPILED, "misspelt", "curvatur"),
    ],
)
def test_a_driver_that_cannot_be_made_is_told_before_the_search(tmp_path, file, name, message):
    with refuses(InputError, message):
        search(tmp_path, name, file=file)
    assert not (tmp_path / name).exists()


def test_a_time_limit_is_for_drivers_of_ones_own(tmp_path):
    with pytest.raises(InputError, match="time limit"):
        campaign.run_search(
            "crossroads-s1", ego="reference", time_limit=1.0, triage="short", out=tmp_path / "r"
        )
    with pytest.raises(InputError, match="time limit"):
        search(tmp_path, "Cruises", time_limit=0.0)
