"""``bridgegen --help`` shows every command, in a panel, with a summary that is not cut."""

import re
import subprocess
import sys
from importlib.metadata import version

import pytest
from tests.approval import approve
from tests.command_lines import commands
from typer.main import get_command

import bridgegen
from bridgegen.cli import app
from bridgegen.cli.groups import PANELS, RARE
from bridgegen.engine.options.option import GROUPS

ROOT = get_command(app)
SEARCH_GROUPS = (
    "What to search", "Search", "Objective", "Driver", "Simulator", "Output",
)  # fmt: skip


def test_every_command_is_in_a_panel(cli, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    code, out, _ = cli("--help")
    assert code == 0
    assert [one for one in PANELS if f"\n{one}:\n" not in out] == []
    listed = re.findall(r"^  ([a-z][a-z-]*)  ", out, re.MULTILINE)
    shown = [name for name, one in ROOT.commands.items() if not one.hidden]
    assert sorted(listed) == sorted(shown)
    assert "..." not in out.partition("Search:")[2]


@pytest.mark.parametrize("group", ["list", "ontology"])
def test_a_group_s_summaries_are_not_cut(cli, monkeypatch, group):
    monkeypatch.setenv("COLUMNS", "80")
    _, out, _ = cli(group, "--help")
    assert all(f"\n  {name}  " in out for name in ROOT.commands[group].commands)
    assert "..." not in out.partition("Commands:")[2]


def test_a_suite_needs_no_other_word_and_its_help_lists_the_others(cli, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    _, out, _ = cli("suite", "--help")
    approve(out, "bridgegen", "--junit")
    commands = out.partition("\nCommands:\n")[2]
    assert re.findall(r"^  (suite [a-z]+)  ", commands, re.MULTILINE) == [
        "suite add", "suite replay", "suite commit", "suite verify",
    ]  # fmt: skip
    assert "..." not in commands
    assert max(len(line) for line in out.splitlines()) <= 80
    for words in (("suite", "add"), ("suite", "replay")):
        _, out, _ = cli(*words, "--help")
        assert out.startswith(f"Usage: bridgegen {' '.join(words)} [OPTIONS]")
        assert max(len(line) for line in out.splitlines()) <= 80
    code, _, err = cli("suite")
    assert (code, "Missing argument" in err) == (2, True)


def test_a_bare_call_is_the_help(cli):
    code, out, _ = cli()
    assert code == 0
    assert out.strip() == cli("--help")[1].strip()


def test_the_version(cli):
    assert cli("--version") == (0, f"bridgegen {version('bridgegen')}\n", "")


def test_the_panels_of_the_commands(cli):
    _, out, _ = cli("--help")
    titles = re.findall(r"^(\S.*):$", out, re.MULTILINE)
    assert titles == ["Options", *PANELS]


def test_the_options_of_a_search_are_in_groups(cli, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    _, out, _ = cli("search", "--help-all")
    titles = re.findall(r"^(\S.*):$", out, re.MULTILINE)
    assert titles == ["Arguments", *SEARCH_GROUPS, "Options"]
    assert max(len(line) for line in out.splitlines()) <= 80
    driver = out.partition("\nDriver:\n")[2].partition("\nSimulator:\n")[0]
    assert re.findall(r"^  (--[a-z-]+)", driver, re.MULTILINE) == [
        "--repeats", "--adversary", "--others", "--ego", "--name", "--ideal", "--vehicle",
        "--worse-than", "--time-limit",
    ]  # fmt: skip
    assert re.findall(r"^  (--[a-z-]+)", out.partition("\nOptions:\n")[2], re.MULTILINE) == [
        "--help"
    ]


def test_a_long_help_leaves_out_what_few_people_need_and_says_how_to_see_it(cli, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    of_all = {
        spelling for _, one in commands(ROOT) for item in one.params for spelling in item.opts
    }
    assert of_all >= RARE
    _, short, _ = cli("search", "--help")
    _, whole, _ = cli("search", "--help-all")
    assert len(short.splitlines()) <= 63
    shown = {*re.findall(r"^  (--[a-z-]+)", short, re.MULTILINE)}
    left_out = {*re.findall(r"^  (--[a-z-]+)", whole, re.MULTILINE)} - shown
    assert left_out <= RARE
    assert len(left_out) > 25
    assert "--help-all" in shown
    assert "--help-all" not in cli("resume", "--help")[1]


@pytest.mark.parametrize(("name", "command"), sorted(commands(ROOT)))
def test_a_group_is_one_of_those_declared(name, command):
    groups = {getattr(one, "rich_help_panel", None) for one in command.params}
    assert groups <= {None, *GROUPS}


def test_the_command_line_starts_without_what_only_runs_need():
    """NumPy and Pydantic alone would take longer than all else that help needs."""
    code = (
        "import sys, bridgegen.cli; "
        "print(*sorted({'numpy', 'pydantic', 'numba', 'yaml', 'lxml'} & {*sys.modules}))"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == ""


def test_the_package_runs_as_a_module_and_knows_its_version():
    words = [sys.executable, "-m", "bridgegen", "--version"]
    found = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    assert found == f"bridgegen {bridgegen.__version__}\n"
    assert bridgegen.__version__ == version("bridgegen")
