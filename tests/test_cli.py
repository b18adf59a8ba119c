"""The command line as a person meets it: what it prints, and how it refuses."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve

import bridgegen as bg


@pytest.fixture(scope="session")
def finished(tmp_path_factory) -> "bg.Run":
    folder = tmp_path_factory.mktemp("runs") / "s4"
    return bg.run_search(
        "crossroads-s4", algorithm="pso", budget=300, keep=2, triage="short", out=folder
    )


@pytest.fixture
def s4_file(tmp_path) -> Path:
    """A scenario file of the user's own."""
    import bridgegen.scenario.catalogue as catalogue

    folder = Path(catalogue.__file__).parent
    for path in folder.glob("*.yaml"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    return tmp_path / "crossroads-s4.yaml"


def refused(result: tuple[int, str, str], *parts: str) -> None:
    code, _, err = result
    assert code == 2
    assert "Traceback" not in err
    for part in parts:
        assert part in err, err


def test_search_prints_the_run_s_figures(cli, tmp_path):
    code, out, _ = cli(
        "search", "crossroads-s4", "--budget", 80, "--keep", 1, "-v", "--out", tmp_path / "r"
    )
    assert code == 0
    for figure in ("R_critic", "d_min", "v_d"):
        assert figure in out
    assert str(tmp_path / "r" / "report.html") in out


def test_compare_prints_tables_and_words(cli, tmp_path):
    words = ("benchmark", "algorithms", "crossroads-s4", "--algorithms", "random, pso")
    words += ("--seeds", 2, "--budget", 60)
    words += ("--set", "pso.population=20", "--workers", 1, "--out", tmp_path / "c")
    code, out, err = cli(*words)
    assert code == 0, err
    for measure in ("R_critic", "A12", "T_critic", "hypervolume"):
        assert measure in out
    assert "pso" in out
    assert str(tmp_path / "c" / "compare.html") in out
    refused(
        cli(*words[:-1], tmp_path / "d", "--set", "w=3"), "--set must read ALGORITHM.NAME=VALUE"
    )
    refused(cli(*words, "--ego", "reference"), "with other settings", "ego was null")


def test_simulate_prints_what_the_store_holds(cli, finished):
    path = finished.scenarios[0]
    code, out, _ = cli("simulate", path, "--json")
    facts = json.loads(out)
    recorded = json.loads(path.with_suffix(".json").read_text("utf-8"))
    assert code == 0
    assert facts["status"] == "ok"
    kept = {name: one["value"] for name, one in recorded["metrics"].items()}
    assert {name: facts["metrics"][name] for name in kept} == kept
    code, out, _ = cli("simulate", path)
    assert code == 0
    assert f"{facts['metrics']['v_d']:.6g} m/s" in out  # to the last bit: --json


def test_simulate_some_metrics(cli, finished):
    path = finished.scenarios[0]
    code, out, _ = cli("simulate", path, "--metrics", "v_d, d_min", "--json")
    assert (code, list(json.loads(out)["metrics"])) == (0, ["v_d", "d_min"])
    refused(cli("simulate", path, "--metrics", "dmin"), "unknown metric 'dmin'; did you mean")
    result = cli("simulate", path, "--ego", "route-follower", "--metrics", "map")
    refused(result, "the metric 'map' needs detections, and the driver 'route-follower' has none")


def test_simulate_leaves_out_what_it_must(cli, finished, tmp_path):
    path = finished.scenarios[0]
    mine = tmp_path / "mine.xosc"
    hover = "<GlobalAction><HoverAction/></GlobalAction>"
    mine.write_text(path.read_text("utf-8").replace("<Actions>", f"<Actions>{hover}", 1), "utf-8")
    for one in path.parent.glob("*.xodr"):
        (tmp_path / one.name).write_bytes(one.read_bytes())
    refused(cli("simulate", mine), "HoverAction in GlobalAction is not supported")
    code, out, err = cli("simulate", mine, "--lenient", "--json")
    assert code == 0
    approve(err, "warning", "HoverAction", "GlobalAction")
    whole = cli("simulate", path, "--json")[1]
    assert json.loads(out)["metrics"] == json.loads(whole)["metrics"]


@pytest.mark.parametrize("flavour", ["1.2", "1.3", "resolved", "recorded"])
def test_export_prints_what_it_wrote(cli, finished, flavour):
    code, out, _ = cli("export", finished.folder, "--flavour", flavour, "--scenario", "0001")
    assert code == 0
    paths = [Path(line) for line in out.splitlines()]
    assert [path.name for path in paths] == ["0001.xosc", "0001.xodr"]
    assert paths[0].parent == finished.folder / "export" / flavour
    _, before, _ = cli("simulate", finished.scenarios[0], "--json")
    _, after, _ = cli("simulate", paths[0], "--json")
    before, after = (json.loads(text)["metrics"] for text in (before, after))
    assert before["d_min"] == after["d_min"]
    assert before["v_d"] == pytest.approx(after["v_d"], abs=1e-6)


def test_export_for_scenario_runner_names_its_controller(cli, finished, tmp_path):
    words = ("export", finished.folder, "--flavour", "carla", "--out", tmp_path)
    code, out, _ = cli(*words, "--scenario", "0001")
    assert code == 0
    names = [Path(line).name for line in out.splitlines()]
    assert names == ["0001.xosc", "0001.xodr", "bridgegen_control.py"]
    code, out, _ = cli(*words, "--scenario", "0001", "--town", "Town05")
    assert code == 0
    assert [Path(line).name for line in out.splitlines()] == ["0001.xosc", "bridgegen_control.py"]
    assert '<LogicFile filepath="Town05"/>' in (tmp_path / "0001.xosc").read_text()


def test_export_refuses(cli, finished, tmp_path):
    refused(
        cli("export", finished.folder, "--flavour", "1.2", "--town", "Town05"),
        "for the flavour 'carla' only",
    )
    refused(cli("export", finished.folder, "--flavour", "record"), "did you mean 'recorded'")
    refused(cli("export", tmp_path / "no", "--flavour", "1.3"), "there is no such folder")
    refused(
        cli("export", finished.folder, "--flavour", "1.3", "--scenario", "1"), "scenario of", "0001"
    )
    path = cli("export", finished.folder, "--flavour", "recorded")[1].splitlines()[0]
    refused(cli("simulate", path, "--ego", "reference"), "'reference' cannot drive an ego")


def test_simulate_with_another_driver(cli, finished):
    path = finished.scenarios[0]
    _, out, _ = cli("simulate", path, "--json", "--ego", "reference")
    assert json.loads(out)["ego"] == "reference"
    assert json.loads(out)["metrics"]["n_collision"] == 0.0


def test_ask(cli, finished):
    owl = finished.scenarios[0].with_suffix(".owl")
    code, out, _ = cli("ontology", "ask", owl, "driver", "--json")
    drivers = {one["participant"]: one["driver"] for one in json.loads(out)}
    assert (code, drivers) == (0, {"bv": "insistent", "ego": "route-follower"})
    code, out, _ = cli("ontology", "ask", owl)
    assert code == 0
    approve(out, "weather")
    refused(cli("ontology", "ask", owl, "wether"), "did you mean 'weather'?")
    refused(
        cli("ontology", "ask", owl, "--sparql", owl.with_suffix(".rq")),
        "cannot be read: no such file",
    )


def test_ask_prints_brackets_as_they_are(cli, finished, tmp_path):
    own = tmp_path / "own.rq"
    own.write_text('SELECT ?a ?b { BIND("[red]x[/y] :car:" AS ?a) BIND(1.5e0 AS ?b) }', "utf-8")
    code, out, _ = cli(
        "ontology", "ask", finished.scenarios[0].with_suffix(".owl"), "--sparql", own
    )
    assert code == 0
    assert out.splitlines()[1].split() == ["[red]x[/y]", ":car:", "1.5"]


def test_validate_with_the_reasoner(cli, finished, monkeypatch):
    from bridgegen.scenario.ontology import reasoner

    owl = finished.scenarios[0].with_suffix(".owl")
    monkeypatch.setattr(reasoner, "find_spec", lambda name: None)
    refused(cli("validate", "--reason", owl), "pip install 'bridgegen[reasoner]'")
    monkeypatch.setattr(reasoner, "require", lambda: None)
    said = reasoner.Reasoned(False, ("bv is a Car", "bv is a Lane"), (), {})
    monkeypatch.setattr(reasoner, "reason", lambda path: said)
    refused(cli("validate", "--reason", owl), str(owl), "bv is a Car; bv is a Lane")


def test_every_handed_over_file_is_valid(cli, finished):
    files = [p for p in sorted((finished.folder / "critical").iterdir()) if p.suffix != ".json"]
    code, out, _ = cli("validate", *files)
    assert code == 0
    exported = [*finished.scenarios, *finished.minimal_scenarios]
    assert out.count(": valid") == len(files) == 3 * len(exported)
    assert len(finished.scenarios) == 2


def test_convert_gives_back_the_handed_over_files(cli, finished, tmp_path):
    owl = finished.scenarios[0].with_suffix(".owl")
    code, out, err = cli("export", "--flavour", "xosc", owl, "--out", tmp_path)
    assert (code, err) == (0, "")
    for kind in (".xodr", ".xosc"):
        assert str(tmp_path / f"0001{kind}") in out
        assert (tmp_path / f"0001{kind}").read_bytes() == owl.with_suffix(kind).read_bytes()


@pytest.mark.parametrize(
    ("option", "message"),
    [
        (["--bins", 0], "1 <= bins <= 1000 must hold, got 0"),
        (["--strength", 4], "1 <= strength <= 3 must hold, got 4"),
    ],
)
def test_coverage_has_its_limits(cli, finished, option, message):
    refused(cli("analyse", "coverage", finished.folder, *option), message)


def test_an_edited_ontology_converts_to_an_edited_scenario(cli, finished, tmp_path):
    """As after a change in Protégé: the individual's value is the file's value."""
    owl = finished.scenarios[0].with_suffix(".owl")
    facts = json.loads(owl.with_suffix(".json").read_text("utf-8"))
    value = repr(facts["parameters"]["bv_speed"]["value"])
    text = owl.read_text("utf-8")
    assert text.count(f">{value}<") == 1
    edited = tmp_path / "edited.owl"
    edited.write_text(text.replace(f">{value}<", ">1.25<"), "utf-8")
    code, _, _ = cli("export", "--flavour", "xosc", edited)
    assert code == 0
    assert 'name="bv_speed" parameterType="double" value="1.25"' in (
        tmp_path / "edited.xosc"
    ).read_text("utf-8")
    assert cli("simulate", tmp_path / "edited.xosc")[0] == 0


@pytest.mark.parametrize(
    ("what", "expected"),
    [
        (["scenarios"], "crossroads-s1"),
        (["algorithms"], "pso"),
        (["drivers"], "un-r157"),
        (["metrics"], "d_min"),
        (["sight"], "fog 200 m"),
        (["parameters", "crossroads-s4"], "bv_trigger_distance"),
    ],
)
def test_lists(cli, what, expected):
    code, out, _ = cli("list", *what, "--json")
    assert code == 0
    assert expected in {next(iter(row.values())) for row in json.loads(out)}
    assert expected in cli("list", *what)[1]


def test_coverage_counts_what_the_store_holds(cli, finished):
    code, out, _ = cli(
        "analyse", "coverage", finished.folder, "--bins", 4, "--strength", 2, "--json"
    )
    facts = json.loads(out)
    frame = finished.frame()
    assert code == 0
    assert (facts["evaluations"], facts["critical"]) == (300, int(frame.critical.sum()))
    assert [way["strength"] for way in facts["ways"]] == [1, 2]
    assert facts["ways"][1]["total"] == 45 * 16
    (speed,) = [one for one in facts["parameters"] if one["name"] == "ego_speed"]
    counts, _ = np.histogram(frame.ego_speed, speed["edges"])
    assert speed["evaluated"] == counts.tolist()
    assert sum(speed["critical"]) == facts["critical"]
    code, out, _ = cli("analyse", "coverage", finished.folder, "--bins", 4, "--strength", 2)
    assert code == 0
    for text in ("of feasible", "720", "ego_speed", "participants, 4.9 to 8.9 m/s"):
        assert text in out
    assert f"{counts[0]}/{speed['critical'][0]}" in out


def test_coverage_of_a_changed_scenario_is_refused(cli, tmp_path, s4_file):
    folder = tmp_path / "run"
    bg.run_search(s4_file, algorithm="random", budget=10, keep=0, triage="short", out=folder)
    assert cli("analyse", "coverage", folder)[0] == 0
    s4_file.write_text(s4_file.read_text("utf-8").replace("title: ", "title: Not "), "utf-8")
    refused(cli("analyse", "coverage", folder), "is not what it was")


def test_a_run_folder_is_never_overwritten(cli, finished):
    result = cli("search", "crossroads-s4", "--out", finished.folder)
    refused(result, str(finished.folder), "bridgegen resume")


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (["search", "crosroads-s4"], ["unknown scenario 'crosroads-s4'", "crossroads-s4"]),
        (["search", "crossroads-s4", "--algorithm", "spo"], ["unknown algorithm 'spo'", "pso"]),
        (["search", "crossroads-s4", "--objective", "dmin=1"], ["unknown metric 'dmin'", "d_min"]),
        (["search", "crossroads-s4", "--fix", "fog"], ["--fix must read NAME=VALUE, got 'fog'"]),
        (["search", "crossroads-s4", "--fix", "fog_density=nan"], ["fog_density", "nan"]),
        (["search", "crossroads-s4", "--budget", "-3"], ["budget", "-3"]),
        (["search", "nowhere.yaml"], ["nowhere.yaml"]),
        (["search", "crossroads-s4", "--map", "nowhere.xodr"], ["nowhere.xodr"]),
        (["search", "crossroads-s4", "--ego", "route-follower", "--metrics", "pit"], ["'pit'"]),
        (
            ["search", "crossroads-s4", "--ego", "route-follower", "--objective", "iou=1"],
            ["the metric 'iou' needs detections, and the driver 'route-follower' has none"],
        ),
        (["simulate", "nowhere.xosc"], ["nowhere.xosc"]),
        (["export", "--flavour", "xosc", "nowhere.owl"], ["nowhere.owl"]),
        (["validate", "nowhere.xodr"], ["nowhere.xodr"]),
        (["validate", "pyproject.toml"], ["pyproject.toml", ".owl"]),
        (["resume", "nowhere"], ["nowhere"]),
        (["analyse", "coverage", "nowhere"], ["nowhere"]),
        (["list", "parameters", "crossroads-s9"], ["unknown scenario"]),
    ],
)
def test_a_mistake_is_one_clear_error(cli, words, parts, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pyproject.toml").touch()
    refused(cli(*words), *parts)
    assert not (tmp_path / "runs").exists()


BOMB = """<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;">]>
<{root}>&b;</{root}>"""
OUTSIDE = """<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]>
<{root}>&a;</{root}>"""


@pytest.mark.parametrize("text", [BOMB, OUTSIDE, "<{root}>", "", "not XML", "<{root}/>", "\x00"])
@pytest.mark.parametrize(
    ("suffix", "root"), [("xosc", "OpenSCENARIO"), ("xodr", "OpenDRIVE"), ("owl", "rdf:RDF")]
)
def test_hostile_and_broken_files_are_refused(cli, tmp_path, text, suffix, root):
    path = tmp_path / f"file.{suffix}"
    path.write_text(text.format(root=root) if "{root}" in text else text, "utf-8")
    result = cli("validate", path)
    refused(result, str(path))
    assert "root:" not in result[2]


def test_what_is_outside_the_supported_set_is_named_with_its_line(cli, finished, tmp_path):
    scenario = finished.scenarios[0]
    text = scenario.read_text("utf-8").replace(
        "<SpeedAction>", "<LaneChangeAction/>\n<SpeedAction>", 1
    )
    (tmp_path / "a.xosc").write_text(text, "utf-8")
    (tmp_path / "0001.xodr").write_bytes(scenario.with_suffix(".xodr").read_bytes())
    line = text[: text.index("<LaneChangeAction")].count("\n") + 1
    refused(cli("simulate", tmp_path / "a.xosc"), "LaneChangeAction", f"line {line}")


def test_an_individual_without_a_required_property_is_named(cli, finished, tmp_path):
    lines = finished.scenarios[0].with_suffix(".owl").read_text("utf-8").splitlines()
    at = max(i for i, line in enumerate(lines) if "has_wheelbase" in line)
    (tmp_path / "a.owl").write_text("\n".join(lines[:at] + lines[at + 1 :]), "utf-8")
    refused(cli("export", "--flavour", "xosc", tmp_path / "a.owl"), "has_wheelbase")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a file system that can be full")
@pytest.mark.skipif(os.name != "posix", reason="needs a POSIX limit")
def test_a_full_disk_is_one_clear_error_and_what_is_done_is_kept(tmp_path):
    """A limit on file sizes stands for the full disk: writing fails in the midst of a run."""
    code = """
import resource, sys
resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000))
import signal; signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
from bridgegen.cli import main; main()
"""
    words = ["search", "crossroads-s4", "--budget", "20000", "--out", str(tmp_path / "run")]
    done = subprocess.run(
        [sys.executable, "-c", code, *words],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    assert "bridgegen: error:" in done.stderr
    assert bg.Run(tmp_path / "run").summary.evaluations >= 40


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is full")
@pytest.mark.parametrize(
    "words", [["validate", "--schema"], ["list", "algorithms"], ["validate", "--help"]]
)
def test_an_output_that_is_full_is_one_clear_error(words):
    """What is printed at once, and what is printed when the command ends."""
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-c", "from bridgegen.cli import main; main()", *words],
            stdout=full, stderr=subprocess.PIPE, text=True, timeout=300, check=False,
        )  # fmt: skip
    message = "bridgegen: error: the output cannot be written: No space left on device\n"
    assert (done.returncode, done.stderr) == (2, message)


@pytest.mark.skipif(sys.platform != "linux", reason="needs names of any bytes")
@pytest.mark.parametrize("words", [["search", "cut-in", "--budget", "5", "--out"], ["resume"]])
def test_a_folder_whose_name_is_not_utf_8_is_one_clear_error(words, tmp_path, cli):
    folder = tmp_path / os.fsdecode(b"run\xff")
    if words == ["resume"]:
        folder.mkdir()
        (folder / "run.sqlite").touch()
    status, _, err = cli(*words, folder)
    assert (status, "Traceback" in err) == (2, False)
    approve(err, "valid")
    assert folder.exists() == (words == ["resume"])


def test_a_command_without_documentation_fails_this_test(cli):
    root = Path(__file__).parents[1]
    pages = (root / "README.md", root / "docs" / "commands.md")
    documented = "".join(page.read_text("utf-8") for page in pages)
    code, out, _ = cli("--help")
    assert code == 0
    for command in re.findall(r"^  ([a-z-]+)  ", out.partition("Search:")[2], re.MULTILINE):
        assert f"bridgegen {command}" in documented


def test_a_table_says_which_package_it_needs(cli, monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    status, out, err = cli("export", "--flavour", "parquet", tmp_path, "--out", tmp_path / "tables")
    assert (status, out) == (2, "")
    approve(err, "bridgegen[parquet]")
