"""``bridgegen --help`` shows every command, in a panel, with a summary that is not cut."""

import re
from importlib.metadata import version

import pytest
from typer.main import get_command

from bridgegen.cli import app
from bridgegen.cli.app import PANELS

ROOT = get_command(app)


def test_every_command_is_in_a_panel(cli, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    code, out, _ = cli("--help")
    assert code == 0
    assert [one for one in PANELS if f"\n{one}:\n" not in out] == []
    listed = re.findall(r"^  ([a-z][a-z-]*)  ", out, re.MULTILINE)
    assert sorted(listed) == sorted(ROOT.commands)
    assert "..." not in out.partition("Search:")[2]


@pytest.mark.parametrize("group", ["list", "ontology"])
def test_a_group_s_summaries_are_not_cut(cli, monkeypatch, group):
    monkeypatch.setenv("COLUMNS", "80")
    _, out, _ = cli(group, "--help")
    assert all(f"\n  {name}  " in out for name in ROOT.commands[group].commands)
    assert "..." not in out.partition("Commands:")[2]


def test_a_bare_call_is_the_help(cli):
    code, out, _ = cli()
    assert code == 0
    assert out.strip() == cli("--help")[1].strip()


def test_the_version(cli):
    assert cli("--version") == (0, f"bridgegen {version('bridgegen')}\n", "")
