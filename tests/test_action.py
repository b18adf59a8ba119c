"""The GitHub Action: its file is read as GitHub reads it, and its search runs here."""

import os
import re
import subprocess
import sys
from pathlib import Path
from xml.etree import ElementTree

import pytest
import yaml
from tests.approval import approve

pytestmark = pytest.mark.thorough

ROOT = Path(__file__).parents[1]
ACTION = yaml.safe_load((ROOT / "action.yml").read_text("utf-8"))
STEPS = ACTION["runs"]["steps"]
DEFAULTS = {name: one["default"] for name, one in ACTION["inputs"].items()}


def filled(text: str, values: dict[str, str]) -> str:
    """Return ``text`` with its expressions of inputs replaced, as GitHub does."""
    return re.sub(r"\$\{\{ inputs\.([\w-]+) \}\}", lambda match: values[match[1]], text)


def search(folder: Path, **changed: str) -> subprocess.CompletedProcess[str]:
    """Run the step that searches, with the action's defaults but for ``changed``."""
    values = DEFAULTS | {name.replace("_", "-"): text for name, text in changed.items()}
    (step,) = [one for one in STEPS if one.get("name") == "Search"]
    assert step["shell"] == "bash"
    given = {name: filled(text, values) for name, text in step["env"].items()}
    del given["NUMBA_CACHE_DIR"]  # the tests' own cache
    bin_folder = folder / "bin"
    bin_folder.mkdir()
    for name, code in (("python", '"$@"'), ("bridgegen", f"-c '{CALL}' \"$@\"")):
        path = bin_folder / name
        path.write_text(f'#!/bin/sh\nexec "{sys.executable}" {code}\n', "utf-8")
        path.chmod(0o755)
    environment = os.environ | given
    environment["PATH"] = f"{bin_folder}{os.pathsep}{environment['PATH']}"
    environment["PYTHONPATH"] = os.pathsep.join(path for path in sys.path if path)
    words = ["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", step["run"]]
    return subprocess.run(
        words, cwd=folder, env=environment, text=True, capture_output=True, check=False
    )


CALL = "from bridgegen.cli import main; main()"


def test_every_input_is_described_and_used():
    text = yaml.safe_dump([STEPS, ACTION["outputs"]])
    for name, one in ACTION["inputs"].items():
        assert one["description"].endswith("."), name
        assert f"inputs.{name}" in text, name
    used = set(re.findall(r"inputs\.([\w-]+)", text))
    assert used == set(ACTION["inputs"])


def test_no_input_is_written_into_a_script():
    """An input reaches bash as a variable: text of a pull request is never executed."""
    assert [step["name"] for step in STEPS if "${{" in step.get("run", "")] == []


def test_it_searches_with_the_defaults_and_writes_what_is_uploaded(tmp_path):
    done = search(tmp_path, budget="80")
    assert done.returncode == 0, done.stderr
    run = tmp_path / DEFAULTS["out"]
    assert (run / "report.html").is_file()
    assert ElementTree.parse(run / "junit.xml").getroot().tag == "testsuites"
    assert "of 80 evaluations" in done.stdout


@pytest.mark.parametrize("criterion", ["failed > 0\nevaluations > 10", "evaluations > 10"])
def test_a_criterion_fails_the_job_and_arguments_are_words(tmp_path, criterion):
    arguments = "--fix 'fog_density=80' --ego route-follower --no-causes --triage none"
    done = search(tmp_path, budget="40", fail_if=criterion, arguments=arguments)
    assert done.returncode == 3, done.stderr
    approve(done.stdout, "route-follower", "crossroads-s4")


def test_a_hostile_criterion_is_text(tmp_path):
    done = search(tmp_path, budget="40", fail_if='failed > 0"; touch stolen; "')
    assert done.returncode == 2
    assert not (tmp_path / "stolen").exists()
