"""The options of how a simulator is reached."""

import inspect

import pytest
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.cli import runs
from bridgegen.cli.connection import (
    NO_CONNECTION,
    OPTIONS,
    Connection,
    read_access,
    with_connection_options,
)
from bridgegen.cli.options import read_simulators
from bridgegen.cli.results import confirm, regions
from bridgegen.simulation.choice import SIMULATORS


def test_there_is_one_for_each_way_that_a_simulator_declares():
    declared = {name for one in SIMULATORS.values() for name in one.access}
    assert {f"--{name.replace('_', '-')}" for name in OPTIONS} == declared


@pytest.mark.parametrize("command", [runs.search, runs.resume, regions, runs.simulate, confirm])
def test_commands_have_them_all(command):
    assert {*OPTIONS} <= {*inspect.signature(command).parameters}


def test_a_command_gets_the_values_by_their_options_spelling():
    values = []

    @with_connection_options
    def command(run: str, connection: Connection = NO_CONNECTION) -> None:
        values.append((run, connection))

    command(run="r", **dict.fromkeys(OPTIONS))
    command(run="r", **dict.fromkeys(OPTIONS) | {"host": "there", "carla_timeout": 3.0})
    assert values == [("r", {}), ("r", {"--host": "there", "--carla-timeout": 3.0})]


def test_what_a_command_means_by_the_same_name_stays_its_own():
    values = []

    @with_connection_options
    def command(port: int = 0, connection: Connection = NO_CONNECTION) -> None:
        values.append((port, connection))

    assert "carla_port" in inspect.signature(command).parameters
    rest = dict.fromkeys(inspect.signature(command).parameters)
    command(**rest | {"port": 80, "carla_port": 2000})
    assert values == [(80, {"--port": 2000})]


def test_the_choice_of_a_run_s_simulator():
    assert read_access({}) is None
    choice = read_access({"--esmini-lib": "there"})
    assert choice is not None
    assert (choice.name, choice.access) == ("esmini", {"--esmini-lib": "there"})


@pytest.mark.parametrize(
    ("simulator", "screen", "own", "cheap"),
    [
        ("esmini", "embedded", {"--esmini-lib": "x"}, {}),
        ("carla", "esmini", {"--port": 1}, {"--esmini-lib": "x"}),
        ("esmini", "esmini", {"--esmini-lib": "x"}, {"--esmini-lib": "x"}),
    ],
)
def test_a_connection_is_the_simulator_s_or_the_screen_s(simulator, screen, own, cheap):
    chosen, other = read_simulators(simulator, None, screen, None, {**own, **cheap})
    assert (chosen.name, chosen.access) == (simulator, own)
    assert (other.name, other.access) == (screen, cheap)


def test_a_screen_s_settings_need_a_screen():
    with refuses(InputError, "--screen-set"):
        read_simulators("esmini", None, None, ["steps=2"], {})
    _, other = read_simulators(None, None, "esmini", ["steps=2"], {})
    assert other.settings == {"steps": 2}
