"""Runs and files held against criteria, from the command line to the XML."""

import json
import re
from dataclasses import fields
from xml.etree import ElementTree

import pytest
from tests.approval import approve, refuses

import bridgegen as bg
from bridgegen.assess.cause import CAUSES
from bridgegen.base.errors import InputError
from bridgegen.cli.verdict.of_run import FIGURES, PassFailCriteria, figures_of
from bridgegen.results.store.summary import Summary


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> "bg.Run":
    folder = tmp_path_factory.mktemp("verdict") / "s4"
    return bg.run_search("crossroads-s4", budget=60, keep=2, triage="short", out=folder)


def test_every_figure_of_the_summary_can_be_named():
    figures = {one.name for one in fields(Summary)} - {"causes"}
    triage = {"modes", "robust", "worst_severity", "harmful.upper", "stuck"}
    assert {*FIGURES} == figures | triage | {one.label.replace(" ", "_") for one in CAUSES}


def test_a_run_s_figures_are_its_rows(run):
    frame, figures = run.frame(), figures_of(run)
    assert figures["critical"] == frame.critical.sum() > 0
    assert figures["r_critic"] == frame.critical.mean()
    assert figures["first"] == frame.critical.to_numpy().argmax() + 1
    assert figures["fiftieth"] == float("inf")
    assert sum(figures[one.label.replace(" ", "_")] for one in CAUSES) == frame.critical.sum()
    assert figures["d_min_best"] == frame.d_min.min()


def test_search_and_resume_end_with_the_verdict(cli, tmp_path):
    folder = tmp_path / "run"
    words = ("search", "crossroads-s4", "--budget", 120, "--keep", 2, "--triage", "none")
    words = (*words, "--out", folder)
    code, out, err = cli(*words, "--fail-if", "critical > 0", "--junit", folder / "j.xml")
    assert code == 3
    assert "report" in out  # the run itself is whole
    approve(err, "critical")
    root = ElementTree.parse(folder / "j.xml").getroot()
    assert int(root.get("failures")) == 3  # the criterion, and the two scenarios that break it
    words = ("resume", folder, "--junit", folder / "j.xml")
    code, _, err = cli(*words, "--fail-if", "critical > 120", "--fail-if", "failed>0")
    assert code == 0
    assert err.count("passed: ") == 3
    root = ElementTree.parse(folder / "j.xml").getroot()
    assert (root.get("failures"), root.get("errors"), root.get("tests")) == ("0", "0", "5")
    assert cli("resume", folder)[0] == 0


def test_the_xml_tells_what_a_person_needs(run, tmp_path):
    PassFailCriteria.read(["r_critic > 0.01"], tmp_path / "j.xml").judge(run)
    root = ElementTree.parse(tmp_path / "j.xml").getroot()
    criteria, *scenarios = root
    facts = {one.get("name"): one.get("value") for one in criteria.iter("property")}
    assert facts["ego"] == "route-follower"
    assert facts["command"] == run.settings.command(run.folder)
    assert len(scenarios) == len(run.scenarios) == 2
    for suite, path in zip(scenarios, run.scenarios, strict=True):
        kept = json.loads(path.with_suffix(".json").read_text("utf-8"))
        told = {one.get("name"): one.get("value") for one in suite.iter("property")}
        for name, one in {**kept["metrics"], **kept["parameters"]}.items():
            value = "inf" if one["value"] is None else f"{one['value']:.6g}"
            assert told[name].split()[0] == value
        failure = suite.find("testcase/failure")
        assert f"cause: {kept['cause']}" in failure.get("message")
        approve(failure.text, "r_critic", "0.01", path)


def test_only_who_is_to_blame_fails(run, tmp_path):
    causes = [json.loads(p.with_suffix(".json").read_text("utf-8"))["cause"] for p in run.scenarios]
    for cause in {*causes}:
        PassFailCriteria.read([f"{cause} > 0"], tmp_path / "j.xml").judge(run)
        root = ElementTree.parse(tmp_path / "j.xml").getroot()
        assert len([*root.iter("failure")]) == 1 + causes.count(cause)
    PassFailCriteria.read(["evaluations < 1000"], tmp_path / "j.xml").judge(run)
    assert ElementTree.parse(tmp_path / "j.xml").getroot().get("failures") == "1"


def test_what_nobody_knows_is_no_pass(tmp_path):
    """A driver that fails in every scenario brings about no harm, and is not safe."""
    driver = tmp_path / "broken.py"
    driver.write_text(
        "class Broken:\n"
        "    def reset(self, n, scene): pass\n"
        "    def act(self, observation): raise ValueError('no map <&')\n"
    )
    with pytest.raises(InputError, match="no map <&"):
        bg.run_search(
            "crossroads-s4", ego=f"{driver}:Broken", budget=3, algorithm="random", causes=False,
            triage="short", out=tmp_path / "run",
        )  # fmt: skip
    run = bg.Run(tmp_path / "run")
    outcomes = PassFailCriteria.read(["critical > 0", "failed > 3"], tmp_path / "j.xml").judge(run)
    assert [one.verdict for one in outcomes] == ["unknown", "unknown", "passed"]
    root = ElementTree.parse(tmp_path / "j.xml").getroot()
    assert root.get("errors") == "2"
    assert "no map <&" in root.find(".//error").text


def test_mistakes_are_found_before_anything_runs(cli, tmp_path, run):
    def refused(*words: object, message: str) -> None:
        code, _, err = cli(*words)
        assert (code, "Traceback" in err) == (2, False)
        assert message in err

    search = ("search", "crossroads-s4", "--out", tmp_path / "run")
    refused(*search, "--fail-if", "r_critic", message="--fail-if must read")
    refused(*search, "--fail-if", "d_min<2", message="unknown figure of --fail-if 'd_min'")
    refused(*search, "--no-causes", "--fail-if", "planning > 0", message="not determine causes")
    refused(*search, "--junit", __file__, message="is not JUnit XML")
    assert not (tmp_path / "run").exists()
    file = run.scenarios[0]
    refused("simulate", file, "--fail-if", "r_critic > 0", message="unknown figure")
    refused("simulate", file, "--fail-if", "map < 0.5", message="needs detections")
    with refuses(InputError):
        PassFailCriteria.read(["control == 0"], None, causes=False)


def test_simulate_ends_with_the_verdict(cli, tmp_path, run):
    file, junit = run.scenarios[0], tmp_path / "j.xml"
    words = ("simulate", file, "--json", "--metrics", "ttc", "--junit", junit)
    code, out, _ = cli(*words, "--fail-if", "d_min < 2 and v_d >= 1", "--fail-if", "n_brake > 99")
    assert code == 3
    assert [*json.loads(out)["metrics"]] == ["ttc", "d_min", "v_d", "n_brake"]
    root = ElementTree.parse(junit).getroot()
    assert (root.get("tests"), root.get("failures")) == ("3", "1")
    assert cli(*words, "--fail-if", "d_min > 1e4")[0] == 0


def test_criteria_are_needs_that_sphinx_needs_imports(cli, tmp_path):
    """Facts of needs.json in sphinx-needs 9.1, whose ``needimport`` took a file of this test's."""
    path, folder = tmp_path / "needs.json", tmp_path / "run"
    words = ("search", "cut-in", "--budget", 40, "--keep", 3, "--triage", "none", "--out", folder)
    words = (*words, "--ego", "route-follower", "--criterion", "R-12: always(gap to bv > 2 m)")
    cli(*words, "--criterion", "R-13: always(ego.v < 100 m/s)", "--needs", path)
    data = json.loads(path.read_bytes())
    needs = data["versions"][data["current_version"]]["needs"]
    for name, need in needs.items():
        assert name == need["id"]
        assert re.fullmatch("[A-Z0-9_]{5,}", name)  # the default of needs_id_regex
        assert need["type"] in ("req", "spec", "impl", "test")  # those of needs_types
        assert {*need["links"]} <= {*needs}
    broken, met = (needs[f"BG_CUT_IN_ROUTE_FOLLOWER_R_{n}"] for n in (12, 13))
    (criterion, other) = bg.Run(folder).criteria
    assert (broken["status"], met["status"]) == ("violated", "met")
    assert (criterion.violated > 0, other.violated) == (True, 0)
    assert float(broken["margin"].split()[0]) == pytest.approx(criterion.worst, rel=1e-3)
    assert (met["links"], broken["run"]) == ([], str(folder))
    # Its links are the exported scenarios whose margin is below 0.
    below = [
        facts.stem
        for facts in sorted((folder / "critical").glob("0*.json"))
        if json.loads(facts.read_bytes())["metrics"][criterion.criterion.quantity]["value"] < 0.0
    ]
    assert [link[-4:] for link in broken["links"]] == below
    assert below
    before = path.read_bytes()
    assert cli("resume", folder, "--needs", path)[0] == 3  # R-12 is violated
    assert path.read_bytes() == before
    path.write_text("mine")
    approve(cli("resume", folder, "--needs", path)[2], "needs.json")
