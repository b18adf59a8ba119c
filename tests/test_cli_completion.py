"""What the Tab key completes, as a shell asks for it."""

import os
import subprocess
import sys

import pytest

CALL = "from bridgegen.cli import main; import sys; sys.argv[0] = 'bridgegen'; main()"


def completed(line: str) -> list[str]:
    """Return what bash is offered at the end of a line."""
    words = line.split(" ")
    asked = {"COMP_WORDS": line, "COMP_CWORD": str(len(words) - 1)}
    result = subprocess.run(
        [sys.executable, "-c", CALL],
        env={**os.environ, "_BRIDGEGEN_COMPLETE": "complete_bash", **asked},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert result.stderr == ""
    return result.stdout.split()


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("bridgegen search crossroads-s", [f"crossroads-s{k}" for k in (1, 2, 3, 4)]),
        ("bridgegen search cut-in --algorithm ps", ["pso"]),
        ("bridgegen search cut-in --ego ref", ["reference"]),
        ("bridgegen search cut-in --metrics pet,dra", ["pet,drac"]),
        ("bridgegen search cut-in --axes static,wea", ["static,weather"]),
        ("bridgegen search cut-in --cause pla", ["planning"]),
        ("bridgegen search crossroads-s4 --fix fog_de", ["fog_density="]),
        ("bridgegen search --fix fog_density=80 crossroads-s4 --fix rain", []),
        ("bridgegen compare crossroads-s4 --fix fog_de", ["fog_density="]),
        ("bridgegen search cut-in --algorithm cma-es --set pop", ["population="]),
        ("bridgegen search no-such-scenario --fix fog", []),
        ("bridgegen compare cut-in --algorithms random,ps", ["random,pso"]),
        ("bridgegen export run --flavour rec", ["recorded"]),
        ("bridgegen confirm run --simulator es", ["esmini"]),
        ("bridgegen sea", ["search"]),
        ("bridgegen suite crossroads-s", [f"crossroads-s{k}" for k in (1, 2, 3, 4)]),
        ("bridgegen suite --jun", ["--junit"]),
        ("bridgegen suite cut-in --ego ref", ["reference"]),
        ("bridgegen suite ad", ["add"]),
        ("bridgegen suite cut-in rep", []),
        ("bridgegen suite add runs/a --to", ["--to"]),
    ],
)
def test_what_is_completed(line, expected):
    assert completed(line) == expected


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_of_a_shell(shell):
    result = subprocess.run(
        [sys.executable, "-c", CALL],
        env={**os.environ, "_BRIDGEGEN_COMPLETE": f"source_{shell}"},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert "bridgegen" in result.stdout
