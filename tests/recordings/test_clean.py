"""Cleaning: each rule does what it says, says it, and leaves the rest alone."""

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import FileFormatError, InputError
from bridgegen.drivers.kinds import BICYCLE, CAR, MOTORCYCLE, PEDESTRIAN, TRUCK
from bridgegen.recordings.readers.clean import clean
from bridgegen.recordings.readers.quality import Rule
from bridgegen.recordings.readers.smoothing import suspects
from bridgegen.recordings.readers.table import Facts, build

STEP = 0.1


def traffic(*tracks, step=STEP, **about):
    """Return a recording of tracks ``{"time": …, "x": …, "y": …, …}``."""
    ids = np.repeat(np.arange(len(tracks)), [len(one["time"]) for one in tracks])
    names = {name for one in tracks for name in one}
    columns = {name: np.concatenate([np.asarray(one[name], float) for one in tracks])
               for name in names}  # fmt: skip
    about = {"kind": [CAR] * len(tracks), "length": [4.6] * len(tracks),
             "width": [1.9] * len(tracks)} | about  # fmt: skip
    facts = Facts(name="r", format="test", source="file", time_step=step, frame="")
    return build(facts, ids, columns, lambda i: f"file, line {i + 2}", **about)


def drive(n=50, v=20.0, a=0.0, y=0.0, x=0.0, step=STEP, start=0.0):
    t = step * np.arange(n)
    return {"time": start + t, "x": x + v * t + 0.5 * a * t * t, "y": np.full(n, y)}


def applied(cleaned):
    return {one.rule: (one.participants, one.count)
            for one in cleaned.quality.findings if one.count}  # fmt: skip


def test_what_is_complete_and_at_the_time_step_stays_to_the_bit():
    one = drive(a=-2.0)
    given = one | {"vx": 20.0 - 2.0 * one["time"], "vy": 0 * one["x"], "heading": 0 * one["x"],
                   "acceleration": np.full(50, -2.0)}  # fmt: skip
    found = clean(traffic(given), STEP)
    assert applied(found) == {}
    for name in ("x", "y", "vx", "acceleration"):
        assert (getattr(found.traffic, name) == given[name]).all()


@pytest.mark.parametrize("step", [0.02, 0.05, 0.1])
def test_missing_columns_come_from_positions_and_say_so(step):
    found = clean(traffic(drive(a=-2.0)), step)
    t = found.traffic.time
    assert found.traffic.x == pytest.approx(20.0 * t - t * t, abs=1e-9)
    assert found.traffic.vx == pytest.approx(20.0 - 2.0 * t, abs=1e-9)
    assert found.traffic.acceleration == pytest.approx(-2.0, abs=1e-9)
    assert (found.traffic.heading == 0.0).all()
    for rule in (Rule.VELOCITY, Rule.HEADING, Rule.ACCELERATION):
        assert applied(found)[rule] == (1, 50)


def test_all_participants_share_the_instants():
    found = clean(traffic(drive(), drive(start=0.033)), 0.05).traffic
    steps = found.time / 0.05
    assert steps == pytest.approx(np.rint(steps), abs=1e-9)
    assert found.x[found.participant == 1][0] == pytest.approx(20.0 * (0.05 - 0.033), abs=1e-6)


def test_a_rotated_recording_gives_rotated_results():
    rng = np.random.default_rng(1)
    t = STEP * np.arange(80)
    x, y = 15.0 * t + rng.normal(0, 0.1, 80), 2.0 * np.sin(t) + rng.normal(0, 0.1, 80)
    c, s = np.cos(0.7), np.sin(0.7)
    plain = clean(traffic({"time": t, "x": x, "y": y})).traffic
    turned = clean(traffic({"time": t, "x": c * x - s * y, "y": s * x + c * y})).traffic
    assert turned.x == pytest.approx(c * plain.x - s * plain.y, abs=1e-9)
    assert turned.speed == pytest.approx(plain.speed, abs=1e-9)
    assert turned.acceleration == pytest.approx(plain.acceleration, abs=1e-7)
    assert turned.heading == pytest.approx(plain.heading + 0.7, abs=1e-9)


def test_noise_is_smoothed_and_clean_braking_is_not_bent():
    rng = np.random.default_rng(2)
    t = STEP * np.arange(200)
    x = np.where(t < 10, 20 * t, 20 * t - 1.5 * (t - 10) ** 2)
    x = np.where(t > 16, 20 * 16 - 1.5 * 36 + 2 * (t - 16), x)
    noisy = {"time": t, "x": x + rng.normal(0, 0.2, 200), "y": rng.normal(0, 0.2, 200)}
    found = clean(traffic(noisy), STEP)
    assert applied(found)[Rule.SMOOTHED] == (1, 200)
    middle = slice(20, 90)
    raw = np.gradient(noisy["x"], t)[middle]
    assert np.std(found.traffic.vx[middle] - 20) < 0.5 * np.std(raw - 20)
    assert np.abs(found.traffic.x - x)[middle].max() < 0.4
    still = clean(traffic({"time": t, "x": x, "y": 0 * t}), STEP)
    assert Rule.SMOOTHED not in applied(still)
    assert (still.traffic.x == x).all()


def test_a_short_gap_is_bridged_and_a_long_one_cuts():
    one = {name: np.delete(values, [20, 21]) for name, values in drive(a=1.0).items()}
    found = clean(traffic(one), STEP)
    assert applied(found)[Rule.GAP_BRIDGED] == (1, 1)
    assert found.traffic.names == ("0",)
    t = found.traffic.time
    assert found.traffic.x == pytest.approx(20.0 * t + 0.5 * t * t, abs=0.02)
    one = {name: np.delete(values, range(20, 30)) for name, values in drive().items()}
    found = clean(traffic(one), STEP)
    assert applied(found)[Rule.GAP_CUT] == (1, 1)
    assert found.traffic.names == ("0", "0#2")
    assert found.kinds.tolist() == [CAR]
    (finding,) = [each for each in found.quality.findings if each.rule is Rule.GAP_CUT]
    assert finding.examples == ["0 at 1.9 s, 1.1 s long"]


def test_a_jump_cuts_and_its_two_parts_keep_what_was_recorded():
    one = drive()
    one["y"][30:] += 30.0
    found = clean(traffic(one, drive(y=90.0)), STEP)
    assert applied(found)[Rule.JUMP] == (1, 1)
    assert found.traffic.names == ("0", "0#2", "1")
    assert set(found.traffic.y[found.traffic.participant < 2]) == {0.0, 30.0}


def test_only_tracks_that_may_jump_are_searched_for_jumps():
    jumps = drive(y=40.0)
    jumps["x"][30:] += 30.0
    two = {name: values[:2] for name, values in drive(y=800.0).items()}
    found = traffic(drive(), drive(y=90.0, v=-20.0), two, two, jumps, drive(y=500.0))
    assert suspects(found.time, found.x, found.y, found.first).tolist() == [4]


def test_swapped_ids_are_told_from_jumps():
    a, b = drive(y=0.0), drive(y=3.5)
    a["y"][25:], b["y"][25:] = 3.5, 0.0
    found = clean(traffic(a, b), STEP)
    assert applied(found)[Rule.SWAP] == (2, 2)
    assert Rule.JUMP not in applied(found)
    assert found.quality[Rule.SWAP].examples[0] == "0 at 2.5 s, with 1"


def test_one_state_off_the_path_is_removed():
    one = drive()
    one["x"][17] += 8.0
    found = clean(traffic(one), STEP)
    assert applied(found)[Rule.OUTLIER] == (1, 1)
    assert found.traffic.names == ("0",)
    assert found.traffic.x == pytest.approx(20.0 * found.traffic.time, abs=1e-6)


def test_full_braking_is_no_jump():
    t = 0.2 * np.arange(40)
    v = np.maximum(30.0 - 10.0 * np.maximum(t - 3.0, 0.0), 0.0)
    x = np.concatenate([[0.0], np.cumsum(0.1 * (v[1:] + v[:-1]))])
    found = clean(traffic({"time": t, "x": x, "y": 0 * t}, step=0.2), 0.1)
    assert not {Rule.JUMP, Rule.OUTLIER} & set(applied(found))


def test_pieces_of_one_state_are_dropped_and_counted():
    single = {name: values[:1] for name, values in drive().items()}
    found = clean(traffic(drive(), single), STEP)
    assert applied(found)[Rule.SHORT] == (1, 1)
    assert found.traffic.names == ("0",)
    with pytest.raises(FileFormatError, match="two states"):
        clean(traffic(single), STEP)


@pytest.mark.parametrize(
    ("size", "v", "kind"),
    [((0.5, 0.6), 1.4, PEDESTRIAN), ((1.8, 0.6), 5.0, BICYCLE), ((2.2, 0.8), 20.0, MOTORCYCLE),
     ((4.6, 1.9), 20.0, CAR), ((12.0, 2.5), 20.0, TRUCK)],
)  # fmt: skip
def test_an_unknown_kind_is_told_by_box_and_speed(size, v, kind):
    found = clean(traffic(drive(v=v), kind=[-1], length=[size[0]], width=[size[1]]), STEP)
    assert found.traffic.kind.tolist() == [kind]
    assert applied(found)[Rule.KIND] == (1, 1)


def test_a_missing_box_is_that_of_the_kind():
    found = clean(traffic(drive(), kind=[TRUCK], length=[np.nan], width=[0.0]), STEP)
    assert (found.traffic.length[0], found.traffic.width[0]) == (10.0, 2.5)
    assert applied(found)[Rule.BOX] == (1, 1)


def test_what_stands_keeps_its_heading():
    t = STEP * np.arange(60)
    y = np.where(t < 3, -5.0 * t, -15.0)
    found = clean(traffic({"time": t, "x": 0 * t, "y": y}), STEP).traffic
    assert found.heading == pytest.approx(np.full(60, -np.pi / 2))
    stands = clean(traffic({"time": t, "x": 0 * t, "y": 0 * t}), STEP)
    assert applied(stands)[Rule.NO_HEADING] == (1, 60)


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda one: one | {"vx": np.full(50, 72.0), "vy": np.zeros(50)}, "km/h"),
        (lambda one: one | {"vx": np.full(50, 20.0 * 0.3048), "vy": np.zeros(50)}, "feet"),
        (lambda one: one | {"x": 100.0 * one["x"]}, "line 3"),
        (lambda one: one | {"x": np.r_[one["x"][:49], 4e6]}, "line 51"),
    ],
)
def test_wrong_units_and_mixed_frames_are_refused_with_the_row(change, says):
    with refuses(FileFormatError, says):
        clean(traffic(change(drive())))


def test_lengths_in_feet_are_refused():
    with refuses(FileFormatError):
        clean(traffic(drive(), length=[15.1]))


@pytest.mark.parametrize("step", [0.0, -1.0, float("nan"), 5.0])
def test_a_time_step_out_of_range_is_refused(step):
    with pytest.raises(InputError, match="time_step"):
        clean(traffic(drive()), step)


def test_a_recording_does_not_depend_on_what_else_is_recorded():
    rng = np.random.default_rng(3)
    one = drive()
    one["x"] = one["x"] + rng.normal(0, 0.1, 50)
    alone = clean(traffic(one)).traffic
    beside = clean(traffic(drive(y=50.0), one, drive(y=90.0))).traffic
    assert (beside.x[beside.participant == 1] == alone.x).all()


def test_velocities_that_are_not_those_of_the_positions_are_taken_from_them():
    """A recording whose speeds lag 0.5 s behind where it is; rounding to 1 cm is no such thing."""
    one = drive(n=80, v=20.0, a=-2.0)
    late = one | {"vx": 20.0 - 2.0 * (one["time"] - 0.5), "vy": np.zeros(80),
                  "heading": np.zeros(80)}  # fmt: skip
    found = clean(traffic(late), 0.05)
    assert applied(found)[Rule.MISFIT] == (1, 80)
    after = found.traffic
    driven = np.diff(after.x) / 0.05
    assert driven == pytest.approx(0.5 * (after.vx[1:] + after.vx[:-1]), abs=1e-3)
    assert after.vx == pytest.approx(20.0 - 2.0 * after.time, abs=1e-3)
    rounded = drive(n=200, v=20.0, step=0.04)
    rounded |= {"x": np.round(rounded["x"], 2), "vx": np.full(200, 20.0), "vy": np.zeros(200),
                "heading": np.zeros(200), "acceleration": np.zeros(200)}  # fmt: skip
    assert applied(clean(traffic(rounded, step=0.04), 0.04)) == {}


def test_few_states_with_other_velocities_have_those_of_their_positions():
    few = drive(n=5, v=10.0) | {"vx": np.full(5, 12.0), "vy": np.zeros(5)}
    found = clean(traffic(few, drive() | {"vx": np.full(50, 20.0), "vy": np.zeros(50)}), 0.1)
    assert found.traffic.vx[:5] == pytest.approx(10.0)
    assert applied(found)[Rule.MISFIT] == (1, 5)


def test_headings_are_smoothed_with_their_positions():
    """A heading that jumps takes the rear axle along; it turns over half a second instead."""
    one = drive(n=60, v=5.0)
    heading = np.where(one["time"] < 3.0, 0.0, 0.3)
    noisy = one | {"heading": heading, "vx": np.full(60, 5.6), "vy": np.zeros(60)}
    found = clean(traffic(noisy), 0.05).traffic
    assert np.abs(np.diff(found.heading)).max() < 0.05


def noisy(factor, noise=0.2):
    """Slow traffic of which many stand, with noise in its positions and speeds off by a factor."""
    rng, tracks = np.random.default_rng(1), []
    for v in (0.0, 0.0, 0.0, 2.0, 4.0):
        one = drive(n=200, v=v)
        one |= {"vx": np.full(200, factor * v), "vy": np.zeros(200)}
        tracks.append(one | {name: one[name] + rng.normal(0.0, noise, 200) for name in "xy"})
    return traffic(*tracks)


def test_noise_of_slow_traffic_is_no_wrong_unit():
    clean(noisy(1.0), STEP)


def test_a_wrong_unit_is_told_among_noise():
    with refuses(FileFormatError):
        clean(noisy(3.6), STEP)


def test_between_the_states_of_a_smoothed_track_velocities_are_those_of_its_path():
    rng, one = np.random.default_rng(2), drive(n=120, v=12.0)
    one["x"] = one["x"] + 6.0 * np.sin(one["time"]) + rng.normal(0.0, 0.05, 120)
    fine = clean(traffic(one), 0.01).traffic
    middle = (fine.x[2:] - fine.x[:-2]) / 0.02
    assert fine.vx[1:-1] == pytest.approx(middle, abs=5e-3)
