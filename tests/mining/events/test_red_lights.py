"""Red-light violations with quantities worked out by hand, and laws that hold for all of them."""

import numpy as np
import pytest
from tests.mining.events.planted import found, line, rows_of, turning

from bridgegen.drivers.kinds import BICYCLE
from bridgegen.recordings.events.event import NOT_WHOLE
from bridgegen.recordings.events.of_scenarios import encounters_of
from bridgegen.recordings.events.red_light import RIGHT_ON_RED
from bridgegen.recordings.readers.table import RecordedLight
from bridgegen.scenario.language.reader import load

KIND = "red-light-violation"
FRONT = 2.25  # m, half a length
EAST = [[0.0, 0.0], [1.0, 0.0]]
SOUTH_TO_NORTH = line(0.0, -60.0, 0.5 * np.pi, 6.0)


def turns_red(at, path=EAST):
    return ((0.0, "green"), (at - 3.0, "yellow"), (at, "red")), path


def drives_over(speed=10.0, after=8.0):
    """Its front is over the stop line at x = 0 after so long."""
    return line(-speed * after - FRONT, 0.0, 0.0, speed)


def test_a_red_light_is_run():
    """It drives 10 m/s, and is over the line at 8 s; the light has been red since 6.5 s."""
    _, by_kind = found([drives_over()], lights=[turns_red(6.5)])
    runs = by_kind[KIND]
    assert (runs.ego.tolist(), len(runs.others)) == ([0], 0)
    assert (runs.begin[0], runs.end[0]) == pytest.approx((2.0, 8.0), abs=0.01)
    wanted = {
        "ego_speed": 10.0, "ego_distance": 60.0, "line_speed": 10.0, "least_speed": 10.0,
        "red_time": 1.5, "red_seen": 1.0, "red_speed": 10.0, "red_distance": 15.0, "turn": 0.0,
    }  # fmt: skip
    for name, value in wanted.items():
        assert runs.quantities[name][0] == pytest.approx(value, abs=0.05), name


@pytest.mark.parametrize(("red_for", "count"), [(-1.0, 0), (0.25, 0), (0.35, 1), (5.0, 1)])
def test_the_light_has_been_red_for_some_time(red_for, count):
    assert len(found([drives_over()], lights=[turns_red(8.0 - red_for)])[1][KIND]) == count


@pytest.mark.parametrize("state", ["green", "yellow", "unknown", "flashing red", "off"])
def test_no_other_state_counts(state):
    assert len(found([drives_over()], lights=[(((0.0, state),), EAST)])[1][KIND]) == 0


def test_a_light_that_is_red_from_the_beginning():
    _, by_kind = found([drives_over()], lights=[(((0.0, "red"),), EAST)])
    quantities = by_kind[KIND].quantities
    assert quantities["red_seen"].tolist() == [0.0]
    assert quantities["red_time"] == pytest.approx([8.0], abs=0.01)
    assert np.isnan(quantities["red_distance"]).all()


def test_who_crosses_or_drives_beside_the_lane_does_not_pass_its_line():
    beside = line(-82.0, 2.0, 0.0, 10.0)
    against = line(82.0, 0.0, np.pi, 10.0)
    askew = line(-41.0, -71.0, np.radians(60.0), 10.0)
    for other in (SOUTH_TO_NORTH, beside, against, askew):
        assert len(found([other], lights=[turns_red(2.0)])[1][KIND]) == 0


def lanes_of_one_line():
    """From one line a lane leads straight on at green, another one to the left at red."""
    h = np.linspace(0.0, 0.5 * np.pi, 40)
    left = np.column_stack([14.0 * np.sin(h), 14.0 * (1.0 - np.cos(h))])
    return [(((0.0, "green"),), [[0.0, 0.0], [30.0, 0.0]]), (((0.0, "red"),), left)]


def test_of_several_lights_that_of_the_lane_that_is_taken_counts():
    assert len(found([drives_over()], lights=lanes_of_one_line())[1][KIND]) == 0
    assert len(found([drives_over()], lights=lanes_of_one_line()[1:])[1][KIND]) == 0
    turns = turning(-82.0, 0.0, 0.0, 10.0, 82.0, 14.0, 1.0)
    runs = found([turns], lights=lanes_of_one_line())[1][KIND]
    assert len(runs) == 1
    assert runs.quantities["turn"] == pytest.approx([90.0], abs=3.0)


def turns_right(halts):
    """It comes at 6 m/s, perhaps halts for 2 s before the line, and turns right."""
    t, x, y = turning(-24.0, 0.0, 0.0, 6.0, 26.0, 8.0, -1.0)
    if not halts:
        return t, x, y
    time = np.where(t < 3.5, t, np.maximum(3.5, t - 2.0))
    return t, np.interp(time, t, x), np.interp(time, t, y)


@pytest.mark.parametrize("halts", [False, True])
def test_a_right_turn_after_a_stop_is_no_violation(halts):
    runs = found([turns_right(halts)], lights=[turns_red(0.5)])[1][KIND]
    assert len(runs) == (0 if halts else 1)
    assert runs.refused == ({RIGHT_ON_RED: 1} if halts else {})


def test_what_is_cut_off_is_counted():
    """Of one 0.8 s are recorded before the line, of the other 8 m beyond."""
    late = line(-82.25, 0.0, 0.0, 10.0, begin=7.2)
    t, x, y = drives_over()
    short = t[t < 8.8], x[t < 8.8], y[t < 8.8]
    for one in (late, short):
        runs = found([one], lights=[turns_red(2.0)])[1][KIND]
        assert (len(runs), runs.refused) == (0, {NOT_WHOLE: 1})


def test_bicycles_and_lights_without_a_stop_line_are_not_looked_at():
    assert len(found([drives_over()], [BICYCLE], [turns_red(2.0)])[1][KIND]) == 0
    assert len(found([drives_over()], lights=[turns_red(2.0, np.zeros((0, 2)))])[1][KIND]) == 0


def crossing_traffic():
    """The ego drives north, the other runs a red light 15 m before it crosses."""
    return [line(0.0, -75.0, 0.5 * np.pi, 10.0), line(-60.0, 0.0, 0.0, 10.0)]


def test_a_crossing_says_who_ran_a_red_light():
    red = [turns_red(1.0, [[-15.0, 0.0], [-14.0, 0.0]])]
    crossing = found(crossing_traffic(), lights=red)[1]["crossing"]
    assert crossing.quantities["other_ran_red"].tolist() == [1.0, 0.0]
    assert crossing.quantities["ego_ran_red"].tolist() == [0.0, 1.0]
    far = [turns_red(1.0, [[-40.0, 0.0], [-39.0, 0.0]])]
    assert found(crossing_traffic(), lights=far)[1]["crossing"].quantities["other_ran_red"][0] == 1
    beyond = [turns_red(1.0, [[15.0, 0.0], [16.0, 0.0]])]
    unlit = found(crossing_traffic(), lights=beyond)[1]["crossing"]
    assert unlit.quantities["other_ran_red"].tolist() == [0.0, 0.0]
    none = found(crossing_traffic())[1]["crossing"]
    assert np.isnan(none.quantities["other_ran_red"]).all()


@pytest.mark.parametrize("moved", [
    {"turn": 0.7}, {"turn": -2.5}, {"shift": (3.0e5, -5.0e6)}, {"later": 3600.0},
])  # fmt: skip
def test_place_direction_and_time_change_nothing(moved):
    tracks = [drives_over(), SOUTH_TO_NORTH]
    lights = [turns_red(6.5), turns_red(4.0, [[0.0, -8.0], [0.0, 8.0]])]
    here = rows_of(found(tracks, lights=lights)[1], [KIND])
    there = rows_of(found(tracks, lights=lights, **moved)[1], [KIND])
    assert [row[1] for row in here] == [[0], [1]]
    for one, other in zip(here, there, strict=True):
        assert one[:2] == other[:2]
        assert other[3] == pytest.approx(one[3], rel=1e-3, abs=1e-2, nan_ok=True)
    back = rows_of(found(tracks[::-1], lights=lights[::-1])[1], [KIND], [1, 0])
    for one, other in zip(here, back, strict=True):
        assert other[3] == pytest.approx(one[3], nan_ok=True)


def test_since_when_a_light_is_red():
    light = RecordedLight(((0.0, "green"), (2.0, "red"), (5.0, "unknown"), (6.0, "red")))
    assert light.red_since(4.9) == 2.0
    assert light.red_since(7.0) == 6.0
    assert np.isnan([light.red_since(time) for time in (1.9, 5.5, -1.0)]).all()


def test_without_lights_there_is_no_rate_of_who_runs_them():
    dark, _ = found([drives_over()])
    lit, _ = found([drives_over()], lights=[turns_red(6.5)])
    for kind, needs in ((KIND, False), ("crossing", True)):
        assert encounters_of(0, [dark], kind, needs_lights=needs) is None
        met = encounters_of(1, [dark, lit], kind, needs_lights=needs)
        assert met.hours == lit.all_hours
    assert encounters_of(0, [dark], "crossing").hours == dark.all_hours
    specs = {name: load(name).recorded for name in ("red-light-runner", "crossroads-s1", "cut-in")}
    assert [one.needs_lights for one in specs.values()] == [True, False, False]
