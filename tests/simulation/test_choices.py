"""What others choose: people who wait, indicators that mislead, doors that open."""

from importlib.resources import files

import numpy as np
import pytest
from tests.approval import refuses
from tests.simulation.embedded.test_language import there_and_back

import bridgegen as bg
from bridgegen.base.errors import ScenarioError
from bridgegen.drivers.kinds import NAMES
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load

RED, YELLOW, GREEN = 1, 3, 4
KERB_EAST = 3.5  # m east of the leg's middle: one lane


@pytest.fixture
def moved(tmp_path):
    def move(name, *changes, ego="route-follower", **values):
        text = (files("bridgegen") / f"scenario/catalogue/{name}.yaml").read_text("utf-8")
        for old, new in changes:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "mine.yaml"
        path.write_text(text, "utf-8")
        return bg.model(str(path), ego=ego).rollout(values)

    return move


NEAR = "      - {kind: distance, to: ego, value: trigger_distance}\n"
AT_ONCE = NEAR, NEAR + "      - {kind: time, value: 0.0}\n"
LAWFUL = "driver: insistent", "driver: lawful"


def test_a_lawful_pedestrian_waits_until_the_traffic_over_its_crosswalk_has_red(moved):
    """Green ends 8 s after the start, yellow 3 s later; one who is not lawful goes at once."""
    ends = "signal_offset: 5.0", "signal_offset: 22.0"
    insistent = moved("crosses-on-red", AT_ONCE, ends).rollout
    lawful = moved("crosses-on-red", AT_ONCE, ends, LAWFUL).rollout
    k, j = (int(np.argmax(each.x[0, 1] < KERB_EAST)) for each in (insistent, lawful))
    assert insistent.lights[0, 2, k] == GREEN
    assert lawful.lights[0, 2, j - 1] == RED
    assert lawful.lights[0, 2, j - 30] == YELLOW
    assert lawful.x[0, 1, :j].min() > KERB_EAST
    # Its kerb is a stop line for the judgement, too: of the light that the traffic has.
    assert (insistent.stop_entities.tolist(), insistent.stop_lights.tolist()) == ([0, 1], [0, ~2])


def test_who_crosses_on_red_is_responsible_where_the_ego_could_not_stop(moved):
    late = moved("crosses-on-red", early=0.0, ego_speed=13.0, pace=2.5).conflict
    early = moved("crosses-on-red", early=0.5, ego_speed=7.0, pace=1.0).conflict
    assert (late.conflict, late.responsible, late.rule) == ("contact", "other", "red light")
    assert (early.conflict, early.rule) == ("contact", "could have stopped")
    assert early.responsible == "ego"


@pytest.mark.parametrize(("start", "first"), [(45.0, False), (70.0, False), (110.0, True)])
def test_a_lawful_pedestrian_waits_for_the_critical_gap_of_the_highway_capacity_manual(
    moved, start, first
):
    """At 1.4 m/s, from the kerb to 0.6 m beyond the ego's path, 3.6 m: 2.6 s, and 3 s."""
    rollout = moved(
        "pedestrian-off-crosswalk",
        AT_ONCE,
        ("type: pedestrian", "type: pedestrian\n    driver: lawful"),
        ("{distance: 150.0, offset: walker_from}", f"{{distance: {start + 20.0}, offset: -4.5}}"),
        ("{lane: sidewalk, distance: 150.0}", f"{{distance: {start + 20.0}, offset: 8.0}}"),
        ego_speed=10.0,
        walker_speed=1.4,
    ).rollout
    ego, walker = rollout.names.index("ego"), rollout.names.index("walker")
    on_road = int(np.argmax(rollout.y[0, walker] > -3.5))
    passes = int(np.argmax(rollout.x[0, ego] > rollout.x[0, walker, 0]))
    assert (on_road < passes) == first
    if first:
        left = rollout.x[0, walker, 0] - rollout.x[0, ego, on_road] - 3.7
        assert left / 10.0 > 5.6 - 0.5
    else:  # it waits within half a metre and a step before the kerb
        assert -3.5 - 1.0 < rollout.y[0, walker, passes] < -3.5


def test_a_lawful_cyclist_gives_way_at_a_sign(moved):
    """The ego has the road with priority; the cyclist would meet it after 6 s."""
    lawful = moved("cyclist-crosses", ("driver: scripted", "driver: lawful")).rollout
    attentive = moved("cyclist-crosses", ("driver: scripted", "driver: attentive")).rollout
    e = lawful.names.index("cyclist")
    assert lawful.v[0, e, : lawful.n_steps[0]].min() < 2.0
    assert attentive.v[0, e, : attentive.n_steps[0]].min() > 4.0


def test_one_that_indicates_slows_down_and_goes_on_shares_the_responsibility(moved):
    slow = moved("indicates-goes-straight", slow_speed=6.0, early=0.3).conflict
    fast = moved("indicates-goes-straight", slow_speed=13.5, early=0.3).conflict
    assert (slow.conflict, slow.responsible, slow.rule) == ("contact", "shared", "misled")
    assert (fast.conflict, fast.responsible, fast.rule) == ("contact", "ego", "signs")


def test_a_door_comes_out_of_the_side_and_turns_within_its_time(moved):
    found = moved("door-opens", opens_at=30.0, parked_aside=0.2)
    rollout, door = found.rollout, found.rollout.names.index("parked_left_door")
    assert NAMES[rollout.kinds[door]] == "other"
    (there,) = np.nonzero(rollout.present[0, door])
    first, turned = there[0], rollout.h[0, door]
    assert first > 0
    assert rollout.present[0, door, first:].all()
    assert turned[first] == pytest.approx(0.0, abs=0.02)
    assert turned[first + 21] == pytest.approx(-np.radians(70.0), abs=0.03)
    assert rollout.v[0, door, first + 22] == 0.0
    # Its tip: 1.1 m from the hinge, across the car by 1.03 m, 0.06 m beside the car's side.
    side = -4.65 + 0.2 + 0.95 + 0.06
    hinge = rollout.y[0, door, first + 22]
    assert hinge == pytest.approx(side, abs=0.03)
    assert hinge - 1.1 * np.sin(turned[first + 22]) == pytest.approx(side + 1.03, abs=0.03)
    assert (found.conflict.responsible, found.conflict.rule) == ("ego", "standing ahead")
    late = moved("door-opens", opens_at=12.0).conflict
    assert (late.responsible, late.rule) == ("other", "opened")


def test_the_files_say_a_door_there_and_back():
    scenario = load("door-opens")
    there_and_back(Pipeline(scenario, scenario.space()))


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("time: 1.0", "time: 0.0"),
        ("participant: parked\n", "participant: ego\n"),
        ("offset: parked_aside}", "offset: parked_aside}\n    heading: 90.0"),
        ("door: left\n", "door: left\n    speed: 1.0\n"),
    ],
)
def test_a_door_is_of_a_vehicle_that_stands(moved, old, new):
    with refuses(ScenarioError, "door"):
        moved("door-opens", (old, new))
