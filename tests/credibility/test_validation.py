"""The validation suite: it passes here, it fails where something is wrong, and says which."""

import importlib.util
import json
import sys
from math import inf, nan
from types import SimpleNamespace

import pytest
from tests.approval import ROOT

import bridgegen as bg
from bridgegen.engine import conformance
from bridgegen.jobs.credibility import export, validation
from bridgegen.jobs.credibility.known_answers import Case, Check, cases, data
from bridgegen.jobs.credibility.release import known_faults, release, sbom


@pytest.mark.parametrize("case", cases(), ids=lambda case: case.id)
def test_this_installation_answers_what_is_known(case):
    found = validation.result_of(case)
    assert [check for check in found["checks"] if not check["passed"]] == []
    assert len(found["checks"]) > 1


@pytest.mark.parametrize("key", ["cut-in un-r157", "lead-brakes fsm"])
def test_verdicts_have_the_published_bits(key):
    scenario, driver = key.split()
    digest = conformance.rows_digest(scenario, driver, conformance.SAMPLE, verdicts=True)
    assert conformance.published()["verdicts"][key] == digest
    assert digest != conformance.rows_digest(scenario, driver, conformance.SAMPLE)


def raises():
    yield Check("first", 1.0, 1.0)
    raise ZeroDivisionError("a fault")


CASES = {
    "passes": ("answer", lambda: iter([Check("a", 1.0, 1.0 + 1e-12), Check("b", inf, inf)]), True),
    "is wrong": ("answer", lambda: iter([Check("a", 1.0, 1.1)]), False),
    "is not a number": ("law", lambda: iter([Check("a", 1.0, nan)]), False),
    "raises": ("answer", raises, False),
    "yields nothing": ("answer", lambda: iter([]), False),
    "has other bits": ("bits", lambda: iter([Check("a", "00", "01")]), False),
}


def case_of(name: str) -> Case:
    kind, checks, _ = CASES[name]
    return Case(name[:9], "bits", kind, name, checks)


@pytest.mark.parametrize("name", CASES)
def test_a_case_passes_only_if_all_its_numbers_agree(name):
    found = validation.result_of(case_of(name))
    assert found["passed"] == CASES[name][2]
    json.dumps(found, allow_nan=False)


@pytest.fixture
def suite_of(monkeypatch):
    """Have the suite consist of some cases."""

    def make(*names: str) -> None:
        monkeypatch.setattr(validation, "every_case", lambda: [case_of(name) for name in names])

    return make


def test_the_command_needs_no_run(cli, suite_of, tmp_path):
    suite_of("passes")
    code, out, _ = cli("credibility", "--validate", "--out", str(tmp_path))
    assert code == 0
    assert "All 1 cases of the validation suite pass." in out
    protocol = json.loads((tmp_path / "validation.json").read_text("utf-8"))
    assert protocol["results"][0]["checks"][1]["expected"] == "inf"
    assert {len(protocol[name]) for name in ("package", "published", "digest")} == {64}
    assert [path.name for path in tmp_path.iterdir()] == ["validation.json"]
    assert cli("credibility", "--out", str(tmp_path))[0] == 2  # neither runs nor the suite


def test_wrong_and_different_are_two_words(cli, suite_of, tmp_path):
    suite_of("passes", "is wrong", "has other bits")
    words = ["credibility", "--validate", "--out", str(tmp_path)]
    code, out, err = cli(*words)
    assert code == 3
    assert out.startswith("Wrong answers in 1 case: is wrong. Other bits than the published ones")
    assert "expected 1.0, found 1.1" in out
    assert "the validation suite passes" in err
    code, out, _ = cli(*words, "--json", "--fail-if", "wrong > 1")
    assert code == 3
    assert [one["passed"] for one in json.loads(out)["results"]] == [True, False, False]


@pytest.mark.thorough
def test_a_wrong_answer_is_the_first_thing_that_the_dossier_says(
    suite_of, made, tmp_path, recomputed
):
    suite_of("passes", "is wrong", "has other bits")
    found = bg.export_credibility([made["clean"]], validate=True, out=tmp_path)
    assert found.shown()[0].startswith("1 case of the validation suite (5.4) has a wrong answer: ")
    (item,) = (item for item in found.dossier.items if item.id == "5.4")
    assert item.status == "partly"
    text = found.page.read_text("utf-8")
    assert "FAILS" in text
    assert "is wrong fails, known by answer" in text
    assert [part.holds for part in found.judged()] == [False, True]
    assert found.judged()[0].figures["wrong"] == found.judged()[0].figures["other_bits"] == 1
    assert recomputed(tmp_path) == (0, [], "")
    path = tmp_path / "validation.json"
    data = json.loads(path.read_text("utf-8"))
    data["results"][0]["checks"][0]["found"] = 2.0
    path.write_text(json.dumps(data), "utf-8")
    status, lines, _ = recomputed(tmp_path)
    assert status == 1
    assert [line.split()[1] for line in lines] == ["all.cases_wrong"]


@pytest.mark.thorough
def test_a_dossier_without_the_suite_says_so(made, tmp_path):
    found = bg.export_credibility([made["clean"]], out=tmp_path)
    (item,) = (item for item in found.dossier.items if item.id == "5.4")
    assert (item.status, item.again) == ("gap", "bridgegen credibility RUN --validate")


def test_each_feature_has_its_cases_and_a_proposal_to_people(made, tmp_path):
    features = data()["features"]
    assert {case.feature for case in validation.every_case()} == features.keys()
    found = bg.export_credibility([made["clean"]], out=tmp_path)
    (item,) = (item for item in found.dossier.items if item.id == "2.3")
    assert item.status == "yours"
    assert len(item.details) == 1 + len(features)
    assert all("TI2" in line.text and ": TD" in line.text for line in item.details[1:])


# Injected faults.


@pytest.fixture(scope="module")
def faults():
    spec = importlib.util.spec_from_file_location("faults", ROOT / "tools" / "faults.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules["faults"] = module
    spec.loader.exec_module(module)
    return module


def test_no_fault_has_rotted(faults):
    """Each text is in its file exactly once, and what replaces it is Python."""
    names = [fault.name for fault in faults.FAULTS]
    assert len(names) == len(set(names)) >= 20
    for fault in faults.FAULTS:
        text = (faults.PACKAGE / fault.file).read_text("utf-8")
        assert text.count(fault.text) == 1, fault.name
        compile(text.replace(fault.text, fault.replaced), fault.file, "exec")


def test_the_release_says_of_each_fault_what_sees_it(faults):
    found = release()["faults"]
    assert [row["name"] for row in found] == [fault.name for fault in faults.FAULTS]
    ids = {case.id: case.kind for case in validation.every_case()}
    assert all(ids.get(row["case"], "end" if row["case"] else "") == row["kind"] for row in found)
    assert sum(bool(row["kind"]) for row in found) >= 0.9 * len(found)


# Known faults, and what is installed.


def test_known_faults_are_those_of_the_versions_of_the_runs():
    every = known_faults(["0.1.0"])
    assert len({fault["id"] for fault in every}) == len(every) >= 6
    assert known_faults(["99.0"]) == known_faults([]) == []
    assert known_faults(["no version"]) == every


def test_the_bill_of_materials_names_what_is_installed():
    found = json.loads(sbom())
    assert (found["bomFormat"], found["specVersion"], found["version"]) == ("CycloneDX", "1.6", 1)
    parts = {one["name"].lower(): one for one in found["components"]}
    assert parts["numpy"]["version"] == __import__("numpy").__version__
    assert parts["numpy"]["purl"].startswith("pkg:pypi/numpy@")
    assert parts["numpy"]["licenses"]
    assert len(parts["numpy"]["hashes"][0]["content"]) == 64
    refs = [one["bom-ref"] for one in found["components"]]
    assert refs == sorted(set(refs))
    assert sbom() == sbom()


def test_hostile_metadata_is_text(monkeypatch):
    from bridgegen.jobs.credibility import release as module

    class About(dict):
        get = dict.get

    item = SimpleNamespace(
        metadata=About(Name="a b/../<script>", License="x" * 9999 + "\ny"), version="1\n",
        read_text=lambda name: None,
    )  # fmt: skip
    monkeypatch.setattr(module, "distributions", lambda: [item])
    (part,) = json.loads(module.sbom())["components"]
    assert part["purl"] == "pkg:pypi/a%20b%2F-%2F%3Cscript%3E@1%0A"
    assert len(part["licenses"][0]["license"]["name"]) == 200


def test_it_is_cyclonedx_by_its_schema():
    outcomes = pytest.importorskip("cyclonedx.validation.json")
    from cyclonedx.schema import SchemaVersion

    validator = outcomes.JsonStrictValidator(SchemaVersion.V1_6)
    assert validator.validate_str(sbom().decode()) is None


def test_the_suite_is_run_only_if_asked_for(made, tmp_path, monkeypatch):
    monkeypatch.setattr(export, "validate", lambda callbacks: pytest.fail("not asked for"))
    bg.export_credibility([made["clean"]], out=tmp_path)
    assert not (tmp_path / "validation.json").exists()
    assert (tmp_path / "sbom.cdx.json").is_file()
