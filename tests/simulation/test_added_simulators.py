"""Simulators that installed packages add."""

import sys
from functools import partial

import numpy as np
import pytest
from tests.approval import refuses

import bridgegen as bg
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.simulation import choice
from bridgegen.simulation.choice import Kind, SimulatorChoice

OURS = Kind(
    "twin",
    "The embedded one again, under another name.",
    lambda embedded, storyboard, settings, access: embedded,
    settings={"delay": "how long it waits [s]"},
)


@pytest.fixture
def installed(declare_entry_points):
    sys.modules.setdefault(__name__, sys.modules[__name__])
    return partial(declare_entry_points, choice.SIMULATORS, "bridgegen.simulators", __name__)


def test_a_search_runs_in_a_package_s_simulator(installed, tmp_path):
    installed(twin="OURS")
    there, here = (
        bg.run_search(
            "crossroads-s4", algorithm="random", budget=20, ego="route-follower", deliver=False,
            out=tmp_path / name, simulator=SimulatorChoice(name), causes=False,
        ).frame()
        for name in ("twin", "embedded")
    )  # fmt: skip
    np.testing.assert_array_equal(there["d_min"], here["d_min"])


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("gone", "Nothing", "cannot be loaded: AttributeError"),
        ("not_one", "test_a_package_that_is_wrong_is_named", "must be a .*Kind, got function"),
        ("other", "OURS", "has the name 'twin'"),
    ],
)
def test_a_package_that_is_wrong_is_named(installed, name, value, message):
    installed(**{name: value})
    with pytest.raises(InputError, match=f"simulator '{name}'.*{message}"):
        SimulatorChoice(name)


def test_settings_and_names_are_checked(installed):
    installed(twin="OURS")
    with refuses(UnknownNameError, "delay"):
        SimulatorChoice("twin", {"dilay": 1.0})
    with refuses(UnknownNameError, "twin"):
        SimulatorChoice("twim")
