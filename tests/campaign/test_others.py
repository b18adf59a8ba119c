"""Drivers of participants other than the ego, from the search to the files and back."""

import json

import numpy as np
import pytest
from tests.approval import refuses

import bridgegen as bg
from bridgegen.base.errors import UnknownNameError, UnsupportedError
from bridgegen.jobs.search.export import export
from bridgegen.jobs.search.settings import Settings
from bridgegen.openx.convert import import_file
from bridgegen.results.store import Store


def settings_of(folder):
    with Store.open(folder) as store:
        return Settings.from_dict(store.settings, folder), store.read()


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("others") / "run"
    return bg.run_search(
        "crossroads-s3",
        others="attentive",
        budget=200,
        keep=3,
        triage="short",
        out=folder,
        causes=False,
    )


def test_the_file_that_is_searched_is_the_file_that_is_handed_over(run):
    settings, rows = settings_of(run.folder)
    assert settings.others == "attentive"
    files = run.scenarios
    assert files
    for path in files:
        assert 'value="attentive"' in path.read_text(encoding="utf-8")
        facts = json.loads(path.with_suffix(".json").read_text("utf-8"))
        result = bg.simulate_file(path)
        recorded = rows.metrics[facts["row"]]
        assert [result.metrics[name] for name in facts["metrics"]] == recorded.tolist()


def test_a_run_is_resumed_with_the_same_others(run):
    _, before = settings_of(run.folder)
    again = bg.resume(run.folder)
    _, after = settings_of(again.folder)
    assert np.array_equal(before.F, after.F)


def test_a_run_that_could_not_say_it_is_scripted(run):
    settings, _ = settings_of(run.folder)
    old = {name: one for name, one in settings.to_dict().items() if name != "others"}
    assert Settings.from_dict(old, run.folder).others == "scripted"


def test_the_command_says_it(run, tmp_path):
    settings, _ = settings_of(run.folder)
    assert "--others attentive" in settings.command(tmp_path)


def test_an_import_keeps_the_driver_and_the_motion(run, tmp_path):
    source = min((run.folder / "critical").glob("*.xosc"))
    owl = tmp_path / "one.owl"
    import_file(source, owl)
    assert "attentive" in owl.read_text(encoding="utf-8")


def test_what_drives_is_overridden_for_a_file(run, cli):
    source = min((run.folder / "critical").glob("*.xosc"))
    found = {
        others: bg.simulate_file(source, others=others) for others in ("attentive", "scripted")
    }
    asis = bg.simulate_file(source)
    assert np.array_equal(asis.rollout.x, found["attentive"].rollout.x)
    status, shown, _ = cli("simulate", source, "--others", "attentive", "--json")
    assert status == 0
    assert json.loads(shown)["metrics"]["d_min"] == asis.metrics["d_min"]


def test_an_unknown_driver_of_the_others_is_one_clear_error(run, tmp_path):
    with refuses(UnknownNameError, "attentif"):
        bg.run_search("crossroads-s4", others="attentif", triage="short", out=tmp_path / "run")
    source = min((run.folder / "critical").glob("*.xosc"))
    with refuses(UnknownNameError, "attentif"):
        bg.simulate_file(source, others="attentif")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("attentiv", "unknown driver 'attentiv' of 'bv'"),
        ("reference", "the driver 'reference' is for the ego, not for 'bv'"),
        ("mine.py:Driver", "the driver 'mine.py:Driver' is for the ego, not for 'bv'"),
    ],
)
def test_a_driver_in_a_file_that_does_not_fit_is_refused_with_its_line(
    run, tmp_path, name, message
):
    source = min((run.folder / "critical").glob("*.xosc"))
    road = source.with_suffix(".xodr")
    text = source.read_text(encoding="utf-8").replace('value="attentive"', f'value="{name}"')
    (tmp_path / source.name).write_text(text, encoding="utf-8")
    (tmp_path / road.name).write_bytes(road.read_bytes())
    with pytest.raises(UnsupportedError, match=rf"{source.name}, line \d+: {message}"):
        bg.simulate_file(tmp_path / source.name)


@pytest.mark.parametrize(
    ("flavour", "words"),
    [
        ("1.2", "ignore their driver 'attentive' and move them as the storyboard says"),
        ("resolved", "ignore their driver 'attentive'"),
        ("carla", "they do not react to another one"),
        ("recorded", None),
    ],
)
def test_a_flavour_that_cannot_say_who_drives_names_them(run, tmp_path, cli, flavour, words):
    source = min((run.folder / "critical").glob("*.xosc"))
    status, shown, said = cli("export", source, "--flavour", flavour, "--out", tmp_path)
    assert status == 0
    assert str(tmp_path / source.name) in shown
    assert (words is None) == (said == "")
    if words is not None:
        assert words in said
        assert "participants 'bv'" in said


def test_recorded_motion_is_that_of_the_attentive_participants(run, tmp_path):
    source = min((run.folder / "critical").glob("*.xosc"))
    export(source, "recorded", out=tmp_path)
    as_driven, again = bg.simulate_file(source), bg.simulate_file(tmp_path / source.name)
    assert np.abs(as_driven.rollout.x - again.rollout.x).max() < 1e-6
