"""What is written, and one clear error for each run that nothing can be argued of."""

import hashlib
import json
import sqlite3
from pathlib import Path

import jsonschema
import pytest
from tests.approval import refuses

import bridgegen as bg
from bridgegen.base.errors import FileFormatError, InputError, StorageError
from bridgegen.jobs.safety_case.model import SafetyCase, json_schema


def forget(folder: Path, sql: str) -> None:
    with sqlite3.connect(folder / "run.sqlite") as connection:
        connection.execute(sql)
    connection.close()


def test_the_same_run_gives_the_same_bytes(case):
    found = case("fails")
    first = {path.name: path.read_bytes() for path in found.folder.iterdir()}
    again = bg.export_safety_case([found.folder.parent])
    assert {path.name: path.read_bytes() for path in again.folder.iterdir()} == first
    assert sorted(first) == ["recompute.py", "safety-case.html", "safety-case.json"]


def test_what_is_written_is_by_its_schema(cases):
    schema = json_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    for one in cases.values():
        data = one.file.read_bytes()
        jsonschema.Draft202012Validator(schema).validate(json.loads(data))
        assert SafetyCase.model_validate_json(data) == one.case


def test_evidence_is_what_is_there(cases):
    for one in cases["fails"].case.evidence:
        data = (cases["fails"].folder / one.file).read_bytes()
        assert (one.bytes, one.sha256) == (len(data), hashlib.sha256(data).hexdigest())


UNFIT = {
    "not finished": (
        lambda run: forget(run, "DELETE FROM run WHERE key = 'finished'"),
        InputError, "must be finished, it has 200 of 200 evaluations; finish it: bridgegen resume",
    ),
    "without a triage": (
        lambda run: (run / "triage.json").unlink(), InputError, "triage.json is missing",
    ),
    "with a damaged triage": (
        lambda run: (run / "triage.json").write_text("{}"), FileFormatError, "bridgegen resume",
    ),
    "with another run's triage": (
        lambda run: (run / "triage.json").write_text(
            (run / "triage.json").read_text().replace('"results":"', '"results":"0')
            .replace('"results": "', '"results": "0')
        ),
        FileFormatError, "other evaluations than the run's",
    ),
    "damaged": (
        lambda run: (run / "run.sqlite").write_bytes(b"SQLite format 3\0" + bytes(5000)),
        StorageError, "run.sqlite",
    ),
    "of a later version": (
        lambda run: forget(run, "UPDATE run SET value = '9' WHERE key = 'schema'"),
        StorageError, "the store's schema must be at most",
    ),
    "no run": (lambda run: (run / "run.sqlite").unlink(), StorageError, "contains no run"),
}  # fmt: skip


@pytest.mark.parametrize("what", UNFIT)
def test_a_run_that_is_unfit_is_one_clear_error(run, what):
    folder = run("fails")
    spoil, kind, said = UNFIT[what]
    spoil(folder)
    with pytest.raises(kind) as error:
        bg.export_safety_case([folder])
    (problem,) = error.value.problems
    assert said in problem
    assert str(folder) in problem
    assert not (folder / "safety-case").exists()


def test_a_run_that_is_being_written_is_one_clear_error(run):
    folder = run("fails")
    connection = sqlite3.connect(folder / "run.sqlite")
    connection.execute("PRAGMA journal_mode = WAL")
    connection.execute("UPDATE evaluations SET seconds = 0")
    connection.commit()
    try:
        with refuses(StorageError):
            bg.export_safety_case([folder])
    finally:
        connection.close()


def test_a_triage_of_an_earlier_version_is_to_be_made_again(run, edited):
    folder = run("fails")
    edited(folder / "triage.json", lambda data: data.pop("fresh"))
    with refuses(InputError):
        bg.export_safety_case([folder])


def test_each_run_is_given_once_and_one_at_least(run, tmp_path):
    folder = run("clean")
    with refuses(InputError):
        bg.export_safety_case([folder, tmp_path / "clean" / ".." / "clean"])
    with refuses(InputError):
        bg.export_safety_case([])
    with refuses(InputError):
        bg.export_safety_case([folder], out=folder)


def test_names_from_a_record_lead_nowhere_else(run, edited):
    """An untrusted triage names no file outside its run's folder."""
    folder = run("fails")
    (folder.parent / "secret.json").write_text("{}", "utf-8")

    def elsewhere(data):
        for mode in data["modes"]:
            mode["exports"] = ["../../secret"]

    edited(folder / "triage.json", elsewhere)
    files = {one.file for one in bg.export_safety_case([folder]).case.evidence}
    assert not [one for one in files if "secret" in one]


def test_the_command(cli, run, tmp_path):
    folder = run("judged")
    code, out, err = cli("safety-case", str(folder), "--out", str(tmp_path / "case"))
    assert (code, err) == (0, "")
    assert "G1.5.1" not in out
    assert "not supported" in out
    assert str(tmp_path / "case" / "safety-case.html") in out
    code, out, err = cli("safety-case", str(folder), "--json")
    goals = {one["goal"]: one["status"] for one in json.loads(out)}
    assert (goals["G1"], goals["G1.3"]) == ("not supported", "supported")
    code, out, err = cli("safety-case", str(tmp_path / "nowhere"))
    assert (code, out) == (2, "")
    assert err.count("\n") == 1
    code, out, err = cli("validate", "--schema", "safety-case")
    assert json.loads(out)["$id"] == "urn:bridgegen:safety-case"
