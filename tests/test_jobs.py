"""One contract for all jobs: what follows from their options, on the command line and in files."""

import json
import os
import shlex
import sys
from dataclasses import dataclass, fields, replace
from pathlib import Path

import jsonschema
import pytest
import yaml
from tests.approval import approve

from bridgegen.base.errors import StorageError
from bridgegen.cli import jobs as cli_jobs
from bridgegen.cli import main
from bridgegen.cli.jobs import JOBS, schema_of
from bridgegen.cli.terminal.live import JobProgress
from bridgegen.engine.options import CommonOptions, options_of
from bridgegen.jobs.frame import Job, Judged, Table, command_of
from bridgegen.simulation.choice import SimulatorChoice

GIVEN = {
    "benchmark algorithms": {
        "scenarios": ("cut-in", "crossroads-s4"), "algorithms": ("pso", "ga"), "seeds": 2,
        "settings": {"ga": {"population": 7}}, "baseline": "ga", "apart": 0.25, "budget": 9,
        "deliver": True,
    },
    "suite": {
        "files": ("cut-in", "packs"), "egos": ("careful", "exec:python3 my,driver.py"),
        "matrix": "2026", "samples": 3, "seed": 4, "simulator": SimulatorChoice("esmini"),
        "driver_name": "planner 7", "with_maps": True, "assessor": Path("/keys/a.key"),
        "repeats": 5,
    },
    "diff": {
        "files": ("cut-in",), "egos": ("careful", "reference"), "matrix": "none", "samples": 3,
        "seed": 4, "budget": 0, "repeats": 5,
    },
    "repair": {
        "files": ("cut-in",), "egos": ("careful",), "matrix": "none", "samples": 3, "seed": 4,
        "budget": 5, "rounds": 2, "tries": 7, "repeats": 5,
    },
    "dashboard": {
        "folder": Path("project"), "criteria": ["R-1: min(ego.v) < 3 m/s"], "update": True,
    },
    "safety-case": {"runs": (Path("/runs/a"), Path("/runs/b"))},
    "credibility": {"runs": (Path("/runs/a"), Path("/runs/b")), "validate": True},
    "mine": {
        "recordings": (Path("/recorded/a.csv"),), "road_map": Path("/recorded/a.xodr"),
        "time_step": 0.1, "scenarios": (Path("/mine/a.yaml"),),
        "update": (Path("/mine/b.yaml"),), "ego": "careful", "keep": 3,
    },
    "benchmark planners": {
        "drivers": ("careful", "reference"), "scenarios": ("cut-in", "lead-brakes"), "budget": 4,
        "seeds": 2, "algorithm": "random", "keep": 0, "triage": "none", "quick": True,
    },
    "risk": {
        "every": True,
        "scenario": "cut-in", "ego": "careful", "exposure": "uniform", "event": "conflict",
        "count": "any", "method": "mc", "precision": 0.125, "budget": 345, "seed": 7,
        "start": Path("runs/one"), "check": 12, "events": "events.csv", "vehicle": "single-track",
        "others": "insistent", "simulator": SimulatorChoice("esmini"), "simulator_rows": 3,
    },
    "preventability": {
        "scenario": "r157/cut-in", "ego": ("careful", "reference"), "grid": ["gap=1:9:3"],
        "models": ("fsm",), "fixed": {"relative_speed": "40 km/h"}, "vehicle": "multi-body",
        "others": "scripted",
    },
}  # fmt: skip
"""Of each job all options but those that no result depends on, none at its default."""


@dataclass
class Nothing:
    """A result without figures that are known."""

    figures: dict[str, float]
    work: str = "no work"

    def to_json(self):
        return {"nothing": True}

    def shown(self):
        return ["a line", Table(("head",), [("cell",)])]

    def judged(self):
        part = {"facts": {"fact": "so"}, "suite": "suite", "group": "group"}
        return [
            Judged(test="it is known", holds=False, details="why", figures=self.figures, **part)
        ]


@pytest.fixture
def asked(monkeypatch):
    """The options that commands were run with."""
    found = []

    def run(self, options):
        found.append(options)
        return Nothing(dict.fromkeys(self.figures, float("nan")))

    monkeypatch.setattr(Job, "run", run)
    monkeypatch.setattr(
        cli_jobs, "_CRITERIA", {}
    )  # a class of criteria of its own knows its result
    return found


def call(monkeypatch, *words):
    monkeypatch.setattr(sys, "argv", ["bridgegen", *map(str, words)])
    with pytest.raises(SystemExit) as end:
        main()
    return end.value.code or 0


def plain(options):
    free = {"out", "workers", "callbacks"} & {one.name for one in fields(options)}
    return replace(options, **dict.fromkeys(free))


def in_file(job, values):
    """Values of options as a run file names and holds them."""
    spelling = {
        one.name: one.name if one.is_argument else one.spelling[2:]
        for one in options_of(job.options)
    }
    return {
        spelling[name]: [*map(str, one)] if isinstance(one, tuple) else str(one)
        for name, one in values.items()
    }


def located(options, folder):
    """Options with whole paths, of those that name files in a folder."""

    def whole(value):
        if isinstance(value, tuple):
            return tuple(map(whole, value))
        is_path = isinstance(value, Path) or str(value).endswith("events.csv")
        return type(value)(os.path.normpath(folder / value)) if is_path else value

    return replace(options, **{name: whole(value) for name, value in vars(options).items()})


def first_of(job):
    """The argument of a job, as a run file names it."""
    return next((one.name for one in options_of(job.options) if one.is_argument), "")


def needed_by(job):
    """Values of what a run file of a job must have: its argument, and what has no default."""
    names = [one.name for one in options_of(job.options) if one.is_required or one.is_argument]
    return {name: GIVEN[job.name][name] for name in names}


jobs = pytest.mark.parametrize("job", JOBS, ids=lambda job: job.name)
of_files = pytest.mark.parametrize(
    "job", [one for one in JOBS if first_of(one)], ids=lambda job: job.name
)


@jobs
def test_all_options_are_given_here(job):
    free = {"workers", "out", "callbacks"}
    own = {one.name for one in fields(job.options)} - free - {f.name for f in fields(CommonOptions)}
    assert own <= {*GIVEN[job.name]}
    assert all(one.help for one in options_of(job.options))


@jobs
def test_the_command_that_repeats_a_job_has_its_options(job, asked, monkeypatch, tmp_path):
    options = job.options(**GIVEN[job.name])
    command = command_of(job.name, options, tmp_path / "a folder")
    assert call(monkeypatch, *shlex.split(command)[1:]) == 0
    assert Path(asked[0].out) == tmp_path / "a folder"
    assert plain(asked[0]) == plain(options)


@of_files
def test_a_run_file_has_the_options_of_the_call_that_saved_it(job, asked, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    options = job.options(**GIVEN[job.name])
    words = shlex.split(command_of(job.name, options, Path("folder")))[1:]
    assert call(monkeypatch, *words, "--save", "run.yaml") == 0
    jsonschema.validate(yaml.safe_load(Path("run.yaml").read_text()), schema_of(job))
    monkeypatch.chdir("/")
    more = ("--workers", "2") if hasattr(options, "workers") else ()
    assert call(monkeypatch, *job.name.split(), tmp_path / "run.yaml", *more) == 0
    assert not more or str(asked[1].workers) == "2"
    assert plain(located(asked[1], tmp_path)) == plain(located(asked[0], tmp_path))
    assert Path(asked[1].out) == tmp_path / "folder"


@of_files
def test_a_file_of_several_runs_makes_each_in_a_folder_of_its_own(
    job, asked, monkeypatch, tmp_path, capsys
):
    needed = in_file(job, needed_by(job))
    file = tmp_path / "both.yaml"
    file.write_text(json.dumps({"runs": {"a": needed, "b": needed}}))
    assert call(monkeypatch, *job.name.split(), file) == 0
    folders = [Path(job.last_word) / "both" / name for name in "ab"]
    folders = folders if job.has_folder else [None, None]
    assert [one.out for one in asked] == folders
    file.write_text(f"runs: {{a: &a {json.dumps(needed)}, b: *a}}")
    assert call(monkeypatch, *job.name.split(), file) == 2
    assert "both.yaml" in capsys.readouterr().err
    file.write_text(yaml.safe_dump({"run": {**needed, "bugdet": 3}}))
    assert call(monkeypatch, *job.name.split(), file) == 2
    approve(capsys.readouterr().err, "bugdet")


@of_files
def test_one_run_that_fails_does_not_keep_the_others(job, asked, monkeypatch, tmp_path, capsys):
    needed = in_file(job, needed_by(job))
    file, run = tmp_path / "both.yaml", Job.run

    called = []

    def refuse_the_first(self, options):
        called.append(options)
        if len(called) == 1:
            raise StorageError("there is something else")
        return run(self, options)

    monkeypatch.setattr(Job, "run", refuse_the_first)
    file.write_text(json.dumps({"runs": {"a": needed, "b": needed}}))
    assert call(monkeypatch, *job.name.split(), file) == 2
    approve(capsys.readouterr().err, "bridgegen")
    assert asked == called[1:]
    assert len(asked) == 1
    assert not job.has_folder or Path(asked[0].out).name == "b"


@jobs
def test_what_is_not_known_is_not_judged(job, asked, monkeypatch, tmp_path, capsys):
    words = shlex.split(command_of(job.name, job.options(**GIVEN[job.name]), tmp_path))[1:]
    assert call(monkeypatch, *words) == 0
    approve(capsys.readouterr().out, "line")
    assert call(monkeypatch, *words, "--json") == 0
    assert capsys.readouterr().out == '{\n "nothing": true\n}\n'
    junit = tmp_path / "junit.xml"
    assert call(monkeypatch, *words, "--fail-if", job.example, "--junit", junit) == 3
    approve(capsys.readouterr().err, "JUDGED")
    assert 'errors="2"' in junit.read_text()
    assert call(monkeypatch, *words, "--fail-if", "harmm > 3") == 2
    approve(capsys.readouterr().err, "harmm", "--fail-if")


def test_what_a_job_says_stays_on_one_line_in_a_file(capsys):
    text = f"bridgegen: warning: skipped: {'a long name ' * 20}.csv, line 2"
    JobProgress().callbacks.say(text)
    assert capsys.readouterr().err == f"{text}\n"
