"""A project's folder → its page, from the command line and from Python."""

import json
import os
import re
import shutil
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import pytest
from tests.approval import approve, refuses
from tests.dashboard.conftest import R_12
from tests.pages import without_theme

import bridgegen as bg
from bridgegen.base.errors import FileFormatError, StorageError
from bridgegen.jobs.dashboard.dashboard import Dashboard
from bridgegen.jobs.dashboard.modes import Decisions, failure_modes
from bridgegen.jobs.dashboard.odd import coverage
from bridgegen.jobs.dashboard.options import JOB
from bridgegen.jobs.dashboard.page import MOST_MODES, within, write_page
from bridgegen.jobs.dashboard.project import Problem, Project
from bridgegen.jobs.dashboard.requirements import matrices
from bridgegen.jobs.dashboard.scenery import scenery_of
from bridgegen.jobs.dashboard.sentences import failing_sentence, requirements_sentence
from bridgegen.jobs.dashboard.trends import trends
from bridgegen.jobs.suite.growth import add_failures
from bridgegen.jobs.suite.suite import evaluate_suite, read_suite
from bridgegen.results.failures import FILE, OLD_FILE, Failure, read_failures, write_failures
from bridgegen.scenario.language.reader import load
from bridgegen.search.triage.record import Estimate, read_record


class Tags(HTMLParser):
    """Collects the elements of a page, and which are open at its end."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.text = without_theme(page.read_text("utf-8"))
        self.open: list[str] = []
        self.links: list[str] = []
        self.names: set[str] = set()
        self.feed(self.text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.names.add(tag)
        if tag not in ("meta", "link", "path", "rect", "circle", "polyline"):
            self.open.append(tag)
        self.links += [value or "" for name, value in attrs if tag == "a" and name == "href"]

    def handle_endtag(self, tag: str) -> None:
        if self.open and self.open[-1] == tag:
            self.open.pop()


@pytest.fixture(scope="module")
def found(project, tmp_path_factory) -> Dashboard:
    return bg.build_dashboard(project, out=tmp_path_factory.mktemp("page") / "all.html")


@pytest.fixture
def copy(project, tmp_path) -> Path:
    return shutil.copytree(project, tmp_path / "project")


def test_it_finds_all_results_and_names_what_is_damaged(found):
    figures = found.figures
    assert (figures["runs"], figures["suites"], figures["maps"]) == (2, 1, 1)
    assert figures["scenarios"] == 2
    assert figures["evaluations"] == 2 * 40 + 4 * 7  # 6 variations and the defaults
    (problem,) = found.project.problems
    assert problem.place == "damaged <b>"
    assert "SQLite" in problem.why


def test_modes_are_those_of_the_records(found, project):
    triage = read_record(project / "runs" / "route-follower" / "triage.json")
    titles = {one.title for one in triage.modes}
    assert titles <= {one.title for one in found.modes}
    suite = read_suite(project / "suites" / "change")
    failing = [one for one in suite.results if any(row.critical for row in one.rows)]
    assert {one.key.driver for one in found.modes if "suite" in {r.kind for r in one.results}} == {
        one.ego for one in failing
    }


def test_the_requirement_is_as_the_run_says(found, project):
    (judged,) = bg.Run(project / "runs" / "route-follower").criteria
    matrix = next(one for one in found.requirements if one.driver == "route-follower")
    cell = matrix.cell("cut-in", "R-12")
    assert (cell.met, cell.violated) == (judged.met, judged.violated)
    assert cell.page == "runs/route-follower/report.html"
    assert matrix.without == ["left-across-path"]


def test_coverage_counts_every_evaluation_with_a_result(found):
    rain = [one for one in found.coverage.attributes if one.attribute.path[-2] == "Rainfall"]
    total = sum(one.evaluations for one in rain)
    assert total == sum(one.evaluations for one in found.coverage.seen.values())
    assert total == found.figures["evaluations"]  # none failed


def test_the_page_is_whole_and_its_links_lead_to_results(found):
    page = Tags(found.page)
    assert page.open == []
    assert not page.names & {"script", "img", "iframe", "object", "form"}
    assert re.search("https?:", page.text.replace("http://www.w3.org", "")) is None
    outside = [link for link in page.links if not link.startswith("#")]
    assert outside
    for link in outside:
        assert (found.page.parent / unquote(link)).is_file(), link
    for link in page.links:
        assert not link.startswith("#") or f'id="{link[1:]}"' in page.text or link == "#modes"
    assert "damaged &lt;b&gt;" in page.text
    assert "damaged <b>" not in page.text


def test_the_same_project_makes_the_same_page(found, project, tmp_path):
    out = found.page.parent / "again.html"
    assert bg.build_dashboard(project, out=out).page.read_bytes() == found.page.read_bytes()


def test_the_command_judges_and_keeps_statuses(cli, copy):
    status, out, err = cli("dashboard", copy, "--update", "--fail-if", "new > 0")
    assert status == 3
    approve(err, "FAILED")
    assert str(copy / "dashboard.html") in out
    file = copy / FILE
    text = file.read_text("utf-8")
    file.write_text(text.replace("status: new", "status: accepted # in May"), "utf-8")
    accepted = ("dashboard", copy, "--update", "--fail-if", "new > 0", "--json")
    status, out, err = cli(*accepted)
    assert (status, "NOT JUDGED: all results are read" in err) == (3, True)  # two are damaged
    status, out, err = cli(*accepted, "--fail-if", "problems > 9")
    assert status == 0
    facts = json.loads(out)
    assert facts["added"] == 0
    assert facts["figures"]["accepted"] == text.count("status: new") > 0
    file.write_text(text.replace("status: new", "status: fixed"), "utf-8")
    status, out, err = cli("dashboard", copy, "--fail-if", "regressions > 0")
    assert status == 3
    assert "regression" in out
    assert "fixed, but fails again" in (copy / "dashboard.html").read_text("utf-8")


def test_a_run_file_of_several_writes_each_page_in_its_folder(cli, copy, tmp_path):
    other = shutil.copytree(copy, tmp_path / "other")
    file = tmp_path / "all.yaml"
    file.write_text(json.dumps({"runs": {"a": {"folder": str(copy)}, "b": {"folder": "other"}}}))
    assert cli("dashboard", file)[0] == 0
    assert all((folder / "dashboard.html").is_file() for folder in (copy, other))


def test_without_update_the_file_is_not_touched(cli, copy):
    assert cli("dashboard", copy)[0] == 0
    assert not (copy / FILE).exists()


def test_requirements_of_the_project_that_nothing_tests_are_seen(copy):
    declared = ["R-99: min(ego.v) > 0 m/s", R_12]
    found = bg.build_dashboard(copy, criteria=declared)
    assert found.untested == ["R-99"]
    assert "tested by no scenario" in found.page.read_text("utf-8")
    approve(requirements_sentence(found), "99")


def test_an_earlier_result_of_the_same_version_still_counts(copy):
    before = {one.key for one in bg.build_dashboard(copy).failing}
    run = copy / "runs" / "route-follower"
    again = shutil.copytree(run, copy / "runs" / "later")
    record = json.loads((again / "triage.json").read_text("utf-8"))
    record["modes"] = record["modes"][:0]
    (again / "triage.json").write_text(json.dumps(record), "utf-8")
    later = (again / "run.sqlite").stat().st_mtime + 100.0
    os.utime(again / "run.sqlite", (later, later))
    # the same version of BridgeGen, so the earlier result still says how things stand
    assert {one.key for one in bg.build_dashboard(copy).failing} == before


def test_links_hold_from_another_folder(copy, tmp_path):
    out = tmp_path / "public" / "deep"
    out.mkdir(parents=True)
    page = Tags(bg.build_dashboard(copy, out=out / "index.html").page)
    outside = [link for link in page.links if not link.startswith("#")]
    assert all((out / unquote(link)).is_file() for link in outside)


def test_damaged_statuses_are_an_error_before_anything_is_written(cli, copy):
    (copy / FILE).write_text("failures:\n  fm-1:\n    status: maybe\n", "utf-8")
    with pytest.raises(FileFormatError):
        bg.build_dashboard(copy)
    status, _, err = cli("dashboard", copy)
    assert status == 2
    assert "line 3" in err
    assert not (copy / "dashboard.html").exists()


def test_another_file_is_not_overwritten(copy):
    (copy / "dashboard.html").write_text("mine", "utf-8")
    with refuses(StorageError):
        bg.build_dashboard(copy, update=True)
    assert not (copy / FILE).exists()


@pytest.mark.parametrize("make", [False, True])
def test_a_folder_without_results_is_an_error(tmp_path, make):
    folder = tmp_path / "empty"
    if make:
        folder.mkdir()
    with refuses(StorageError):
        bg.build_dashboard(folder)


def test_an_unknown_figure_is_named(cli, copy):
    status, _, err = cli("dashboard", copy, "--fail-if", "old > 0")
    assert status == 2
    assert "unknown figure" in err


def test_every_figure_is_there_and_explained(found):
    assert set(found.figures) == set(JOB.figures)


def test_a_changed_scenario_is_named_and_not_counted(copy, tmp_path):
    text = (Path(bg.__file__).parent / "scenario" / "catalogue" / "cut-in.yaml").read_text("utf-8")
    file = tmp_path / "mine.yaml"
    file.write_text(text, "utf-8")
    bg.run_search(
        file,
        ego="reference",
        algorithm="random",
        budget=2,
        triage="short",
        out=copy / "runs" / "mine",
    )
    file.write_text(text.replace("high: ", "high: 1", 1), "utf-8")
    found = bg.build_dashboard(copy)
    assert any("has changed" in one.why and "mine.yaml" in one.place
               for one in found.project.problems)  # fmt: skip


# ---- sizes, and what strangers write ----


def made(results, folder, problems=()):
    """Return a dashboard of results that are not on disk."""
    sceneries = {"cut-in": scenery_of(load("cut-in"))}
    project = Project(folder, tuple(results), (), (), (), sceneries, tuple(problems))
    page = folder / "dashboard.html"
    return Dashboard(
        project, page, {}, folder / FILE, tuple(failure_modes(results, Decisions())),
        tuple(matrices(results)), (), tuple(trends(results, ())), coverage(results, sceneries),
    )  # fmt: skip


def test_a_page_of_a_thousand_runs_is_small(result, tmp_path):
    space = Estimate(drawn="fresh", rows=256, harmful=3, share=3 / 256, low=0.002, high=0.03)
    judged = tuple((f"R-{k}", 5, k % 2) for k in range(20))
    results = [
        result(
            f"scenario-{k % 100}", f"1.{k // 100}", float(k), modes=("turn", f"rear {k % 7}"),
            judged=judged, space=space, source=f"runs/{'week ' * 4}{k}", page=f"runs/{k}.html",
        )
        for k in range(1000)
    ]  # fmt: skip
    found = made(results, tmp_path)
    write_page(found)
    assert found.page.stat().st_size < 5_000_000
    assert Tags(found.page).open == []


def test_more_modes_than_the_page_holds_are_counted(result, tmp_path):
    results = [result(modes=tuple(map(str, range(MOST_MODES + 30))))]
    found = made(results, tmp_path)
    write_page(found)
    assert "and 30 more" in found.page.read_text("utf-8")


def test_texts_of_strangers_are_escaped(result, tmp_path):
    hostile = '"><script>alert(1)</script>&\ud800'
    results = [
        result(hostile, name=hostile, modes=(hostile,), source=f"javascript:{hostile}",
               page=f"javascript:{hostile}/report.html"),
    ]  # fmt: skip
    found = made(results, tmp_path, [Problem(hostile, hostile)])
    write_page(found)
    page = Tags(found.page)
    assert "script" not in page.names
    assert all(link.startswith(("./", "#")) for link in page.links)
    assert page.open == []


def test_the_sentences_name_who_fails_where(result, tmp_path):
    results = [
        result("a", modes=("turn",), judged=(("R-1", 1, 2),)),
        result("b", judged=(("R-1", 3, 0),)),
    ]
    found = made(results, tmp_path)
    approve(failing_sentence(found))
    approve(requirements_sentence(found))


def test_the_sentences_of_a_clean_project(result, tmp_path):
    found = made([result("a")], tmp_path)
    approve(failing_sentence(found))
    approve(requirements_sentence(found), "criterion")


def test_statuses_are_read_back(copy):
    found = bg.build_dashboard(copy, update=True)
    assert set(read_failures(copy).failures) == {one.key.id for one in found.modes}


def test_a_suite_of_a_stranger_is_read_or_named(copy):
    file = copy / "suites" / "change" / "results.jsonl"
    head, *lines = file.read_text("utf-8").splitlines()
    first = json.loads(lines[0])
    hostile = [
        {**first, "scenario": "a\0b.yaml", "entry": "<script>"},
        {**first, "scenario": "../" * 400 + "x.yaml", "entry": "far"},
        {**first, "scenario": "a\0b/c.xosc", "entry": "nul"},
        {**first, "rows": [{**first["rows"][0], "x": ["text"] * len(first["parameters"])}]},
        {**first, "entry": "short", "rows": [{**first["rows"][0], "x": []}]},
    ]
    file.write_text("\n".join([head, *map(json.dumps, hostile)]) + "\n", "utf-8")
    found = bg.build_dashboard(copy)
    assert found.figures["suites"] + found.figures["problems"] >= 2
    assert "script" not in Tags(found.page).names


@pytest.mark.parametrize("damage", ["", "{", "[]", '{"cells": -1}', '{"scenario": 3}', "\xff"])
def test_a_damaged_map_is_named(copy, damage):
    (copy / "maps" / "half" / "summary.json").write_bytes(damage.encode("latin-1"))
    found = bg.build_dashboard(copy)
    assert "maps/half" in {one.place for one in found.project.problems}


def test_as_many_parts_are_shown_as_fit_and_the_first():
    assert within([3, 2, 2], 5) == 2
    assert within([8], 5) == 1


# ---- one decision in one place ----


def decide(folder, *ids, **more):
    """Set the status of blocks, as a person does."""
    file = read_failures(folder)
    write_failures(file, {id: file.failures[id].model_copy(update=more) for id in ids})


@pytest.fixture(scope="module")
def grown(project, tmp_path_factory) -> Path:
    """A copy of the project with a suite of the failures of its first run, and its results."""
    folder = shutil.copytree(project, tmp_path_factory.mktemp("grown") / "project")
    with pytest.MonkeyPatch.context() as patched:
        patched.chdir(folder.parent)  # so that the results name the scenarios by relative paths
        _grow(Path("project"))
    return folder


def _grow(folder):
    add_failures([folder / "runs" / "route-follower"], folder / "suites" / "mine")
    evaluate_suite(
        folder / "suites" / "mine", egos=["route-follower"], workers=1,
        out=folder / "suites" / "mine-results",
    )  # fmt: skip


@pytest.fixture
def growing(grown, tmp_path) -> Path:
    return shutil.copytree(grown, tmp_path / "project")


def of_suite(found):
    """Return the failure modes on which blocks of the suite decide, by what results they are in."""
    kinds = {}
    for one in found.modes:
        if one.decided:
            assert one.decided.startswith("suites/mine/failures.yaml: cut-in-")
            kinds.setdefault(one.results[0].kind, []).append(one)
    return kinds


def test_a_suite_that_grows_decides_on_its_failures_wherever_they_are_found(growing):
    suite = growing / "suites" / "mine"
    ids = [*read_failures(suite).failures]
    decide(suite, *ids, status="accepted", comment="JIRA-3")
    kinds = of_suite(bg.build_dashboard(growing))
    run = growing / "runs" / "route-follower"
    ways = {(one.conflict, one.conflict_type, one.responsible, one.partner, one.place)
            for one in bg.Run(run).modes}  # fmt: skip
    assert len(kinds["run"]) >= len(ways)  # and violations, where they alone are kept
    assert kinds["suite"]
    for one in (*kinds["run"], *kinds["suite"]):
        assert (one.status, one.comment) == ("accepted", "JIRA-3")
        assert one.key.driver == "route-follower"
    shutil.rmtree(growing / "suites" / "mine-results")  # its blocks are there
    assert of_suite(bg.build_dashboard(growing)).keys() == {"run"}


def test_a_suite_beside_the_project_decides_too(growing):
    suite = growing / "suites" / "mine"
    decide(suite, *read_failures(suite).failures, status="known")
    other = growing.parent / "other"
    shutil.copytree(growing / "suites" / "mine-results", other / "nightly")
    found = bg.build_dashboard(other)
    place = "../project/suites/mine/failures.yaml: cut-in-"
    decided = [one for one in found.modes if one.decided.startswith(place)]
    assert decided
    assert {one.status for one in decided} == {"known"}
    assert place in found.page.read_text("utf-8")


def test_update_adds_only_modes_that_no_block_names(growing):
    found = bg.build_dashboard(growing, update=True)
    decided = {one.key.id for one in found.modes if one.decided}
    assert decided
    assert set(read_failures(growing).failures) == {one.key.id for one in found.modes} - decided
    assert found.added == len(found.modes) - len(decided)


def test_a_decision_that_contradicts_the_suites_is_named(growing):
    (mode, *_) = of_suite(bg.build_dashboard(growing))["run"]
    write_failures(read_failures(growing), {mode.key.id: Failure(status="accepted")})
    found = bg.build_dashboard(growing)
    assert next(one for one in found.modes if one.key == mode.key).status == "new"
    assert found.notes == (
        f"{mode.key.id} is accepted in failures.yaml and new in {mode.decided}, which counts: "
        "remove the former",
    )


def test_one_folder_may_be_suite_and_project(growing):
    suite = growing / "suites" / "mine"
    for path in suite.iterdir():
        path.rename(growing / path.name)
    found = bg.build_dashboard(growing, update=True)
    blocks = read_failures(growing).failures
    assert {bool(one.files) for one in blocks.values()} == {True, False}
    in_runs = [one for one in found.modes if one.decided]
    assert in_runs
    assert all(one.decided.startswith("failures.yaml: cut-in-") for one in in_runs)


def test_a_damaged_file_of_a_suite_is_a_problem_and_its_failures_are_new(growing):
    path = growing / "suites" / "mine" / FILE
    path.write_text(path.read_text("utf-8").replace("status: new", "status: wontfix", 1), "utf-8")
    found = bg.build_dashboard(growing)
    (problem,) = [one for one in found.project.problems if one.place == "suites/mine/failures.yaml"]
    assert "wontfix" in problem.why
    assert "suites/mine/failures.yaml, line" in problem.why
    assert {one.status for one in found.modes} == {"new"}
    with pytest.raises(FileFormatError, match="wontfix"):
        bg.build_dashboard(growing, update=True)
    assert not (growing / FILE).exists()


def test_the_file_of_earlier_versions_is_read_and_copied(cli, copy):
    mode, other = (one.key.id for one in bg.build_dashboard(copy).modes[:2])
    old = copy / OLD_FILE
    gone = "- id: fm-gone\n  status: known\n  title: 'no more'\n"
    text = f"modes:\n# in May\n- id: {mode}\n  status: accepted\n  note: by Ada\n{gone}"
    old.write_text(text, "utf-8")
    write_failures(read_failures(copy), {other: Failure(status="known")})
    status, out, _ = cli("dashboard", copy)
    assert status == 0
    assert out.count("failure-modes.yaml") == 1
    approve(out, "--update", "failures.yaml")
    cli("dashboard", copy, "--update")
    assert old.read_text("utf-8") == text
    blocks = read_failures(copy).failures
    assert (blocks[mode].status, blocks[mode].comment) == ("accepted", "by Ada")
    assert (blocks[other].status, blocks["fm-gone"].status) == ("known", "known")
    _, out, _ = cli("dashboard", copy)
    approve(out, "failures.yaml")
    decide(copy, mode, status="fixed")
    found = bg.build_dashboard(copy)
    assert {one.key.id for one in found.modes if one.status == "fixed"} == {mode}
    assert found.unseen["fm-gone"].title == "no more"
    old.write_text("modes:\n- id: fm-1\n  status: maybe\n", "utf-8")
    status, _, err = cli("dashboard", copy)
    assert status == 2
    approve(err, "failure-modes.yaml", "line 3")
