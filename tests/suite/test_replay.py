"""One variation of a suite again: its values and its result to the bit, and its scenario."""

import json
import shlex
import sys

import pytest
from tests.approval import approve, refuses
from tests.campaign.braking import deterministic, value_sets, write_pair

from bridgegen.base.errors import InputError, StorageError, UnknownNameError
from bridgegen.engine.simulate import simulate_file
from bridgegen.jobs.suite.entries import find_entries
from bridgegen.jobs.suite.page import FILE as PAGE
from bridgegen.jobs.suite.page import write_replay_page
from bridgegen.jobs.suite.replay import replay, replay_command
from bridgegen.jobs.suite.suite import FILE, evaluate_suite, read_suite
from bridgegen.openx.openscenario.parameters import numbers
from bridgegen.openx.openscenario.read import read

SETS = value_sets(
    {"EgoSpeed": 8.123456789012345, "Gap": 40}, {"EgoSpeed": 14 + 1 / 3, "Gap": 15.000000000000002}
)
"""Values that six digits do not tell."""


@pytest.fixture(scope="module")
def suite(tmp_path_factory):
    """A suite of a file with a distribution and of a logical scenario, with two drivers."""
    place = tmp_path_factory.mktemp("suite")
    _, ranges = write_pair(place / "files", SETS)
    return evaluate_suite(
        [ranges, "cut-in"], egos=["route-follower", "reference"], samples=12, seed=3,
        criteria=["R-1: always(ego.v < 13 m/s)"], workers=1,
        out=place / "out",
    )  # fmt: skip


@pytest.mark.parametrize("ego", ["route-follower", "reference"])
@pytest.mark.parametrize(("entry", "row"), [("ranges", 1), ("cut-in", 7)])
def test_a_variation_is_itself_again_and_so_is_its_file(suite, tmp_path, entry, row, ego):
    made = replay(suite.folder, entry, row + 1, ego=ego, out=tmp_path)
    (recorded,) = [one for one in suite.results if (one.entry, one.ego) == (entry, ego)]
    assert (made.is_same, made.is_same_exported) == (True, True)
    assert made.result.rows == [recorded.rows[row]]
    values = dict(zip(recorded.parameters, recorded.rows[row].x, strict=True))
    declared = numbers(read(made.files[-1]))
    named = {"EgoSpeed", "Gap"} if entry == "ranges" else {"ego_speed", "gap"}
    assert {name: declared[name] for name in named} == {name: values[name] for name in named}
    again = simulate_file(made.files[-1]).metrics  # by another path through the code
    assert again["severity"] == recorded.rows[row].severity
    assert again["harm"] == recorded.rows[row].harm


def test_value_sets_are_called_by_their_number(suite):
    (one,) = [one for one in suite.results if (one.entry, one.ego) == ("ranges", "reference")]
    assert one.parameters == ["value set", "EgoSpeed", "Gap"]
    assert [row.x for row in one.rows] == [
        ["1 of 2", 8.123456789012345, 40.0], ["2 of 2", 14 + 1 / 3, 15.000000000000002],
    ]  # fmt: skip


def test_the_command_runs_it_again(suite, tmp_path, cli):
    result = next(one for one in suite.results if one.entry == "cut-in" and one.ego == "reference")
    words = shlex.split(replay_command(suite.folder, result, 4))
    code, out, _ = cli(*words[1:], "--out", tmp_path, "--json")
    facts = json.loads(out)
    assert (code, facts["same"], facts["exported_same"]) == (0, True, True)
    assert [*facts["values"].values()] == result.rows[4].x
    code, out, _ = cli(*words[1:], "--out", tmp_path)
    assert code == 0
    assert f"{result.rows[4].x[0]!r}" in out  # with all digits
    approve(out, "recorded")
    assert (tmp_path / "cut-in-5.xosc").is_file()


def test_a_variation_that_passes_is_played_too(suite, tmp_path):
    (one,) = [o for o in suite.results if (o.entry, o.ego) == ("ranges", "reference")]
    assert one.rows[0].verdict == "passed"
    made = replay(suite.folder, "ranges", 1, ego="reference", out=tmp_path)
    text = write_replay_page(made).read_text("utf-8")
    assert '"motion":0' in text.replace(" ", "")
    assert (tmp_path / PAGE).is_file()


def test_variations_that_were_run_again_are_no_scenarios_of_a_suite(suite, tmp_path):
    place, _ = write_pair(tmp_path / "all", deterministic())
    made = evaluate_suite(place, out=place.parent / "out", egos=["reference"], workers=1)
    replay(made.folder, "brake", 1)
    assert len([*place.parent.rglob("*.xosc")]) == 3
    assert [one.name for one in find_entries([place])] == ["brake"]
    (place.parent / "ranges.xosc").unlink()
    assert [one.name for one in find_entries([place.parent])] == ["brake"]


def test_what_cannot_be_run_again_is_said(suite, tmp_path):
    def refused(kind, *given, ego=None):
        with pytest.raises(kind) as found:
            replay(*given, ego=ego)
        return str(found.value)

    out, ego = suite.folder, "reference"
    approve(refused(InputError, out, "cut-in", 14, ego="reference"), "14", "13")
    approve(refused(InputError, out, "cut-in", 0, ego=ego), "13")
    approve(refused(InputError, out, "cut-in", 1), "--ego", "route-follower")
    approve(refused(UnknownNameError, out, "cutin", 1), "cut-in")
    assert "unknown driver" in refused(UnknownNameError, out, "cut-in", 1, ego="careful")
    approve(refused(StorageError, tmp_path, "cut-in", 1), "results")
    text = (out / FILE).read_text("utf-8")
    (tmp_path / FILE).write_text(text.replace('"seed":3', '"seed":"3"', 1), "utf-8")
    assert "settings.seed" in refused(StorageError, tmp_path, "cut-in", 1, ego="reference")


def test_a_changed_scenario_is_refused(tmp_path):
    scenario, _ = write_pair(tmp_path / "files")
    suite = evaluate_suite(scenario, egos=["reference"], out=tmp_path / "out", workers=1)
    scenario.write_text(scenario.read_text("utf-8").replace('name="s"', 'name="t"'), "utf-8")
    with refuses(StorageError):
        replay(suite.folder, "brake", 1)


def test_code_in_results_is_not_run_unless_it_is_named(tmp_path):
    scenario, _ = write_pair(tmp_path / "files")
    suite = evaluate_suite(scenario, egos=["reference"], out=tmp_path / "out", workers=1)
    marker = tmp_path / "ran"
    (tmp_path / "evil.py").write_text(f"open({str(marker)!r}, 'w')\nclass D: pass\n")
    path = suite.folder / FILE
    text = path.read_text("utf-8")
    path.write_text(text.replace('"ego":"reference"', f'"ego":"{tmp_path}/evil.py:D"'), "utf-8")
    assert read_suite(suite.folder).results[0].ego.endswith("evil.py:D")
    with refuses(InputError):
        replay(suite.folder, "brake", 1)
    assert not marker.exists()
    assert "evil" not in sys.modules
