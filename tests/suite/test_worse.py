"""Searches of a suite for where one ego is worse than another, and the verdict on two egos."""

from dataclasses import replace
from pathlib import Path

import pytest
from lxml import etree
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.cli.verdict.of_difference import DifferenceCriteria
from bridgegen.jobs.frame import JobCallbacks
from bridgegen.jobs.search import Run
from bridgegen.jobs.suite.difference import DriverDifference, WorseThan, difference, search_worse
from bridgegen.jobs.suite.page import write_suite_page
from bridgegen.jobs.suite.sentences import changes
from bridgegen.jobs.suite.suite import evaluate_suite

EGOS = ("careful", "route-follower")
HARM = {"critical": "harm"}
DRIVER = Path(__file__).parents[1] / "ego" / "drivers.py"


@pytest.fixture(scope="module")
def compared(tmp_path_factory):
    """Return a suite of two egos, its searches, and the names of what was searched."""
    folder = tmp_path_factory.mktemp("compared") / "suite"
    suite = evaluate_suite(["crossroads-s3"], egos=EGOS, **HARM, samples=20, out=folder, workers=1)
    begun: list[tuple[str, int, int, str]] = []
    callbacks = JobCallbacks(progress=lambda *what: begun.append(what))
    return suite, search_worse(suite, EGOS, budget=40, callbacks=callbacks), begun


def test_a_search_finds_what_the_second_fails_and_the_first_passes(compared):
    _suite, (found,), begun = compared
    assert begun[0] == ("searching", 0, 40, "1 of 1: crossroads-s3")
    assert begun[-1] == ("searching", 40, 40, "1 of 1: crossroads-s3")
    assert (found.entry, found.evaluations, found.problem) == ("crossroads-s3", 40, "")
    run = Run(found.folder)
    settings = run.settings
    assert settings.algorithm == "es"
    assert (settings.ego, settings.worse_than, settings.seed) == ("route-follower", "careful", 0)
    assert found.worse == run.summary.critical > 0
    assert found.modes == tuple(one.title for one in run.triage.modes)
    assert found.sentence == run.triage.bound.sentence


def test_a_finished_search_is_read_and_another_one_has_a_folder_of_its_own(compared):
    suite, (found,), _ = compared
    before = (found.folder / "run.sqlite").stat().st_mtime_ns
    assert search_worse(suite, EGOS, budget=40) == (found,)
    assert (found.folder / "run.sqlite").stat().st_mtime_ns == before
    (other,) = search_worse(suite, EGOS, budget=10)
    assert other.folder != found.folder
    assert search_worse(suite, EGOS, budget=0) == ()


def test_a_file_in_which_nothing_varies_is_not_searched(folder, tmp_path):
    suite = evaluate_suite(folder, egos=["reference", "careful"], out=tmp_path / "a", workers=1)
    assert {one.entry for one in suite.results} >= {"plain"}
    assert search_worse(suite, ("reference", "careful"), budget=5) == ()


def test_junit_has_a_test_for_what_is_broken_and_for_the_search(compared, tmp_path):
    suite, searches, _ = compared
    made = difference(suite.of_ego(EGOS[0]), suite.of_ego(EGOS[1]), EGOS)
    path = tmp_path / "junit.xml"
    outcomes = DifferenceCriteria.read((), path).judge(
        DriverDifference(suite, made, searches, path)
    )
    root = etree.parse(path).getroot()
    failed = {
        case.get("name") for case in root.iter("testcase") if case.find("failure") is not None
    }
    assert failed == {"passes what careful passes", "no search finds it worse than careful"}
    assert [one.verdict for one in outcomes] == ["failed", "failed"]
    broken = f"{made.counts['broken']} of 21 variations fail, and pass with careful"
    assert broken in path.read_text("utf-8")
    path.unlink()
    none = WorseThan("crossroads-s3", tmp_path, 40, sentence="None was found.")
    same = difference(suite.of_ego(EGOS[0]), suite.of_ego(EGOS[0]), EGOS)
    found = DriverDifference(suite, same, (none,), path)
    outcomes = DifferenceCriteria.read((), path).judge(found)
    assert [one.verdict for one in outcomes] == ["passed", "passed"]
    assert "<failure" not in path.read_text("utf-8")
    found = replace(found, searches=(WorseThan("crossroads-s3", tmp_path, problem="no map"),))
    outcomes = DifferenceCriteria.read(["worse_modes > 0"], path).judge(found)
    assert [one.verdict for one in outcomes] == ["passed"]
    assert '<error message="no map"' in path.read_text("utf-8")


def test_conditions_name_figures_that_exist():
    assert DifferenceCriteria.read(["worse_modes > 0", "broken > 2"]).conditions
    with refuses(InputError, "worst", "--fail-if"):
        DifferenceCriteria.read(["worst > 0"])


def test_the_page_names_what_searches_found(compared):
    suite, searches, _ = compared
    text = write_suite_page(suite, suite.jobs, searches=searches).read_text("utf-8")
    assert f'"report":"worse/{searches[0].folder.name}/report.html"' in text
    assert "Of 21 variations, route-follower breaks" in text


def test_intervals_are_stated_where_variations_are_a_sample(compared, folder, tmp_path):
    suite, *_ = compared
    made = difference(suite.of_ego(EGOS[0]), suite.of_ego(EGOS[1]), EGOS)
    assert made.sampled
    assert "95 % confidence" in changes(made)
    varied = folder / "varied_distribution.xosc"  # all of its combinations run
    whole = evaluate_suite(varied, egos=EGOS, out=tmp_path / "a", workers=1)
    made = difference(whole.of_ego(EGOS[0]), whole.of_ego(EGOS[1]), EGOS)
    assert not made.sampled
    assert "95 % confidence" not in changes(made)


def test_a_changed_driver_runs_again(folder, tmp_path):
    driver = tmp_path / "mine.py"
    driver.write_text(DRIVER.read_text("utf-8"), "utf-8")
    spec, ran = f"{driver}:Cruises", []
    how = {"egos": [spec, "reference"], "out": tmp_path / "a", "workers": 1}
    evaluate_suite(folder / "plain.xosc", **how)
    driver.write_text(driver.read_text("utf-8") + "\n# another version\n", "utf-8")
    again = JobCallbacks(progress=lambda what, done, total, facts: ran.append(done))
    evaluate_suite(folder / "plain.xosc", **how, callbacks=again)
    assert ran == [1, 2]  # the other driver's result is kept
