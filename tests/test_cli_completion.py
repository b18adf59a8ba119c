"""What the Tab key completes, as a shell asks for it."""

import os
import subprocess
import sys

import pytest

CALL = "from bridgegen.cli import main; import sys; sys.argv[0] = 'bridgegen'; main()"


def asked(line: str) -> dict[str, str]:
    """Return the variables with which bash asks what completes the end of a line."""
    words = str(len(line.split(" ")) - 1)
    return {"_BRIDGEGEN_COMPLETE": "complete_bash", "COMP_WORDS": line, "COMP_CWORD": words}


def answered(line, cli, monkeypatch) -> list[str]:
    """Return what bash is offered at the end of a line."""
    for name, value in asked(line).items():
        monkeypatch.setenv(name, value)
    code, out, err = cli()
    assert (code, err) == (0, "")
    return out.split()


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
        ("bridgegen benchmark algorithms crossroads-s4 --fix fog_de", ["fog_density="]),
        ("bridgegen search cut-in --algorithm cma-es --set pop", ["population="]),
        ("bridgegen search no-such-scenario --fix fog", []),
        ("bridgegen benchmark algorithms cut-in --algorithms random,ps", ["random,pso"]),
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
def test_what_is_completed(line, expected, cli, monkeypatch):
    assert answered(line, cli, monkeypatch) == expected


def test_a_process_of_its_own_completes_and_warns_of_nothing():
    line = "bridgegen search crossroads-s4 --fix fog_de"
    result = subprocess.run(
        [sys.executable, "-c", CALL],
        env={**os.environ, **asked(line)}, capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert result.stderr == ""
    assert result.stdout.split() == ["fog_density="]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_of_a_shell(shell):
    result = subprocess.run(
        [sys.executable, "-c", CALL],
        env={**os.environ, "_BRIDGEGEN_COMPLETE": f"source_{shell}"},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert "bridgegen" in result.stdout
