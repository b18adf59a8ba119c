"""Scenarios whose cause is known beforehand, replayed by the simulator."""

from dataclasses import replace

import numpy as np
import pytest

from bridgegen.assess import metrics
from bridgegen.assess.cause import Cause, Counterfactual, causes, counterfactuals
from bridgegen.assess.objective import CLASSIFYING, Objective
from bridgegen.drivers import DRIVERS

from .storyboards import crossroads, friction, lane, scenario, simulator, start
from .test_timed import timed, vertex

CRITICAL = Objective.build([("d_min", 1.0)]).critical


def ego(speed: float) -> str:
    return start("ego", lane(3, 1, 90.0), speed, lane(3, 1, 90.0), lane(1, -1, 90.0))


STANDS = start("bv", lane(3, 1, 20.0), 0.0, lane(3, 1, 20.0), lane(1, -1, 90.0))
# The ego comes down x = −1.75 from y = 103; its front passes y = 60 after 3.9 s at 10 m/s.
STEPS_OUT = timed(
    "walker", vertex(0, -4.5, 60.0), vertex(3.6, -4.5, 60.0), vertex(5.0, -1.75, 60.0)
)


def cause(text: str, driver: str) -> Cause:
    """Seek the cause of one scenario, which must be critical."""
    made = simulator(text, driver)
    roads, rows = made.roads([crossroads()]), np.zeros(1, dtype=np.int64)

    def critical(replay: Counterfactual | None = None) -> np.ndarray:
        changes = {} if replay is None else {"driver": replay.driver, "dry": replay.dry}
        rollout = made.run(roads, rows, {}, **changes)
        assert rollout.status.tolist() == [0]
        return CRITICAL(metrics.evaluate(rollout, CLASSIFYING), CLASSIFYING)

    assert critical().tolist() == [True]
    replays = counterfactuals(DRIVERS[driver])
    return Cause(causes(replays, critical(), lambda at, replay: ~critical(replay))[0])


def test_a_driver_that_does_not_look_plans_badly():
    assert cause(scenario(("ego", "bv"), ego(10.0) + STANDS), "route-follower") is Cause.PLANNING


@pytest.mark.parametrize("driver", ["reference", "careful", "careful-fsm"])
def test_ice_is_a_matter_of_control(driver):
    text = scenario(("ego", "bv"), ego(15.0) + STANDS, environment=friction(0.1))
    assert cause(text, driver) is Cause.CONTROL


@pytest.mark.parametrize("driver", ["route-follower", "reference", "careful", "careful-fsm"])
def test_who_steps_out_three_metres_ahead_cannot_be_avoided(driver):
    text = scenario(("ego", "walker"), ego(10.0) + STEPS_OUT)
    assert cause(text, driver) is Cause.UNAVOIDABLE


def test_on_ice_a_driver_that_does_not_look_is_past_help_by_one_change():
    text = scenario(("ego", "bv"), ego(15.0) + STANDS, environment=friction(0.1))
    assert cause(text, "route-follower") is Cause.UNAVOIDABLE


def test_a_dry_road_is_one_without_the_file_s_friction():
    wet = simulator(scenario(("ego", "bv"), ego(15.0) + STANDS, environment=friction(0.4)), "fsm")
    dry = simulator(scenario(("ego", "bv"), ego(15.0) + STANDS), "fsm")
    row = np.zeros(1, dtype=np.int64)
    replayed = wet.run(wet.roads([crossroads()]), row, {}, dry=True)
    plain = dry.run(dry.roads([crossroads()]), row, {})
    np.testing.assert_array_equal(replayed.x, plain.x)
    assert (wet.run(wet.roads([crossroads()]), row, {}).x != plain.x).any()
    # Parameters and literals of the same value as the friction are left alone.
    assert wet.program.changed(dry=True).slots == wet.program.slots


def test_another_driver_drives_as_if_the_file_had_named_it():
    text = scenario(("ego", "bv"), ego(12.0) + STANDS)
    made, row = simulator(text), np.zeros(1, dtype=np.int64)
    roads = made.roads([crossroads()])
    for name in ("reference", "fsm"):
        replayed = made.run(roads, row, {}, driver=DRIVERS[name])
        named = simulator(text, name)
        np.testing.assert_array_equal(replayed.x, named.run(roads, row, {}).x)


def test_nobody_drives_an_ego_with_a_timetable():
    way = timed("ego", vertex(0, 0.0, 0.0), vertex(5, 50.0, 0.0))
    made = simulator(scenario(("ego",), ego(10.0)))
    program = replace(made.program, driver=DRIVERS["fsm"])
    assert program.changed(driver=DRIVERS["reference"]).driver.name == "reference"
    from bridgegen.openx.openscenario.read import read
    from bridgegen.simulation.embedded.simulator import EmbeddedSimulator

    timed_ego = EmbeddedSimulator(read(scenario(("ego",), way).encode(), "t.xosc"), "t.xosc")
    assert timed_ego.program.changed(driver=DRIVERS["fsm"]) is timed_ego.program
