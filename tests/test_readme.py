"""What the README shows must run."""

import re
import shlex
from pathlib import Path

import pytest
from typer.main import get_command

from bridgegen.cli import app

README = (Path(__file__).parents[1] / "README.md").read_text("utf-8")


def test_the_python_runs(tmp_path, monkeypatch):
    (code,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    monkeypatch.chdir(tmp_path)
    exec(compile(code.replace("budget=1000", "budget=80"), "README.md", "exec"), {})
    assert (tmp_path / "runs" / "s4" / "report.html").exists()


def commands() -> list[str]:
    (block,) = re.findall(r"```text\n(bridgegen search.*?)```", README, re.DOTALL)
    found = []
    for line in block.splitlines():
        text = line.partition("#")[0].strip()
        if "|" in text:
            head, _, names = text.rpartition(" ")
            found += [f"{head} {name}" for name in names.split("|")]
        else:
            found.append(text)
    return found


@pytest.mark.parametrize("line", commands())
def test_every_command_line_parses(line):
    words = shlex.split(line)
    assert words.pop(0) == "bridgegen"
    command = get_command(app)
    while hasattr(command, "commands"):
        command = command.commands[words.pop(0)]
    command.make_context(command.name, words)


def test_links_lead_somewhere():
    for target in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (Path(__file__).parents[1] / target).exists(), target
