"""What a dossier says, that a stranger's interpreter finds the same, and what is missing."""

import ast
import json
import sqlite3
from pathlib import Path

import pytest
import yaml
from tests.approval import ROOT, refuses
from tests.safety_case.test_argument import confirmed_in_double

import bridgegen as bg
from bridgegen.base.errors import FileFormatError, InputError, StorageError
from bridgegen.jobs.credibility.convergence import Convergence
from bridgegen.jobs.credibility.items import ASKED, CHAPTERS, FORM, ORACLES, SOURCES

pytestmark = pytest.mark.thorough


def items(found) -> dict:
    return {item.id: item for item in found.dossier.items}


def value(found, name: str) -> float:
    return next(one.value for one in found.dossier.numbers if one.id == name)


@pytest.fixture(scope="module")
def dossier(made, tmp_path_factory):
    """The dossier of all runs; read only."""
    return bg.export_credibility([*made.values()], out=tmp_path_factory.mktemp("dossier") / "out")


def test_a_stranger_finds_every_figure(dossier, recomputed):
    assert recomputed(dossier.folder) == (0, [], "")
    files = {path.name for path in dossier.folder.iterdir()}
    assert files == {
        "credibility.html", "credibility.json", "gaps.txt", "measured.csv", "recompute.py",
        "recompute_real.py", "sbom.cdx.json", "validated.json", "yours.yaml",
    }  # fmt: skip


def test_it_holds_what_the_runs_say(dossier, made):
    """Counted here from the triages."""
    checks = [
        check
        for folder in made.values()
        for check in json.loads((folder / "triage.json").read_text("utf-8"))["step_checks"]
    ]
    findings = [check["at"] for check in checks if check["at"][0]["harmful"]]
    assert value(dossier, "all.findings") == len(findings) > 0
    assert value(dossier, "all.sample") == len(checks) - len(findings) > 0
    assert value(dossier, "all.same") == value(dossier, "all.checked") == len(checks)
    assert value(dossier, "all.evaluations") == 300
    harms = sorted(abs(at[0]["harm"] - at[3]["harm"]) for at in findings)
    assert harms[0] <= value(dossier, "all.error_median:harm") <= harms[-1]
    turned = [at for at in findings if len({one["harmful"] for one in at}) > 1]
    assert value(dossier, "all.findings_flips") >= len(turned)


def test_every_item_says_who_asks_and_its_chapter(dossier):
    for item in dossier.dossier.items:
        assert item.id.partition(".")[0] in CHAPTERS
        assert item.sources
        assert set(item.sources) <= SOURCES.keys()
        assert "{" not in item.claim.text
        assert item.status in ("yours", "gap") or item.claim.text
    statuses = [item.status for item in dossier.dossier.items]
    figures = dossier.dossier.figures
    assert sum(figures[name] for name in ("filled", "partly", "stated", "yours", "gap")) == len(
        statuses
    )
    assert figures["gaps"] == figures["gap"] == statuses.count("gap")
    assert all(word in SOURCES["EU"] for word in ("not read", "[R]"))


def test_its_oracles_are_tests_of_the_source():
    for _, test in ORACLES:
        path, _, name = test.partition("::")
        tree = ast.parse((ROOT / path).read_text("utf-8"))
        assert name in {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


def test_the_same_runs_give_the_same_bytes(dossier, made, tmp_path):
    base = dossier.folder.parent / "again"
    bg.export_credibility([*made.values()], out=base)
    for path in base.iterdir():
        assert path.read_bytes() == (dossier.folder / path.name).read_bytes()


def change(path: Path, old: str, new: str) -> None:
    text = path.read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), "utf-8")


def test_a_changed_figure_is_named(project, recomputed):
    found = bg.export_credibility([project], out=project / "out")
    number = next(one for one in found.dossier.numbers if one.id == "all.findings")
    data = json.loads(found.file.read_text("utf-8"))
    for one in data["numbers"]:
        if one["id"] == number.id:
            one["value"] += 1
    found.file.write_text(json.dumps(data), "utf-8")
    status, lines, _ = recomputed(found.folder)
    assert status == 1
    assert [line.split()[1] for line in lines] == ["all.findings"]


@pytest.mark.parametrize(
    ("where", "what", "named"),
    [("items", {"status": "filled"}, "status of"), ("flips", None, "hang on the time step")],
)
def test_a_changed_status_or_flip_is_named(project, recomputed, where, what, named):
    found = bg.export_credibility([project], out=project / "out")
    data = json.loads(found.file.read_text("utf-8"))
    if what:
        gap = next(item for item in data["items"] if item["status"] == "gap")
        gap |= what
    else:
        data[where].append({"run": "R1", "evaluation": 10**6, "is_finding": True, "text": ""})
    found.file.write_text(json.dumps(data), "utf-8")
    status, lines, _ = recomputed(found.folder)
    assert status == 1
    assert len(lines) == 1
    assert named in lines[0]


def test_a_changed_run_is_named(project, recomputed):
    found = bg.export_credibility([project], out=project / "out")
    with sqlite3.connect(project / "clean" / "run.sqlite") as connection:
        connection.execute("UPDATE evaluations SET status = 1 WHERE id = 3")
    connection.close()
    status, lines, _ = recomputed(found.folder)
    assert status == 1
    named = {line.removeprefix("DIFFERS").split()[0] for line in lines}
    assert {"SHA-256", "all.failed"} <= named
    assert any("clean/run.sqlite" in line for line in lines)


DAMAGE = {
    "not finished": lambda run: sql(run, "DELETE FROM run WHERE key = 'finished'"),
    "without a triage": lambda run: (run / "triage.json").unlink(),
    "a damaged triage": lambda run: (run / "triage.json").write_text('{"step_checks": 1}'),
    "a damaged database": lambda run: (run / "run.sqlite").write_bytes(b"SQLite format 3\0" * 99),
    "a later version": lambda run: sql(run, "UPDATE run SET value = '9' WHERE key = 'schema'"),
    "deep JSON": lambda run: (run / "triage.json").write_text("[" * 100_000),
    "a link out of it": lambda run: link(run),
    "a pipe": lambda run: pipe(run),
}


def sql(run: Path, text: str) -> None:
    with sqlite3.connect(run / "run.sqlite") as connection:
        connection.execute(text)
    connection.close()


def link(run: Path) -> None:
    secret = run.parents[1] / "secret.json"
    (run / "triage.json").rename(secret)
    (run / "triage.json").symlink_to(secret)


def pipe(run: Path) -> None:
    import os

    (run / "triage.json").unlink()
    os.mkfifo(run / "triage.json")


@pytest.mark.parametrize("what", DAMAGE)
def test_what_cannot_be_read_is_a_gap_and_the_rest_goes_on(project, recomputed, what):
    DAMAGE[what](project / "hangs")
    # What another run lacks comes after that.
    data = json.loads((project / "clean" / "triage.json").read_text("utf-8")) | {"step_checks": []}
    (project / "clean" / "triage.json").write_text(json.dumps(data), "utf-8")
    found = bg.export_credibility([project], out=project / "out")
    assert [run.scenario for run in found.dossier.runs] == ["cut-in", "crossroads-s4"]
    gap = found.dossier.gaps[0]
    assert gap.place == str(project / "hangs")
    assert gap.why
    assert "hangs" in (found.folder / "gaps.txt").read_text("utf-8")
    assert items(found)["1.3"].status == "partly"
    assert not found.judged()[0].holds
    assert found.judged()[0].details == gap.why
    assert "1 run of 3 could not be read" in found.shown()[0]
    assert recomputed(found.folder)[0] == 0


def test_if_no_run_can_be_read_everything_is_a_gap(project, recomputed):
    for run in ("hangs", "random", "clean"):
        (project / run / "triage.json").write_text("{}")
    found = bg.export_credibility([project], out=project / "out")
    assert found.dossier.figures["unread"] == 3
    assert items(found)["6.1"].status == "gap"
    assert recomputed(found.folder)[0] == 0


def test_a_triage_without_finer_steps_is_named(project):
    path = project / "random" / "triage.json"
    data = json.loads(path.read_text("utf-8"))
    data["step_checks"] = []
    path.write_text(json.dumps(data), "utf-8")
    found = bg.export_credibility([project], out=project / "out")
    assert "fractions of the time step" in found.dossier.gaps[0].why
    assert items(found)["6.1"].note == "2 of 3 runs have finer steps"


def test_hostile_words_are_text(project, recomputed):
    path = project / "random" / "triage.json"
    data = json.loads(path.read_text("utf-8"))
    data["ego"] = "<script>alert(1)</script> {all.runs} {0} \u202e"
    data["step_checks"][0]["at"][1]["conflict"] = "<img src=x onerror=alert(1)>"
    path.write_text(json.dumps(data), "utf-8")
    found = bg.export_credibility([project], out=project / "out")
    text = found.page.read_text("utf-8")
    assert "<script>alert" not in text
    assert "<img" not in text
    assert "&lt;script&gt;alert(1)" in text
    shares = [line.text for line in items(found)["9.1"].details]
    assert any("<script>alert(1)</script> (all.runs) (0)" in line for line in shares)
    assert len(shares) == 3
    assert recomputed(found.folder)[0] == 0


def test_what_people_write_is_kept_and_shown(project):
    found = bg.export_credibility([project], out=project / "out")
    form = found.folder / "yours.yaml"
    assert yaml.safe_load(form.read_text("utf-8")) == dict.fromkeys(FORM, "")
    assert items(found)["1.1"].status == "yours"
    before = found.dossier.figures
    change(form, 'purpose: ""', 'purpose: "release <b>7</b>"  # mine')
    written = form.read_bytes()
    found = bg.export_credibility([project], out=project / "out")
    assert form.read_bytes() == written
    assert items(found)["1.1"].status == "stated"
    assert items(found)["1.1"].claim.text == "release <b>7</b>"
    assert "release &lt;b&gt;7&lt;/b&gt;" in found.page.read_text("utf-8")
    after = found.dossier.figures
    assert (after["stated"], after["yours"]) == (1, before["yours"] - 1)


@pytest.mark.parametrize(
    "text", ["- 1\n", "other: a\n", "purpose: 3\n", f"purpose: {'a' * 5000}\n"]
)
def test_a_damaged_form_is_one_clear_error(made, tmp_path, text):
    (tmp_path / "yours.yaml").write_text(text)
    with refuses(FileFormatError):
        bg.export_credibility([made["clean"]], out=tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["yours.yaml"]


def test_sensitivity_of_a_run_fills_its_item(project, recomputed):
    (project / "random" / "sensitivity.json").write_text("{}")
    found = bg.export_credibility([project], out=project / "out")
    assert items(found)["7.1"].status == "partly"
    assert any(one.file.endswith("sensitivity.json") for one in found.dossier.evidence)
    assert recomputed(found.folder)[0] == 0


RECORDED = """\
exposure_of: cut-in
exposure:
  source: By hand.
  others: default
  parameterisation:
    source: "a recording {all.runs}"
    events: 12
    agreement: {failure: {reference: {both: 3, replay: 1, twin: 0, neither: 8}}}
    given_back: {failure: {initial acceleration: 0}}
"""


def test_recorded_twins_of_a_run_fill_their_items(project, recomputed):
    path = project / "clean" / "exposure.yaml"
    path.write_text(RECORDED, "utf-8")
    found = bg.export_credibility([project], out=project / "out")
    says = "changes 8.3 % of the verdicts (failure, 1 of 12"
    for name in ("8.2", "9.5"):
        assert items(found)[name].status == "partly"
        assert any(says in one.text for one in items(found)[name].details)
    assert value(found, "all.recorded") == 1
    assert recomputed(found.folder)[0] == 0
    path.write_text(RECORDED.replace("parameterisation", "parameters"), "utf-8")
    assert recomputed(found.folder)[0] == 1


def test_a_damaged_exposure_is_named(project):
    (project / "clean" / "exposure.yaml").write_text(RECORDED.replace("12", "13"), "utf-8")
    found = bg.export_credibility([project], out=project / "out")
    assert found.dossier.unread == 1
    assert "exposure.yaml" in found.dossier.gaps[0].why
    assert items(found)["8.2"].status == "gap"


def test_places_that_are_refused(made, tmp_path):
    with refuses(InputError):
        bg.export_credibility([])
    with refuses(StorageError):
        bg.export_credibility([tmp_path / "nowhere"])
    with refuses(StorageError):
        bg.export_credibility([tmp_path])
    with refuses(InputError):
        bg.export_credibility([made["clean"]], out=made["random"])
    (tmp_path / "credibility.html").write_text("somebody's")
    with refuses(StorageError):
        bg.export_credibility([made["clean"]], out=tmp_path)


def test_the_command(cli, made, tmp_path):
    words = ["credibility", *map(str, made.values()), "--out", str(tmp_path / "out")]
    code, out, err = cli(*words, "--fail-if", "gap > 100", "--fail-if", "unread > 0")
    assert code == 0
    assert "passed: the runs could be read (3 runs)" in err
    assert "items are filled by figures" in out
    code, out, err = cli(*words, "--json", "--fail-if", "gap >= 1")
    assert code == 3
    assert "FAILED: not gap >= 1 (gap = 9)" in err
    assert json.loads(out)["figures"]["runs"] == 3


def test_items_have_ids_in_order_and_keys_of_their_own():
    ids = [item.id for item in ASKED]
    assert ids == sorted(set(ids), key=lambda id: [int(part) for part in id.split(".")])
    assert len(FORM) == sum(bool(item.form) for item in ASKED)


def test_another_simulator_fills_validation(project, recomputed):
    """Two exported scenarios are critical there, one is not, one did not run."""
    confirmed_in_double(project / "hangs", [True, True, False, None])
    found = bg.export_credibility([project], out=project / "out")
    assert items(found)["8.1"].status == items(found)["9.3"].status == "filled"
    (line,) = items(found)["8.1"].details
    assert line.text.startswith(
        "2 of 3 are critical in double, too; 95 % interval 9.42 % to 99.2 %"
    )
    assert recomputed(found.folder)[0] == 0


def test_errors_are_those_that_the_definition_gives():
    """q = 1 + h: first order; its extrapolation is exact. A series that swings has no order."""
    first = Convergence.of([1.8, 1.4, 1.2, 1.1])
    assert (first.order, first.error) == (pytest.approx(1.0), pytest.approx(0.7))
    assert first.extrapolated == pytest.approx(0.8)
    assert first.gci == pytest.approx(1.25 * 0.8)
    second = Convergence.of([1.64, 1.16, 1.04, 1.01])
    assert (second.order, second.extrapolated) == (pytest.approx(2.0), pytest.approx(0.64))
    swings = Convergence.of([1.0, 0.9, 1.1, 1.0])
    assert swings.order is None
    assert swings.gci == pytest.approx(3 * swings.extrapolated) == pytest.approx(3 * 0.1)


def test_a_simulator_in_which_nothing_ran_fills_nothing(project, recomputed):
    confirmed_in_double(project / "hangs", [None, None])
    found = bg.export_credibility([project], out=project / "out")
    assert items(found)["8.1"].status == "gap"
    assert recomputed(found.folder)[0] == 0


def test_a_run_that_is_not_read_fails_the_command(cli, project):
    (project / "hangs" / "triage.json").unlink()
    code, _, err = cli("credibility", str(project), "--out", str(project / "out"))
    assert code == 3
    assert "NOT JUDGED: the runs could be read" in err
    assert "triage.json is missing" in err
