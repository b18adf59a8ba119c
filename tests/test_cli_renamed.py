"""The commands that people see, and the old names, which answer for one version."""

import pytest
from tests.approval import approve
from typer.main import get_command

from bridgegen.cli import app
from bridgegen.cli.groups import PANELS, RENAMED

SEEN = (
    "demo search resume suite diff repair benchmark preventability risk open analyse confirm "
    "export dashboard safety-case credibility new validate draw simulate mine fit list ontology "
    "doctor"
)


def test_the_commands_that_people_see(cli):
    assert " ".join(name for names in PANELS.values() for name in names) == SEEN
    _, out, _ = cli("--help")
    assert not [old for old in (*RENAMED, "reproduce") if f"\n  {old} " in out]


def test_what_reproduces_the_paper_s_evaluation_is_there_and_not_listed(cli):
    code, out, _ = cli("reproduce", "--help")
    assert (code, "--quick" in out) == (0, True)


@pytest.mark.parametrize("old", RENAMED)
def test_an_old_name_is_the_new_command(old, cli):
    """Its words, completed, parse; none of them is a command of its own still."""
    assert old not in get_command(app).commands
    code, out, err = cli(old, "--help")
    assert (code, out) == (0, cli(*RENAMED[old], "--help")[1])
    assert len(err.splitlines()) == 1
    approve(err, old)


def test_old_names_run(cli, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for words in (("show", "cut-in"), ("schema", "--of", "run"), ("schema", "exposure")):
        code, out, err = cli(*words)
        assert (code, bool(out), len(err.splitlines())) == (0, True, 1)
    assert cli("schema", "run")[1] == cli("validate", "--schema", "run")[1]


@pytest.mark.parametrize(
    ("words", "new"),
    [
        (("suite", "nowhere.xosc", "--map"), "--preventability"),
        (("fit", "cut-in", "nowhere.csv", "--others", "default"), "--without-column"),
        (("mine", "nowhere.csv", "--lenient"), "--lenient"),
        (("ontology", "import", "nowhere.xosc", "--ego", "Hero"), "--entity"),
        (("analyse", "recording", "nowhere.csv", "--ego=Hero"), "--entity"),
    ],
)
def test_an_old_spelling_answers_with_the_new_one(words, new, cli):
    _, _, err = cli(*words)
    assert "nowhere" in err  # it ran
    approve(err.splitlines()[0], new)


def test_an_export_takes_the_options_of_its_flavour(cli, tmp_path):
    code, _, err = cli("export", tmp_path, "--flavour", "carla", "--fps", 10, "--sample", 0.5)
    assert code == 2
    approve(err, "--fps", "--sample")
    code, _, err = cli("export", tmp_path, "--flavour", "vidio")
    assert code == 2
    approve(err, "vidio")
    code, _, err = cli("export", tmp_path, tmp_path, "--flavour", "video")
    assert code == 2
    approve(err, "video")


def test_validate_takes_files_drivers_and_kinds_of_schemas(cli):
    code, _, err = cli("validate", "nothing")
    assert code == 2
    approve(err, "nothing")
    code, _, err = cli("validate", "--schema", "rn")
    assert code == 2
    approve(err, "rn")
    code, _, err = cli("validate")
    assert code == 2
    approve(err, "bridgegen")
    code, _, err = cli("validate", "a.xosc", "--json")
    assert code == 2
    approve(err, "--out")


def test_a_run_file_with_an_old_spelling_is_read(tmp_path):
    from bridgegen.cli.jobs import SUITE, command_of
    from bridgegen.cli.run_files import keys_of, read_runs

    path = tmp_path / "suite.yaml"
    path.write_text("run: {files: [cut-in], map: true}")
    (run,) = read_runs(path, keys_of(command_of(SUITE), SUITE.options), "files")
    assert run.values["with_maps"]
