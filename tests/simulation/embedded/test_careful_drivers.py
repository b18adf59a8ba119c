"""The careful drivers in whole scenarios: what they avoid, and what nobody could."""

import numpy as np
import pytest

from .storyboards import (
    after,
    crossroads,
    event,
    events,
    friction,
    lane,
    lateral,
    run,
    scenario,
    simulator,
    speed_action,
    start,
)

CAREFUL = ("careful", "careful-fsm")
SOUTHBOUND = start("ego", lane(3, 1, 80.0), 10.0, lane(3, 1, 80.0), lane(1, -1, 90.0))
WAITING = start("bv", lane(2, 1, 40.0), 0.0, lane(2, 1, 40.0), lane(4, -1, 90.0))
CROSSES = event("bv", speed_action(8.0, "linear rate 4.0"), after(2.0))
STANDS = start("bv", lane(3, 1, 20.0), 0.0, lane(3, 1, 20.0), lane(1, -1, 90.0))


def gap(rollout):
    return rollout.distance[0, 1, : rollout.n_steps[0]].min()


@pytest.mark.parametrize("ego", CAREFUL)
def test_they_stop_behind_a_standing_car_and_stay_on_their_lane(ego):
    rollout = run(scenario(("ego", "bv"), SOUTHBOUND + STANDS), ego)
    assert rollout.v[0, 0, -1] < 0.5
    assert gap(rollout) > 0.3
    assert np.abs(rollout.offset[0, 0]).max() < 0.1
    assert gap(run(scenario(("ego", "bv"), SOUTHBOUND + STANDS))) == 0.0  # who does not look


@pytest.mark.parametrize("ego", CAREFUL)
def test_they_go_on_when_the_way_is_clear_again(ego):
    text = scenario(("ego", "bv"), SOUTHBOUND + WAITING, CROSSES)
    rollout = run(text, ego)
    assert gap(rollout) > 0.0
    assert rollout.v[0, 0].min() < 8.0
    assert rollout.v[0, 0, -1] > rollout.v[0, 0].min() + 0.3


@pytest.mark.parametrize("ego", CAREFUL)
def test_on_ice_they_slide_into_what_they_stop_for_on_a_dry_road(ego):
    privates = SOUTHBOUND.replace('value="10.0"', 'value="17.0"') + STANDS
    assert gap(run(scenario(("ego", "bv"), privates), ego)) > 0.3
    assert gap(run(scenario(("ego", "bv"), privates, environment=friction(0.1)), ego)) == 0.0


def test_a_cut_in_is_braked_for_after_the_regulations_delay():
    # On leg C the right-hand lane is 2; it drifts by 3.5 m in 3 s, from 1 s on.
    cuts = events(("cut", "bv", lateral(1, "linear time 3"), after(1.0)))
    ego = start("ego", lane(3, 1, 90.0), 15.0, lane(3, 1, 90.0), lane(1, -1, 90.0))
    bv = start("bv", lane(3, 2, 62.0), 6.0, lane(3, 2, 62.0), lane(1, -2, 90.0))
    rollout = run(scenario(("ego", "bv"), ego + bv, cuts), "careful")
    centre = rollout.x[0, 1] + 1.4 * np.cos(rollout.h[0, 1])  # leg C leads south
    told = int(np.argmax(np.abs(centre - centre[0]) > 0.375)) * 0.05
    brakes = int(np.argmax(rollout.a[0, 0] < -0.3)) * 0.05
    assert 1.0 < told < 1.4
    assert brakes == pytest.approx(told + 0.4 + 0.75, abs=0.051)
    assert rollout.a[0, 0].min() == pytest.approx(-0.774 * 9.81)


@pytest.mark.parametrize("ego", CAREFUL)
def test_a_row_depends_on_itself_alone_and_lock_step_gives_the_same(ego):
    parameters = """<ParameterDeclaration name="speed" parameterType="double" value="10"/>"""
    text = scenario(
        ("ego", "bv"), SOUTHBOUND.replace('value="10.0"', 'value="$speed"') + WAITING, CROSSES,
        parameters=parameters,
    )  # fmt: skip
    speeds = [6.0, 9.0, 12.0, 14.0]
    whole = run(text, ego, speed=speeds)
    for i, one in enumerate(speeds):
        alone = run(text, ego, speed=[one])
        np.testing.assert_array_equal(alone.x[0], whole.x[i])
        np.testing.assert_array_equal(alone.a[0], whole.a[i])
    made = simulator(text, ego)
    batch = made.batch(
        made.roads([crossroads()]), np.zeros(4, dtype=np.int64), {"speed": np.array(speeds)}
    )
    batch.start()
    for k in range(batch.record.x.shape[2]):
        if not batch.running.any():
            break
        batch.before_driver(k)
        batch.after_driver(k, *batch.demand(k))
    np.testing.assert_array_equal(batch.rollout().x, whole.x)
