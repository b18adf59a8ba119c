"""A run that is confirmed in CARLA: its scenarios, and where the two part."""

import pytest
from tests.approval import refuses

import bridgegen as bg
from bridgegen.base.errors import InputError


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("runs") / "s2"
    bg.run_search(
        "crossroads-s2", algorithm="random", budget=200, seed=2, ego="route-follower", keep=2,
        causes=False, deliver=False, out=place,
    )  # fmt: skip
    return place


def confirm(folder, machine, **settings):
    choice = bg.SimulatorChoice("carla", settings, {"--port": machine.port})
    return bg.confirm(folder, choice, rows=2, again=True)


def test_moved_by_our_own_model_nobody_parts(folder, machine):
    found = confirm(folder, machine, ego="kinematic")
    assert found.summary.ran == 2
    for one in found.scenarios:
        assert one.differences.partings == ()
        assert one.differences.only_here == one.differences.only_there == ()


def test_in_its_own_physics_all_is_told(folder, machine):
    found = confirm(folder, machine)
    assert found.record.label.startswith("carla")
    assert found.summary.ran == 2
    for one in found.scenarios:
        assert one.confirmed is one.there.critical
        assert one.explanation
        assert {each.entity for each in one.differences.partings} <= {"ego", "bv"}


def test_without_a_server_what_was_confirmed_stays(folder, machine):
    confirm(folder, machine)
    path = folder / "confirmation-carla.json"
    before = path.read_bytes()
    machine.die()
    with refuses(InputError):
        confirm(folder, machine)
    assert path.read_bytes() == before
