"""Every snippet of the documentation is run, in the order of its page, in a folder of its own.

``sh``: each line; ``bridgegen`` and ``python`` in this process, everything else by the shell.
``python``: executed, a page's blocks one after the other. ``yaml``: a scenario, or parts of one, is
read and held against the schema. ``xml``: well formed. ``text`` is what the block before it
prints; on the pages ``AS_PRINTED`` each of its lines is looked for in their output,
in order, but for durations; ``…`` stands for what is left out.

Searches are shortened (``shortened``), but not those of the pages ``AS_PRINTED``. A comment before
a block says what else is to be known:
``<!-- not run: WHY -->`` and ``<!-- tested by: FILE -->`` (what takes too long here; the commands
of both must still parse), ``<!-- file: NAME -->`` (what the reader saves as that file),
``<!-- varies: WHAT -->`` (output with numbers that other processors may change),
``<!-- exit: 3 -->``, ``<!-- ci -->`` (the YAML of another program), ``<!-- excerpt -->`` (no
output, but a part of a file), ``<!-- shortened -->`` (of a page ``AS_PRINTED``: nothing that it
prints depends on these commands).
"""

import json
import re
import runpy
import shlex
import shutil
import subprocess
import sys
import tomllib
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml
from tests.command_lines import missing_lines, must_parse

from bridgegen.cli import main
from bridgegen.cli.run_files import keys_of, read_runs
from bridgegen.cli.runs import search
from bridgegen.jobs.preventability.grid import DEFAULT_GRIDS
from bridgegen.jobs.search import driver_contract
from bridgegen.jobs.search.exported import NOT_EXPORTED
from bridgegen.openx.openscenario.read import read
from bridgegen.scenario.exposure import read_exposure
from bridgegen.scenario.language.json_schema import schema
from bridgegen.scenario.language.plain_yaml import read_plain_yaml
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.starter import start_scenario
from bridgegen.scenario.ontology.check import check
from bridgegen.scenario.ontology.files import load as load_owl

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(path.stem for path in DOCS.glob("*.md"))
BUDGET = "120"  # a failure of crossroads-s4 by pso needs 92
SHORT = {
    "search": {"--budget": BUDGET, "--keep": "1", "--triage": "none"},
    "benchmark": {"--seeds": "2", "--budget": "20", "--workers": "1"},
}
"""What commands are run with instead of what the page says.

Pages ``AS_PRINTED`` and ``TRIAGED`` triage; each other search would take twice as long with it.
"""

TRIAGED = ("credibility", "dashboard", "read-a-report", "suites", "tutorial")
"""Pages whose later commands need the failure modes of a search."""

FEW = {
    "suite": {"--samples": "6"},
    "diff": {"--samples": "6"},
    "search": {"--workers": "1"},  # processes: tests/campaign/test_workers.py
}
"""The same, of options that the page names."""

COARSE = {
    "suite": {"--workers": "1"},  # in this process
    "diff": {"--workers": "1"},
}
"""What commands are run with where the page leaves it open."""

AS_PRINTED = (
    "estimate-risk", "failure-modes", "mine-recordings", "python-guide", "regions", "run-a-suite",
    "safety-case", "search-a-file", "sensitivity", "team", "test-my-driver", "write-a-scenario",
)  # fmt: skip
"""Pages whose commands are run exactly as they are printed, and whose output is compared."""

ELSEWHERE = ("not run", "tested by")

_BLOCK = re.compile(
    r"(?:^<!-- (?P<mark>[^\n]*) -->\n)?^ *```(?P<kind>[a-z]+)\n(?P<text>.*?)^ *```$", re.M | re.S
)


@dataclass(frozen=True)
class Block:
    kind: str
    text: str
    mark: str
    value: str


def blocks(page: str) -> list[Block]:
    found = []
    for match in _BLOCK.finditer((DOCS / f"{page}.md").read_text("utf-8")):
        mark, _, value = (match["mark"] or "").partition(":")
        found.append(Block(match["kind"], match["text"], mark.strip(), value.strip()))
    return found


def lines(text: str) -> list[str]:
    return [line for line in text.replace("\\\n", " ").splitlines() if line.strip()]


def words_of(line: str) -> list[str]:
    return shlex.split(line, comments=True)


def shortened(words: list[str], is_triaged: bool = False) -> list[str]:
    """Return a bridgegen command that takes less time."""
    short = dict(SHORT.get(words[1], {}))
    if words[1:3] == ["analyse", "regions"]:
        short = {"--samples": "20"}
    if words[1] == "validate" and is_driver(words[2]):
        short = {"--scenario": "cut-in"}
    if words[1] == "search" and is_triaged:
        short["--triage"] = "short"
    if words[1] == "search" and any(".py:" in word or word == "--adversary" for word in words):
        # A driver in Python, or a course for each row, takes its time.
        short |= {"--budget": "40", "--triage": "none"}
    if "--catalogue" in words:
        short |= {"--budget": "8", "--triage": "none"}  # in each of its scenarios
    found = list(words)
    for option, value in FEW.get(words[1], {}).items():
        if option in found:
            found[found.index(option) + 1] = value
    is_subcommand = words[1] == "suite" and words[2] in ("add", "replay", "commit", "verify")
    coarse = COARSE.get("" if is_subcommand else words[1], {})
    for option, value in (
        {"--size": "320x180", "--fps": "4"} if "video" in words else coarse
    ).items():
        if option not in found:
            found += [option, value]
    for option, value in short.items():
        if option in found:
            found[found.index(option) + 1] = value
        else:
            found += [option, value]
    return found


def is_driver(word: str) -> bool:
    return ":" in word or word == "fiss"


CHECKED = [f"docs/examples/my_{one}" for one in
           ("driver.py:MyDriver", "planner.py:MyPlanner", "network.py:MyNetwork")]  # fmt: skip
"""Drivers that ``tests/campaign/test_driver_contract.py`` checks."""


def is_known(words: list[str]) -> bool:
    """Return whether another test does the same; the command writes nothing."""
    return words[1] == "validate" and words[2] in CHECKED


INDEX = "commands"
"""The page that lists all commands: what another page runs, too, is not run for it again."""

DEAR = ("search", "export", "preventability", "benchmark", "dashboard", "safety-case",
        "credibility", "analyse", "mine")  # fmt: skip
CHOICES = ("--ego", "--algorithm", "--flavour")
"""Options whose values are other code."""


def signature(words: list[str]) -> tuple[str, ...]:
    """Return a command with its options, and the values of its `CHOICES`."""
    options = [word for word in words if word.startswith("--")]
    chosen = [value for option, value in pairwise(words) if option in CHOICES]
    job = words[1:3] if words[1] == "analyse" else words[1:2]
    return (*job, *sorted({*options, *chosen} - {"--out"}))


@lru_cache
def run_by_others() -> frozenset[tuple[str, ...]]:
    """Return the signatures of the commands that other pages than the `INDEX` run."""
    return frozenset(
        signature(words)
        for name in PAGES
        for block in blocks(name)
        if name != INDEX and block.kind == "sh" and block.mark not in ELSEWHERE
        for words in map(words_of, lines(block.text))
        if words and words[0] == "bridgegen"
    )


def is_run_by_others(words: list[str], text: str) -> bool:
    """Return whether another page runs a dear command, of which no other one of a text reads."""
    out = words[words.index("--out") + 1] if "--out" in words else None
    return (
        words[1] in DEAR
        and (out is None or text.count(out) == 1)
        and signature(words) in run_by_others()
    )


class Page:
    """Runs a page's blocks."""

    def __init__(self, monkeypatch, capsys) -> None:
        self.patch, self.names = monkeypatch, {"__name__": "a_page"}
        self.as_printed, self.capsys, self.ran = False, capsys, False
        self.is_triaged, self.index = False, ""
        self.output: list[str] = []

    def run(self, block: Block) -> None:
        if block.mark == "file":
            Path(block.value).write_text(block.text, "utf-8")
        getattr(self, block.kind)(block)

    def sh(self, block: Block) -> None:
        self.capsys.readouterr()
        self.commands(block)
        self.ran = block.mark not in ELSEWHERE
        printed = self.capsys.readouterr()
        self.output = [*printed.out.splitlines(), *printed.err.splitlines()]

    def commands(self, block: Block) -> None:
        for line in lines(block.text):
            words = words_of(line)
            if not words:
                continue
            if words[0] == "bridgegen":
                must_parse(words[1:])
            if block.mark in ELSEWHERE:
                continue
            if self.index and words[0] == "bridgegen" and is_run_by_others(words, self.index):
                continue
            as_printed = self.as_printed and block.mark != "shortened"
            status = self.command(words, as_printed)
            assert status == int(block.value if block.mark == "exit" else 0), line

    def command(self, words: list[str], as_printed: bool) -> int:
        if words[0] == "bridgegen":
            words = words if as_printed else shortened(words, self.is_triaged)
            if is_known(words):
                return 0
            self.patch.setattr(sys, "argv", words)
            with pytest.raises(SystemExit) as end:
                main()
            return int(end.value.code or 0)
        if words[0] == "python":
            self.patch.setattr(sys, "argv", words[1:])
            try:
                runpy.run_path(words[1], run_name="__main__")
            except SystemExit as end:
                return int(end.code or 0)
            return 0
        return subprocess.run(words, check=False).returncode

    def python(self, block: Block) -> None:
        text = block.text
        if not self.as_printed:
            text = re.sub(r"budget=\d+", f"budget={BUDGET}", text)
            text = text.replace("seeds=20", "seeds=2, workers=1")
        code = compile(text, "page", "exec")
        self.capsys.readouterr()
        self.ran = block.mark not in ELSEWHERE
        if self.ran:
            exec(code, self.names)
        self.output = self.capsys.readouterr().out.splitlines()

    def yaml(self, block: Block) -> None:
        if block.mark == "ci":
            for line in re.findall(r"bridgegen search.*", block.text):
                must_parse(words_of(line)[1:])
            yaml.safe_load(block.text)
            return
        path = Path("a_scenario.yaml")
        if re.match("runs?:", block.text):
            path.write_text(block.text, "utf-8")
            read_runs(path, keys_of(search))
            return
        if block.text.startswith("exposure_of:"):
            path.write_text(block.text, "utf-8")
            read_exposure(path)
            return
        if "scenario:" not in block.text:  # parts of one: they take the place of the starter's
            whole = yaml.safe_load(start_scenario("made").read_text("utf-8"))
            for key, value in yaml.safe_load(block.text).items():
                if isinstance(value, dict):
                    whole[key] = whole.get(key, {}) | value
                else:
                    whole[key] = value
            path.write_text(yaml.safe_dump(whole, allow_unicode=True), "utf-8")
            Path("made.yaml").unlink()
        else:
            path.write_text(block.text, "utf-8")
        data = read_plain_yaml(path.read_bytes(), "page").data
        assert [one.message for one in validator().iter_errors(data)] == []
        load(path)

    def xml(self, block: Block) -> None:
        ElementTree.fromstring(block.text)

    def toml(self, block: Block) -> None:
        tomllib.loads(block.text)

    def text(self, block: Block) -> None:
        if self.as_printed and self.ran and not block.mark:
            assert missing_lines(block.text, self.output) == [], "\n".join(self.output)


@lru_cache
def validator():
    from jsonschema import Draft7Validator

    return Draft7Validator(schema())


@pytest.fixture
def page(tmp_path, monkeypatch, capsys) -> Page:
    shutil.copytree(DOCS / "examples", tmp_path / "docs" / "examples")
    shutil.copy(DOCS / "examples" / "oil_spill.py", tmp_path)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(driver_contract, "SECONDS", 0.1)  # of the batch that is timed
    axes = DEFAULT_GRIDS["r157-cut-in"]  # of thousands of cells
    few = {name: replace(axis, n=min(axis.n, 5)) for name, axis in axes.items()}
    monkeypatch.setitem(DEFAULT_GRIDS, "r157-cut-in", few)
    return Page(monkeypatch, capsys)


def check_exports_of_a_searched_file() -> None:
    """They state what this search found, not what the one found that wrote the file."""
    searched = Path("runs/file")
    assert not (searched / NOT_EXPORTED).exists()
    paths = sorted((searched / "critical").glob("*.json"))
    assert paths
    for path in paths:
        facts = json.loads(path.read_text("utf-8"))
        conflict = facts["conflict"]
        header = read(path.with_suffix(".xosc")).file_header.properties
        assert header.get("cause") == facts.get("cause"), path.name
        assert header.get("conflict_type") == conflict["type"]
        individuals = load_owl(path.with_suffix(".owl"))
        scenario = individuals.one("Scenario")
        assert individuals.optional_text(scenario, "has_cause") == facts.get("cause")
        assert individuals.optional_text(scenario, "has_conflict_type") == conflict["type"]
        assert individuals.number(scenario, "has_severity") == conflict["severity"]["value"]
        assert check(individuals) == []


AFTERWARDS = {"search-a-file": check_exports_of_a_searched_file}
"""What must hold once all of a page has run."""


@pytest.mark.thorough
@pytest.mark.parametrize("name", [name for name in PAGES if blocks(name)])
def test_every_snippet_runs(name, page):
    page.as_printed, page.is_triaged = name in AS_PRINTED, name in TRIAGED
    page.index = (DOCS / f"{INDEX}.md").read_text("utf-8") if name == INDEX else ""
    for block in blocks(name):
        page.run(block)
    if name in AFTERWARDS:
        AFTERWARDS[name]()


def test_few_snippets_cannot_be_run():
    found = [block for name in PAGES for block in blocks(name) if block.mark == "not run"]
    why = ("esmini", "CARLA", "extra parquet", "server", "planner", "350 MB", "the recordings",
           "co-simulation unit", "another project")  # fmt: skip
    assert all(any(one in block.value for one in why) for block in found)
    assert len(found) <= 26


def test_marks_are_those_that_are_known():
    for block in (block for name in PAGES for block in blocks(name)):
        assert block.mark in (
            "", *ELSEWHERE, "file", "exit", "ci", "excerpt", "shortened", "varies"
        ), block.mark  # fmt: skip
        assert block.mark != "tested by" or (ROOT / block.value).is_file(), block.value
