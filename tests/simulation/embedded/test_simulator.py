"""Hand-worked scenarios: what the numbers must be, from school physics."""

import json
import math
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.approval import approve, refuses

from bridgegen.base.errors import InputError, UnsupportedError
from bridgegen.simulation.rollout import STATUS_MESSAGES, joined

from .storyboards import (
    after,
    crossroads,
    event,
    events,
    friction,
    lane,
    lateral,
    near,
    reaches,
    run,
    scenario,
    simulator,
    speed_action,
    start,
)

DT = 0.05
# Road 1 is leg A (south), 2 B (west), 3 C (north), 4 D (east); lane 1 leads in, -1 out.
SOUTHBOUND = start("ego", lane(3, 1, 80.0), 10.0, lane(3, 1, 80.0), lane(1, -1, 90.0))
LEFT_TURN = start("ego", lane(3, 1, 40.0), 9.0, lane(3, 1, 40.0), lane(4, -1, 90.0))
WAITING = start("bv", lane(2, 1, 50.0), 0.0, lane(2, 1, 50.0), lane(4, -1, 90.0))


def test_the_ego_drives_straight_at_its_speed():
    rollout = run(scenario(("ego",), SOUTHBOUND))
    t = np.arange(201) * DT
    # Leg C leaves the junction at y = 13; its inner inbound lane's centre is at x = -1.75.
    np.testing.assert_allclose(rollout.x[0, 0], -1.75, atol=1e-9)
    np.testing.assert_allclose(rollout.y[0, 0], 13.0 + 80.0 - 10.0 * t, atol=1e-9)
    np.testing.assert_allclose(rollout.h[0, 0], rollout.h[0, 0, 0], atol=1e-12)
    assert math.cos(rollout.h[0, 0, 0] + math.pi / 2) == pytest.approx(1.0)
    assert rollout.n_steps[0] == 201
    assert (rollout.v[0, 0] == 10.0).all()


def test_a_speed_action_at_a_rate_from_a_time():
    go = event("bv", speed_action(6.0, "linear rate 3.0"), after(3.0))
    rollout = run(scenario(("ego", "bv"), SOUTHBOUND + WAITING, go))
    t = np.arange(201) * DT
    expected = np.clip(3.0 * (t - 3.0), 0.0, 6.0)
    np.testing.assert_allclose(rollout.v[0, 1], expected, atol=1e-9)
    # 6 m/s is reached after 2 s and 6 m; then 5 s at 6 m/s.
    assert rollout.x[0, 1, -1] - rollout.x[0, 1, 0] == pytest.approx(6.0 + 30.0, abs=1e-6)


def test_a_speed_action_over_a_time():
    go = event("bv", speed_action(8.0, "linear time 4.0"), after(2.0))
    rollout = run(scenario(("ego", "bv"), SOUTHBOUND + WAITING, go))
    assert rollout.v[0, 1, 80] == pytest.approx(4.0)  # half of it after half of the time
    assert rollout.v[0, 1, 120] == pytest.approx(8.0)


def test_a_distance_trigger_fires_at_the_first_instant_within_it():
    go = event("bv", speed_action(5.0), near("bv", "ego", 80.0))
    rollout = run(scenario(("ego", "bv"), SOUTHBOUND + WAITING, go))
    gap = np.hypot(rollout.x[0, 0] - rollout.x[0, 1], rollout.y[0, 0] - rollout.y[0, 1])
    first = int(np.argmax(gap <= 80.0))
    assert first > 0
    assert (rollout.v[0, 1, : first + 1] == 0.0).all()
    assert rollout.v[0, 1, first + 1] == 5.0


def test_alternative_groups_and_joint_conditions():
    both = event("bv", speed_action(5.0), after(1.0) + after(4.0))
    either = event("bv", speed_action(5.0), after(1.0), after(4.0))
    for go, seconds in ((both, 4.0), (either, 1.0)):
        rollout = run(scenario(("ego", "bv"), SOUTHBOUND + WAITING, go))
        assert int(np.argmax(rollout.v[0, 1] > 0.0)) == round(seconds / DT) + 1


@pytest.mark.parametrize(
    ("condition", "instant"),
    [
        (after(2.0, edge="rising"), 40),
        (after(2.0, edge="risingOrFalling"), 40),
        (after(2.0, edge="falling"), None),
        (after(0.0, edge="none"), 0),
        (after(0.0, edge="rising"), None),  # true from the start: it never rises
        (after(2.0, edge="rising", delay=1.0), 60),
        (after(2.0, delay=0.5), 50),
    ],
)
def test_edges_and_delays(condition, instant):
    rollout = run(
        scenario(("ego", "bv"), SOUTHBOUND + WAITING, event("bv", speed_action(5.0), condition))
    )
    moves = np.flatnonzero(rollout.v[0, 1] > 0.0)
    assert (moves[0] - 1 if len(moves) else None) == instant


def test_it_stops_where_the_stop_trigger_says_and_repeats_the_last_state():
    rollout = run(scenario(("ego",), SOUTHBOUND, stop=(reaches("ego", lane(1, -1, 20.0), 2.0),)))
    # From s = 80 through 26 m of junction to 18 m down leg A takes 12.4 s; the file ends at 10 s.
    assert rollout.n_steps[0] == 201
    near_end = run(scenario(("ego",), SOUTHBOUND, stop=(reaches("ego", lane(3, 1, 30.0), 2.0),)))
    last = near_end.n_steps[0] - 1
    assert last == round((80.0 - 32.0) / 10.0 / DT)
    assert (near_end.y[0, 0, last:] == near_end.y[0, 0, last]).all()


def test_the_route_s_end_ends_the_ego_s_scenario_and_the_others_leave_at_the_road_s():
    short = start("ego", lane(1, -1, 70.0), 10.0)
    assert run(scenario(("ego",), short)).n_steps[0] == round(30.0 / 10.0 / DT) + 1
    bv = start("bv", lane(4, -1, 80.0), 10.0)
    rollout = run(scenario(("ego", "bv"), SOUTHBOUND + bv))
    # 20 m to the road's end at 10 m/s: from instant 40 on it is gone, and never slower
    assert rollout.present[0, 1].tolist() == [True] * 40 + [False] * 161
    assert rollout.x[0, 1, 39] == pytest.approx(113.0 - 0.5)
    assert (rollout.v[0, 1] == 10.0).all()
    assert (rollout.a[0, 1] == 0.0).all()
    assert np.isinf(rollout.distance[0, 1, 40:]).all()


def test_others_stand_at_the_road_s_end_where_the_file_says_so():
    bv = start("bv", lane(4, -1, 80.0), 10.0)
    text = scenario(("ego", "bv"), SOUTHBOUND + bv)
    said = '<FileHeader{}><Properties><Property name="road_end" value="{}"/></Properties>'
    head = text[text.index("<FileHeader") + 11 : text.index("/>", text.index("<FileHeader"))]
    stays = text.replace(f"<FileHeader{head}/>", said.format(head, "stand") + "</FileHeader>")
    rollout = run(stays)
    assert rollout.present.size == 0
    assert rollout.x[0, 1, -1] == pytest.approx(113.0)
    assert rollout.v[0, 1, -1] == 0.0
    with refuses(InputError, "stand", "fly"):
        run(stays.replace('"stand"', '"fly"'))


def test_who_stands_at_the_road_s_end_from_the_start_does_not_leave():
    bv = start("bv", lane(4, -1, 100.0), 0.0)
    assert run(scenario(("ego", "bv"), SOUTHBOUND + bv)).present.size == 0


def test_where_some_leave_and_others_do_not_rows_are_as_they_are_alone():
    bv = start("bv", lane(4, -1, "$s"), 10.0)
    text = scenario(
        ("ego", "bv"), SOUTHBOUND + bv,
        parameters='<ParameterDeclaration name="s" parameterType="double" value="80"/>',
    )  # fmt: skip
    both = run(text, s=[80.0, 0.0])
    for row, s in enumerate((80.0, 0.0)):
        alone = run(text, s=[s])
        assert (both.x[row] == alone.x[0]).all()
        there = alone.present[0] if alone.present.size else np.ones_like(both.present[row])
        assert (both.present[row] == there).all()
    parts = [(np.array([1]), run(text, s=[0.0])), (np.array([0]), run(text, s=[80.0]))]
    assert (joined(parts).present == both.present).all()


@given(st.floats(0.2, 1.0), st.floats(4.0, 15.0))
@settings(max_examples=25)
def test_tyres_never_give_more_than_friction_allows(scale, speed):
    ego = start("ego", lane(3, 1, 40.0), speed, lane(3, 1, 40.0), lane(4, -1, 90.0))
    rollout = run(scenario(("ego",), ego, environment=friction(scale)))
    k = rollout.n_steps[0] - 1
    turn = np.diff(rollout.h[0, 0, : k + 1]) / DT
    lateral = 0.5 * (rollout.v[0, 0, :k] + rollout.v[0, 0, 1 : k + 1]) * turn
    total = np.hypot(lateral, rollout.a[0, 0, :k])
    assert total.max() <= 0.85 * 9.81 * scale * (1.0 + 1e-2)


def test_less_friction_carries_the_ego_further_out_of_the_bend():
    text = scenario(
        ("ego",),
        LEFT_TURN,
        parameters='<ParameterDeclaration name="mu" parameterType="double" value="1"/>',
        environment=friction("$mu"),
    )
    rollout = run(text, mu=[1.0, 0.6, 0.5, 0.4, 0.3])
    offset = np.abs(rollout.offset[:, 0]).max(axis=1)
    assert offset[0] < 0.5
    assert (np.diff(offset[1:]) > 0.0).all()


def test_the_reference_driver_stops_for_a_body_that_stands_in_its_way():
    blocked = start("bv", lane(1, -1, 20.0), 0.0)
    text = scenario(("ego", "bv"), SOUTHBOUND.replace('s="80.0"', 's="30.0"') + blocked)
    assert run(text, "reference").distance[0, 1].min() > 0.5
    assert run(text, "route-follower").distance[0, 1].min() == 0.0


def test_the_reference_driver_lets_a_crossing_body_pass():
    crossing = start("bv", lane(2, 1, 45.0), 6.0, lane(2, 1, 45.0), lane(4, -1, 90.0))
    text = scenario(("ego", "bv"), SOUTHBOUND + crossing)
    yielding, blind = run(text, "reference"), run(text, "route-follower")
    assert blind.distance[0, 1].min() == 0.0
    assert yielding.distance[0, 1].min() > 0.0
    assert yielding.v[0, 0].min() < 8.0


def test_a_start_off_the_route_is_a_status_not_an_error():
    text = scenario(
        ("ego",),
        start("ego", lane(3, 1, "$s"), 10.0, lane(3, 1, 50.0), lane(1, -1, 90.0)),
        parameters='<ParameterDeclaration name="s" parameterType="double" value="50"/>',
    )
    rollout = run(text, s=[50.0, 140.0])
    assert rollout.status.tolist() == [0, 2]
    assert "route" in STATUS_MESSAGES[2]
    assert np.isfinite(rollout.x).all()


def test_a_row_is_the_same_to_the_last_bit_whatever_its_batch():
    text = scenario(
        ("ego", "bv"),
        LEFT_TURN.replace('value="9.0"', 'value="$v"') + WAITING,
        event("bv", speed_action("$w", "linear rate 2"), after("$t"), near("bv", "ego", 30.0)),
        parameters="".join(
            f'<ParameterDeclaration name="{name}" parameterType="double" value="{value}"/>'
            for name, value in (("v", 8), ("w", 4), ("t", 2))
        ),
    )
    rng = np.random.default_rng(7)
    values = {"v": rng.uniform(4, 12, 30), "w": rng.uniform(1, 8, 30), "t": rng.uniform(0, 8, 30)}
    whole = run(text, "reference", **values)
    for order in (np.arange(29, -1, -1), np.array([17])):
        part = run(text, "reference", **{name: column[order] for name, column in values.items()})
        for name in ("x", "y", "h", "v", "a", "offset", "n_steps", "distance"):
            assert (getattr(part, name) == getattr(whole, name)[order]).all(), name


@given(st.floats(5.0, 9.0), st.floats(4.0, 10.0))
@settings(max_examples=10)
def test_motion_does_not_depend_on_where_north_is(speed, other):
    """The same crossroads seen from another leg: legs are alike, so distances must be."""
    gaps = []
    for first, second, third in ((3, 2, 4), (2, 1, 3), (1, 4, 2)):
        text = scenario(
            ("ego", "bv"),
            start("ego", lane(first, 1, 40), speed, lane(first, 1, 40), lane(third, -1, 90))
            + start("bv", lane(second, 1, 20), other, lane(second, 1, 20), lane(third, -1, 90)),
        )
        gaps.append(run(text).distance[0, 1])
    np.testing.assert_allclose(gaps[1], gaps[0], atol=1e-6)
    np.testing.assert_allclose(gaps[2], gaps[0], atol=1e-6)


def test_what_cannot_be_run_is_refused_by_name_and_line_all_at_once():
    text = scenario(
        ("ego", "bv"),
        SOUTHBOUND + WAITING,
        events(("one", "ego", lateral(-1, "sinusoidal rate 2", "ego"), after(1.0)))
        + events(("two", "ego", lateral(1, "linear time 2", "ego"), after(1.0))),
    )
    with pytest.raises(UnsupportedError) as error:
        simulator(text)
    assert len(error.value.problems) == 2
    assert "test.xosc, line " in error.value.problems[0]
    approve(error.value.problems[0], "LaneChangeAction")


def test_the_ego_needs_a_start():
    with refuses(InputError, "'ego'", "TeleportAction"):
        simulator(scenario(("ego", "bv"), SOUTHBOUND.replace('"ego"', '"bv"')))


def test_a_route_that_no_lane_leads_along_is_named():
    wrong = start("ego", lane(3, 1, 40.0), 9.0, lane(3, 1, 40.0), lane(4, 1, 50.0))
    with refuses(InputError, "ego"):
        run(scenario(("ego",), wrong), roads=crossroads(lanes_per_direction=2))


def test_kernels_without_the_compiler_give_the_same_numbers():
    """The same source, run by Python itself: parity of the compiled code, and plain divisions."""
    code = """
import json, sys; sys.path.insert(0, {folder!r})
import storyboards as s
ego = s.start("ego", s.lane(3, 1, 40), 9.0, s.lane(3, 1, 40), s.lane(4, -1, 90))
bv = s.start("bv", s.lane(2, 1, 20), 4.0, s.lane(2, 1, 20), s.lane(4, -1, 90))
for driver in ("route-follower", "reference"):
    r = s.run(s.scenario(("ego", "bv"), ego + bv), driver)
    print(json.dumps([int(r.n_steps[0]), r.x[0, 0, ::20].tolist(), r.v[0, 0, ::20].tolist()]))
""".format(folder=str(__file__).rpartition("/")[0])
    outputs = []
    for disabled in ("0", "1"):
        done = subprocess.run(
            [sys.executable, "-c", code],
            env=os.environ | {"NUMBA_DISABLE_JIT": disabled},
            capture_output=True, text=True, check=True, timeout=300,
        )  # fmt: skip
        outputs.append([json.loads(line) for line in done.stdout.splitlines()])
    for fast, plain in zip(*outputs, strict=True):
        assert fast[0] == plain[0]
        np.testing.assert_allclose(fast[1], plain[1], rtol=1e-12)
        np.testing.assert_allclose(fast[2], plain[2], rtol=1e-12)
