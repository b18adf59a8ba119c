"""Suites: what is found, all variations, resuming, and what a broken file costs."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve, refuses
from tests.campaign.braking import scenario_text, value_sets, write_pair

from bridgegen.base.errors import InputError, StorageError
from bridgegen.cli.verdict.fail_if import Comparison
from bridgegen.cli.verdict.of_difference import figures_of as figures_of_difference
from bridgegen.cli.verdict.of_suite import SuiteCriteria, figures_of
from bridgegen.jobs.frame import JobCallbacks
from bridgegen.jobs.suite.difference import difference
from bridgegen.jobs.suite.entries import find_entries
from bridgegen.jobs.suite.results import EntryResult, RowResult, counts
from bridgegen.jobs.suite.suite import FILE, evaluate_suite, read_suite

CRITERIA = {"criteria": ["C-1: always(ego.v < 12 m/s)"]}


def test_scenarios_and_distributions_are_found_in_folders(folder):
    (folder / "catalogue.xosc").write_text(
        '<OpenSCENARIO><FileHeader revMajor="1" revMinor="2" date="2025-01-01T00:00:00" '
        'description="" author=""/><Catalog name="c"/></OpenSCENARIO>'
    )
    (folder / "readme.yaml").write_text("notes: none")
    shutil.copy(folder / "plain.xosc", folder / "sub" / "twin.xosc")
    shutil.copy(folder / "plain.xosc", folder / "twin.xosc")
    found = find_entries([folder, "cut-in"])
    named = {one.name: (Path(one.scenario).name, bool(one.distribution)) for one in found}
    assert named == {
        "cut-in": ("cut-in", False),
        "plain": ("plain.xosc", False),
        "varied_distribution": ("varied.xosc", True),  # the scenario itself is among them
        f"{folder.name}/twin": ("twin.xosc", False),
        "sub/twin": ("twin.xosc", False),
    }


def test_what_is_no_scenario_is_refused(folder, tmp_path):
    (tmp_path / "notes.yaml").write_text("a: 1")
    with pytest.raises(InputError) as refused:
        find_entries([tmp_path / "notes.yaml", "nowhere", folder])
    problems = "\n".join(refused.value.problems)
    approve(problems, "notes.yaml", "scenario")
    (tmp_path / "empty").mkdir()
    with refuses(InputError):
        find_entries([tmp_path / "empty"])


def test_all_variations_run_and_are_judged(folder, tmp_path):
    suite = evaluate_suite(
        folder, egos=["route-follower"], **CRITERIA, out=tmp_path / "out", workers=1
    )
    by_name = {one.entry: one for one in suite.results}
    varied = by_name["varied_distribution"]
    assert varied.parameters == ["EgoSpeed", "Gap"]
    # 3 x 2 combinations, of which the constraint Gap >= 2 s EgoSpeed excludes two
    assert [row.x for row in varied.rows] == [[8.0, 18.0], [8.0, 40.0], [10.0, 40.0], [14.0, 40.0]]
    approve(varied.notes, "combinations")
    assert [row.x[0] for row in varied.rows if row.violated] == [14.0]  # faster than 12 m/s
    assert varied.verdict == "failed"
    figures = figures_of(suite)
    assert figures["criterion:C-1"] == 2  # and the scenario alone, at 15 m/s
    assert figures["variations"] == 5


def test_texts_of_value_sets_are_written_as_texts(tmp_path):
    declared = '<ParameterDeclaration name="Surface" parameterType="string" value="dry"/>'
    text = scenario_text().replace(
        "</ParameterDeclarations>", f"{declared}</ParameterDeclarations>"
    )
    sets = value_sets({"EgoSpeed": 8, "Surface": "dry"}, {"EgoSpeed": 14, "Surface": "wet"})
    write_pair(tmp_path, sets, text)
    suite = evaluate_suite(tmp_path, egos=["reference"], out=tmp_path / "out", workers=1)
    (varied,) = suite.results
    rows = [dict(zip(varied.parameters, row.x, strict=True)) for row in varied.rows]
    assert [(row["EgoSpeed"], row["Surface"]) for row in rows] == [(8.0, "dry"), (14.0, "wet")]


def test_workers_and_resuming_change_no_bit(folder, tmp_path):
    whole = evaluate_suite(folder, egos=["reference"], out=tmp_path / "a", workers=1)
    text = (tmp_path / "a" / FILE).read_bytes()
    (tmp_path / "b").mkdir()
    head, first, *_ = text.splitlines(keepends=True)
    (tmp_path / "b" / FILE).write_bytes(head + first + b'{"entry": "torn')  # killed while writing
    again = evaluate_suite(folder, egos=["reference"], out=tmp_path / "b", workers=2)
    assert again.results == whole.results
    read = {one.entry: one for one in read_suite(tmp_path / "b").results}
    assert read == {one.entry: one for one in whole.results}


def test_a_changed_file_is_run_again(folder, tmp_path):
    evaluate_suite(folder, egos=["reference"], out=tmp_path / "a", workers=1)
    path = folder / "plain.xosc"
    path.write_text(path.read_text("utf-8").replace('name="s"', 'name="t"'), "utf-8")
    counted = []
    evaluate_suite(
        folder, egos=["reference"], out=tmp_path / "a", workers=1,
        callbacks=JobCallbacks(progress=lambda what, *done: counted.append(done)),
    )  # fmt: skip
    total = counted[0][1]
    assert [done for done, *_ in counted] == [total - 1, total]


def test_a_changed_map_is_noticed(folder, tmp_path):
    before = {one.name: one.digest for one in find_entries([folder])}
    assert {len(one) for one in before.values()} == {64}
    path = folder / "roads" / "straight.xodr"
    path.write_bytes(path.read_bytes() + b"<!-- another -->")
    after = {one.name: one.digest for one in find_entries([folder])}
    assert not {*before.values()} & {*after.values()}  # the distribution's scenario names it, too


def test_other_settings_are_refused(folder, tmp_path):
    evaluate_suite(folder / "plain.xosc", egos=["reference"], out=tmp_path / "a", workers=1)
    with refuses(StorageError):
        evaluate_suite(folder / "plain.xosc", egos=["reference"], **CRITERIA, out=tmp_path / "a")


def test_a_broken_file_is_a_row_and_the_others_run(folder, tmp_path):
    (folder / "broken.xosc").write_text("<OpenSCENARIO><Storyboard>")
    text = (folder / "plain.xosc").read_text("utf-8")
    (folder / "nomap.xosc").write_text(text.replace("straight.xodr", "nowhere.xodr"), "utf-8")
    suite = evaluate_suite(folder, egos=["reference"], out=tmp_path / "a", workers=1)
    problems = {one.entry: one.problem for one in suite.results}
    assert "not well-formed XML" in problems["broken"]
    assert "nowhere.xodr" in problems["nomap"]
    assert problems["plain"] == ""
    assert counts(suite.results)["not run"] == 2
    outcomes = SuiteCriteria.read((), tmp_path / "j.xml").judge(suite)
    assert outcomes[0].verdict != "passed"
    assert (tmp_path / "j.xml").read_text("utf-8").count("<error") == 2


def test_results_are_untrusted(folder, tmp_path):
    evaluate_suite(folder / "plain.xosc", egos=["reference"], out=tmp_path / "a", workers=1)
    path = tmp_path / "a" / FILE
    head, line, *_ = path.read_text("utf-8").splitlines()
    for bad in ('{"suite": 1}', "[1]", line.replace('"rows"', '"rowz"'), "{" * 9000):
        path.write_text(f"{head}\n{bad}\n", "utf-8")
        with pytest.raises(StorageError, match="is damaged"):
            read_suite(tmp_path / "a")
    path.write_text(json.dumps({"settings": {}, "more": 1}) + "\n", "utf-8")
    with pytest.raises(StorageError, match="is damaged"):
        read_suite(tmp_path / "a")


def results(*verdicts: str) -> tuple[EntryResult]:
    rows = [
        RowResult(problem="x") if one == "n" else RowResult(critical=one == "f", severity=0.1 * i)
        for i, one in enumerate(verdicts)
    ]
    return (EntryResult(entry="e", ego="", digest="d", scenario="s", rows=rows),)


def test_a_difference_by_hand():
    found = difference(results(*"ppffnpp"), results(*"pfpffff"), ("a", "b"))
    assert found.counts == {
        "broken": 3, "fixed": 1, "both fail": 1, "both pass": 1, "not comparable": 1,
    }  # fmt: skip
    # of four discordant pairs, 3 to 1 or more uneven: 2 (1 + 4) / 16
    assert found.p_value == pytest.approx(10 / 16)
    low, high = found.interval("broken")
    assert low == pytest.approx(0.1181, abs=1e-3)  # Clopper-Pearson of 3 in 6
    assert high == pytest.approx(0.8819, abs=1e-3)
    figures = figures_of_difference(found, ())
    assert (figures["broken"], figures["fixed"], figures["more_severe"]) == (3, 1, 0)
    assert figures["worse"] == 0
    assert np.isfinite(list(figures.values())).all()


def test_conditions_are_checked_before_anything_runs(tmp_path):
    read = SuiteCriteria.read(["failed > 2"], None)
    assert read.conditions[0].comparisons == (Comparison("failed", ">", 2.0),)
    with refuses(InputError, "faild", "--fail-if"):
        SuiteCriteria.read(["faild > 2"], None)


def test_a_suite_calls_its_driver_by_its_name(folder, tmp_path):
    mine = tmp_path / "mine.py"
    mine.write_text(
        "import numpy as np\nfrom bridgegen.drivers.interface import Control\n\n\n"
        "class Mine:\n    def reset(self, n, scene):\n        self.n = n\n\n"
        "    def act(self, observation):\n"
        "        return Control(np.zeros(self.n), np.zeros(self.n))\n",
        "utf-8",
    )
    options = {"egos": f"{mine}:Mine", "workers": 1}
    found = evaluate_suite(folder / "plain.xosc", **options, out=tmp_path / "out")
    assert found.labels == ("Mine",)
    assert found.results[0].driver_digest
    named = evaluate_suite(
        folder / "plain.xosc", **options, driver_name="planner 7", out=tmp_path / "named"
    )
    assert named.labels == read_suite(tmp_path / "named").labels == ("planner 7",)
    assert {result.driver for result in named.results} == {"planner 7"}
    shutil.copy(mine, folder / "mine.py")
    twice = evaluate_suite(
        folder / "plain.xosc", egos=[f"{mine}:Mine", f"{folder}/mine.py:Mine"], workers=1,
        out=tmp_path / "twice",
    )  # fmt: skip
    assert twice.labels == (f"{mine}:Mine", f"{folder}/mine.py:Mine")
    with refuses(InputError, "--name", "--ego"):
        evaluate_suite(folder, driver_name="planner 7", out=tmp_path / "none")
