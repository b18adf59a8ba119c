"""Runs with failures, without, and with a violated criterion; copies that a test may change."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import bridgegen as bg
from bridgegen.scenario.language.reader import shipped_text

SEARCHES = {
    "fails": (
        "paper/crossroads-s4",
        {"ego": "route-follower", "objective": {"harm": None}, "seed": 3},
    ),
    "unlucky": (  # the search finds nothing, the fresh draws do
        "crossroads-s4",
        {"ego": "route-follower", "objective": {"harm": None}, "budget": 10},
    ),
    "clean": ("cut-in.yaml", {"ego": "reference", "algorithm": "random"}),
    "judged": (
        "pedestrian-at-night",
        {
            "ego": "reference",
            "algorithm": "random",
            "criteria": ["R-12: always(gap to any > 2 m)", "R-13: always(ego.v >= -1 m/s)"],
        },
    ),
}


@pytest.fixture(scope="session")
def made(tmp_path_factory) -> dict[str, Path]:
    """The runs; read only."""
    base = tmp_path_factory.mktemp("runs")
    # Of weather as it is met, 200 rows leave bins of rain and fog empty: coverage fails.
    text = shipped_text("cut-in").decode().replace("\naxes:", "\npriors: even\naxes:", 1)
    (base / "cut-in.yaml").write_text(text, "utf-8")
    for name, (scenario, given) in SEARCHES.items():
        given = {"budget": 200, "keep": 2, "causes": False, **given}
        scenario = base / scenario if scenario.endswith(".yaml") else scenario
        bg.run_search(scenario, **given, out=base / name)
    return {name: base / name for name in SEARCHES}


@pytest.fixture
def run(made, tmp_path):
    """Return a copy of a run by its name."""

    def copy(name: str) -> Path:
        return Path(shutil.copytree(made[name], tmp_path / name))

    return copy


@pytest.fixture
def case(run):
    """Return the exported safety case of a copy of a run, by the run's name."""
    return lambda name: bg.export_safety_case([run(name)])


@pytest.fixture(scope="session")
def cases(made, tmp_path_factory) -> dict:
    """The cases of each run, and of all; read only."""
    base = tmp_path_factory.mktemp("cases")
    found = {name: bg.export_safety_case([path], out=base / name) for name, path in made.items()}
    return found | {"all": bg.export_safety_case([*made.values()], out=base / "all")}


def check(folder: Path) -> tuple[int, list[str], str]:
    """Run the exported script as a stranger would; its status, the lines that differ, its errors.

    -I: no package, no path and no setting of this environment.
    """
    words = [sys.executable, "-I", "-S", str(folder / "recompute.py")]
    done = subprocess.run(words, capture_output=True, text=True, check=False, cwd="/")
    lines = [line for line in done.stdout.splitlines() if line.startswith("DIFFERS")]
    return done.returncode, lines, done.stderr


@pytest.fixture(scope="session")
def checked():
    return check


@pytest.fixture(scope="session")
def edited():
    """Change a case's JSON file by a function of its content."""

    def edit(path: Path, change) -> None:
        data = json.loads(path.read_text("utf-8"))
        change(data)
        path.write_text(json.dumps(data), "utf-8")

    return edit
