"""Mistakes on the command line: one clear sentence each, and what is computed is kept."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from tests.approval import approve

CALL = [sys.executable, "-c", "from bridgegen.cli import main; main()"]
EXAMPLES = Path(__file__).parents[1] / "docs" / "examples"


def refused(cli, *words):
    code, _, err = cli(*words)
    assert code == 2
    return err


def test_a_number_out_of_its_range_says_which_option(cli):
    err = refused(cli, "search", "cut-in", "--budget", 0)
    approve(err, "--budget", "10000000")


def test_a_driver_s_file_without_its_class_lists_the_classes(cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "f.py").write_text("class Mine:\n    pass\nclass _No: pass\ndef drive(): pass\n")
    err = refused(cli, "search", "cut-in", "--ego", "f.py")
    assert "FILE.py:CLASS" in err
    approve(err.rstrip(), "f.py")
    (tmp_path / "f.py").write_text("class")
    approve(refused(cli, "search", "cut-in", "--ego", "f.py"), "Python")
    (tmp_path / "f.py").unlink()
    approve(refused(cli, "search", "cut-in", "--ego", "f.py"), "such")


def test_simulate_reads_a_scenario_file_as_one(cli, tmp_path):
    (tmp_path / "my.yaml").write_text("scenario: my\n", "utf-8")
    err = refused(cli, "simulate", tmp_path / "my.yaml")
    assert "my.yaml" in err
    assert "XML" not in err


@pytest.mark.parametrize(
    "words",
    [
        ("search", "cut-in", "--ego", "reference", "--ego", "careful"),
        ("benchmark", "algorithms", "cut-in", "--ego=reference", "--ego", "careful"),
    ],
)
def test_an_option_of_one_value_is_given_once(cli, words):
    err = refused(cli, *words)
    approve(err, "--ego")


def test_options_that_may_be_repeated_may(cli):
    err = refused(cli, "search", "cut-in", "--fix", "a=1", "--fix", "b=1", "--budget", "0")
    assert "takes one value" not in err


def test_a_population_beyond_the_budget_is_a_warning(cli, tmp_path):
    words = ("search", "crossroads-s4", "--budget", 20, "--keep", 0, "--out", tmp_path / "r")
    code, _, err = cli(*words, "--algorithm", "ga", "--set", "population=100")
    assert code == 0
    approve(err, "100", "20")


def test_validate_notes_a_name_that_is_not_the_file_s(cli, tmp_path):
    from bridgegen.scenario.language.starter import start_scenario

    path = start_scenario("mine", like="crossroads-s4", folder=tmp_path)
    code, out, err = cli("validate", path)
    assert (code, err) == (0, "")
    path = path.rename(tmp_path / "other.yaml")
    code, out, err = cli("validate", path)
    assert (code, out) == (0, f"{path}: valid\n")
    approve(err, "scenario", "mine")


def test_validate_notes_texts_of_the_template_and_indicators_that_mislead(cli, tmp_path):
    from bridgegen.scenario.language.starter import start_scenario

    path = start_scenario("mine", folder=tmp_path)
    _, _, err = cli("validate", path)
    approve(err, "template")
    assert "indicates" not in err
    text = path.read_text("utf-8").replace(
        "events:\n", "events:\n  shows:\n    participant: other\n    indicate: left\n"
        "    when: [{kind: time, value: 1.0}]\n"
    )  # fmt: skip
    path.write_text(text, "utf-8")
    _, _, err = cli("validate", path)
    approve(err, "indicates")


def test_a_map_without_a_place_of_the_kind_says_so(cli, tmp_path):
    from tests.campaign.braking import write_pair

    write_pair(tmp_path)
    status, out, _ = cli("list", "places", tmp_path / "roads" / "straight.xodr", "crossroads-s4")
    assert status == 0
    approve(out, "crossroads-s4")


def test_an_error_is_the_first_line(tmp_path):
    done = subprocess.run(
        [*CALL, "search", "no-such-scenario"], capture_output=True, text=True, cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 2
    approve(done.stderr, "bridgegen")


def test_sigterm_ends_a_search_like_ctrl_c(tmp_path):
    words = ["search", "crossroads-s4", "--budget", "200000", "--out", "r"]
    running = subprocess.Popen(
        [*CALL, *words], stderr=subprocess.PIPE, text=True, cwd=tmp_path, env={**os.environ}
    )
    for _ in range(1200):
        if (tmp_path / "r/run.sqlite").exists() or running.poll() is not None:
            break
        time.sleep(0.1)
    time.sleep(1.0)
    running.send_signal(signal.SIGTERM)
    _, err = running.communicate(timeout=60)
    assert running.returncode == 143
    approve(err, "bridgegen")
    assert "Traceback" not in err


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("search", "cut-in", "--budget", "ten"), "--budget"),
        (("search", "cut-in", "--time-limit=soon"), "--time-limit"),
        (("search", "cut-in", "--criterion", "A: always(foo > 2 m)"), "foo"),
        (("simulate", "bad.xosc"), "XML"),
        (("fit", "cut-in", "events.csv"), "--without-column"),
        (("suite", "r156"), "r156"),
        (("confirm", "run", "--simulator", "esmini"), "run"),
    ],
)
def test_mistakes_are_answered_in_words_of_the_command_line(
    words, named, cli, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.xosc").write_text("no xml")
    (tmp_path / "events.csv").write_text("cut_in_distance\n5\n6\n")
    approve(refused(cli, *words), named)


def test_an_export_of_an_own_driver_s_scenario_names_the_file_once(cli, tmp_path):
    words = ("crossroads-s4", "--budget", 60, "--keep", 1, "--triage", "none", "--no-causes")
    own = f"{EXAMPLES / 'my_driver.py'}:MyDriver"
    assert cli("search", *words, "--ego", own, "--out", tmp_path / "r")[0] == 0
    (path,) = (tmp_path / "r" / "critical").glob("*.xosc")
    assert cli("export", tmp_path / "r", "--flavour", "1.3")[0] == 0  # nobody drives
    for flavour in ("recorded", "carla"):
        err = refused(cli, "export", path, "--flavour", flavour)
        assert err.count(str(path)) == 1
        approve(err, "--ego")
        assert cli("export", path, "--flavour", flavour, "--ego", own)[0] == 0
