"""What cannot be run is left out if that is wanted, and all else runs as it would without it."""

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import InputError
from bridgegen.openx.openscenario.read import read
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator

from .storyboards import after, crossroads, ended, events, lane, scenario, speeding, start, vehicle

EGO = start("ego", lane(1, 1, 90.0), 0.0, lane(1, 1, 90.0), lane(3, -1, 50.0))
BV = start("bv", lane(3, 1, 90.0), 10.0)
FASTER = ("faster", "bv", speeding(20, "linear time 2"), after(1.0))
NOWHERE = '<Position><GeoPosition latitudeDeg="48" longitudeDeg="11"/></Position>'
BEAM = f"<TeleportAction>{NOWHERE}</TeleportAction>"


def simulator(text: str, skipped: list[str] | None) -> EmbeddedSimulator:
    return EmbeddedSimulator(read(text.encode(), "t.xosc"), "t.xosc", skipped=skipped)


def rolled_out(made: EmbeddedSimulator):
    return made.run(made.roads([crossroads()]), np.zeros(1, dtype=np.int64), {})


def test_an_event_goes_and_who_waits_for_it():
    beam, waits = ("beam", "bv", BEAM, after(0.5)), ("waits", "bv", BEAM, ended("beam"))
    kept = scenario(("ego", "bv"), EGO + BV, events(FASTER))
    text = scenario(("ego", "bv"), EGO + BV, events(FASTER, beam, waits))
    with pytest.raises(InputError):
        simulator(text, None)
    skipped: list[str] = []
    ours, plain = rolled_out(simulator(text, skipped)), rolled_out(simulator(kept, None))
    assert np.array_equal(ours.x, plain.x)
    assert ours.event_names == plain.event_names == ("faster",)
    assert all(one.startswith("t.xosc, line ") for one in skipped)
    assert len(skipped) >= 2


def test_an_entity_that_starts_nowhere_goes_with_all_that_it_does():
    lost = start("lost", NOWHERE, 5.0)
    text = scenario(
        ("ego", "bv", "lost"), EGO + BV + lost,
        events(FASTER, ("its", "lost", speeding(1, "step time 0"), after(1.0))),
    )  # fmt: skip
    skipped: list[str] = []
    made = simulator(text, skipped)
    assert made.program.names == ("ego", "bv")
    assert made.program.event_names == ("faster",)
    approve(skipped, "lost", "TeleportAction")


def test_the_ego_never_goes():
    text = scenario(("ego", "bv"), start("ego", NOWHERE, 5.0) + BV)
    with refuses(InputError, "ego", "TeleportAction"):
        simulator(text, [])


def test_a_trailer_goes_and_its_car_stays():
    car = vehicle("bv").replace("</Vehicle>", "<Trailer>" + vehicle("it").replace(
        "ScenarioObject", "Trailer") + "</Trailer></Vehicle>")  # fmt: skip
    text = scenario(("ego", "bv"), EGO + BV).replace(vehicle("bv"), car)
    skipped: list[str] = []
    made = simulator(text, skipped)
    assert made.program.absent.tolist() == [0, 0, 1]  # nothing places or moves it any more
    approve((*skipped, *made.program.notes), "TrailerHitch", "'it' is absent")


def test_what_runs_is_left_alone():
    skipped: list[str] = []
    simulator(scenario(("ego", "bv"), EGO + BV, events(FASTER)), skipped)
    assert skipped == []
