"""What the README shows must run."""

import re
import shlex
import sys
from pathlib import Path

import pytest
from tests.command_lines import missing_lines, must_parse

from bridgegen.cli import main

README = (Path(__file__).parents[1] / "README.md").read_text("utf-8")


def test_the_python_runs(tmp_path, monkeypatch):
    (code,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    exec(compile(code.replace("budget=1000", "budget=80"), "README.md", "exec"), {})
    assert (tmp_path / "runs" / "s4" / "report.html").exists()


def commands() -> list[str]:
    return re.findall(r"`(bridgegen [^`]+)`", README)


def test_readme_is_short_and_says_what_a_command_prints():
    assert len(README.splitlines()) <= 100
    assert len(commands()) >= 10


@pytest.mark.thorough
def test_the_output_is_what_the_main_job_prints(tmp_path, monkeypatch, capsys):
    """But for the times of this machine."""
    (shown,) = re.findall(r"```text\n(FAILS .*?)```", README, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["bridgegen", "search", "crossroads-s4"])
    with pytest.raises(SystemExit) as end:
        main()
    assert not end.value.code
    printed = capsys.readouterr().out.splitlines()
    assert missing_lines(shown, printed) == []


@pytest.mark.parametrize("line", commands())
def test_every_command_line_parses(line):
    words = shlex.split(line)
    assert words.pop(0) == "bridgegen"
    must_parse(words)


def test_links_lead_somewhere():
    for target in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", README):
        assert (Path(__file__).parents[1] / target).exists(), target
