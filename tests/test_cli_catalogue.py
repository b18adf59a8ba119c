"""search --catalogue: all scenarios that ship, one page; list scenarios --typology."""

import json
import re

import pytest
from tests.approval import approve

from bridgegen.scenario.language import reader
from bridgegen.scenario.typology import typologies

SOME = ("crossroads-s1", "crossroads-s2", "cut-in", "lead-brakes")
QUICK = ("--budget", 40, "--keep", 0, "--triage", "short", "--algorithm", "random")


@pytest.fixture
def few(monkeypatch):
    """Make the catalogue small."""
    names = reader.names
    chosen = lambda kind="scenario": SOME if kind == "scenario" else names(kind)  # noqa: E731
    monkeypatch.setattr(reader, "names", chosen)


@pytest.mark.thorough
def test_the_catalogue_is_searched_resumed_and_weighed(cli, few, tmp_path, monkeypatch, same_rows):
    monkeypatch.chdir(tmp_path)
    words = ("search", "--catalogue", "--ego", "route-follower", *QUICK)
    code, out, err = cli(*words)
    assert code == 0, err
    folder = tmp_path / "runs/catalogue-route-follower"
    assert sorted(path.parent.name for path in folder.glob("*/run.sqlite")) == list(SOME)
    page = (folder / "dashboard.html").read_text("utf-8")
    assert 'id="types"' in page
    ends = out.splitlines()
    assert re.match(r"route-follower fails in \d of 4 types of crashes", ends[-3])
    assert ends[-1] == "page        runs/catalogue-route-follower/dashboard.html"
    # The run is that of a search of this scenario alone, to the bit.
    assert cli("search", "cut-in", "--ego", "route-follower", *QUICK, "--out", "alone")[0] == 0
    assert same_rows(folder / "cut-in", tmp_path / "alone")
    # Called again, it does what is missing, and nothing twice.
    (folder / "cut-in/report.html").unlink()
    times = {path: path.stat().st_mtime_ns for path in folder.glob("*/run.sqlite")}
    code, out, err = cli(*words)
    assert code == 0, err
    assert out.count("finished already: ") == 3
    assert (folder / "cut-in/report.html").is_file()
    done = [path for path in times if path.parent.name != "cut-in"]
    assert all(path.stat().st_mtime_ns == times[path] for path in done)
    # Other options are other runs, and nothing is overwritten.
    code, _, err = cli(*words, "--seed", 1, "--out", folder)
    assert code == 2
    assert err.count("was begun with these other options") == 4


@pytest.mark.thorough
def test_a_failure_condition_that_holds_ends_all_with_its_status(cli, few, tmp_path):
    code, out, _ = cli(
        "search", "--catalogue", "--ego", "route-follower", *QUICK, "--fail-if", "critical > 0",
        "--out", tmp_path / "all",
    )  # fmt: skip
    assert code == 3
    assert (tmp_path / "all/dashboard.html").is_file()
    assert out.splitlines()[-1].startswith("page ")


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (["--catalogue", "cut-in"], ["--catalogue", "scenario"]),
        (["--catalogue", "--junit", "j.xml"], ["--catalogue", "--junit"]),
        (["--catalogue", "--save", "a.yaml"], ["--catalogue", "--save"]),
        (["--catalogue", "--ego", "reverence"], ["'reverence'", "reference"]),
        ([], ["SCENARIO", "--catalogue"]),
    ],
)
def test_what_does_not_go_together_is_one_error(cli, tmp_path, monkeypatch, words, named):
    monkeypatch.chdir(tmp_path)
    code, _, err = cli("search", *words)
    assert (code, len(err.splitlines())) == (2, 1)
    approve(err, *named)
    assert not list(tmp_path.iterdir())


def test_the_list_says_what_is_covered_and_what_is_not(cli):
    code, out, err = cli("list", "scenarios", "--typology")
    assert (code, err) == (0, "")
    text = " ".join(out.split())
    assert "35 of 37 types, with 99 % of the crashes (shares of harm by type: not known)" in text
    assert "not covered: no collision (0.77 %); other (0.6 %)" in text
    assert "in none of these types: " in text
    assert "24 of 24 types" in text
    code, out, _ = cli("list", "scenarios", "--typology", "--json")
    found = json.loads(out)
    assert [each["name"] for each in found] == list(typologies())
    assert found[0]["types"][25]["scenarios"].keys() == {"stopped-after-curve", "cut-out"}
