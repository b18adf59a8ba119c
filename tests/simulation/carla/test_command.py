"""What the command line says where there is no server, or no package."""

import builtins
import re
import socket

import pytest
from tests.approval import approve


@pytest.fixture
def nowhere():
    """A port at which nobody listens."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def test_no_server(cli, nowhere, tmp_path):
    status, _, err = cli(
        "search", "crossroads-s1", "--simulator", "carla", "--port", nowhere,
        "--out", tmp_path / "r",
    )  # fmt: skip
    assert status != 0
    text = " ".join(err.split())
    approve(text, nowhere, "--host", "--port", "--carla-command")
    assert "Traceback" not in err


def test_no_package(cli, monkeypatch, nowhere, tmp_path):
    real = builtins.__import__

    def without(name, *rest, **named):
        if name == "carla":
            raise ImportError("No module named 'carla'")
        return real(name, *rest, **named)

    monkeypatch.setattr(builtins, "__import__", without)
    status, _, err = cli("search", "crossroads-s1", "--simulator", "carla", "--out", tmp_path / "r")
    assert status != 0
    approve(" ".join(err.split()), "carla")


def test_its_options_are_for_it_alone(cli, tmp_path):
    status, _, err = cli("search", "crossroads-s1", "--port", 2000, "--out", tmp_path / "r")
    assert status != 0
    approve(" ".join(err.split()), "--port")


@pytest.mark.parametrize(
    ("option", "value", "text"),
    [("--port", 70000, "0 < port < 65534"), ("--carla-timeout", 0, "0 < timeout must hold")],
)
def test_options_out_of_range(cli, tmp_path, option, value, text):
    status, _, err = cli(
        "search", "crossroads-s1", "--simulator", "carla", option, value, "--out", tmp_path / "r"
    )
    assert status != 0
    assert text in " ".join(err.split())


def test_a_command_that_fails_says_so(cli, nowhere, tmp_path):
    status, _, err = cli(
        "search", "crossroads-s1", "--simulator", "carla", "--port", nowhere,
        "--carla-command", "exit 7", "--out", tmp_path / "r",
    )  # fmt: skip
    assert status != 0
    approve(" ".join(err.split()), "--carla-command")


def test_a_search_in_carla(cli, machine, tmp_path):
    """From the command line to the report, and the settings are recorded, the server is not."""
    import json
    import sqlite3

    status, _, err = cli(
        "search", "crossroads-s1", "--simulator", "carla", "--port", machine.port,
        "--simulator-set", "ego=kinematic", "--budget", 4, "--algorithm", "random", "--no-causes",
        "--triage", "short", "--out", tmp_path / "r",
    )  # fmt: skip
    assert status == 0, err
    assert (tmp_path / "r" / "report.html").exists()
    with sqlite3.connect(tmp_path / "r" / "run.sqlite") as store:
        dump = "\n".join(store.iterdump())
    assert '"simulator": "carla"' in dump
    assert json.dumps({"ego": "kinematic"}) in dump
    assert not re.search(rf"(?<![\d.]){machine.port}(?!\d)", dump)  # digits of a number may be so
    store.close()


@pytest.mark.thorough
def test_what_was_found_is_confirmed_and_simulated_in_carla(cli, machine, tmp_path):
    """A search here; its scenarios there, by CARLA's physics; and one of them by its file."""
    import json

    run = tmp_path / "r"
    status, _, err = cli(
        "search", "crossroads-s4", "--budget", 200, "--no-causes", "--keep", 2,
        "--triage", "short", "--out", run,
    )  # fmt: skip
    assert status == 0, err
    status, out, err = cli("confirm", run, "--simulator", "carla", "--port", machine.port, "--json")
    assert status == 0, err
    assert "carla" in out
    status, out, err = cli(
        "simulate", run / "critical" / "0001.xosc", "--simulator", "carla", "--port", machine.port,
        "--record", tmp_path / "seen", "--json",
    )  # fmt: skip
    assert status == 0, err
    facts = json.loads(out[out.index("{") :])
    assert facts["status"] == "ok"
    kinds = {one["kind"] for one in facts.get("incidents", ())}
    assert kinds <= {"collision", "lane invasion", "red light"}
    assert facts["metrics"]["n_collision"] == 0 or "collision" in kinds
    assert (tmp_path / "seen" / "000001" / "boxes.csv").exists()
