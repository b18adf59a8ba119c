"""Recordings by others: the same metrics as of our own, or one clear error for each mistake."""

import csv
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import approve, refuses

from bridgegen.assess.conflict.recorded import measure_recording
from bridgegen.base.errors import BridgeGenError, FileFormatError, InputError, UnknownNameError
from bridgegen.cli import main
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.simulate import simulate_file
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.scenario.language.reader import load
from bridgegen.simulation import recording as module
from bridgegen.simulation.recording import boxes_of, read_recording
from bridgegen.simulation.trace import write_trace

LOG = Path(__file__).parent / "data" / "esmini_log.csv"
"""What esmini 3.6 wrote with --csv_logger, playing a recorded file of ours; some lines of it."""


@pytest.fixture(scope="module")
def xosc(tmp_path_factory):
    scenario = load("cut-in")
    pipeline = Pipeline(scenario, scenario.space())
    folder = tmp_path_factory.mktemp("scenario")
    return write_scenario(pipeline, pipeline.space.row({}), folder, "one")[2]


@pytest.fixture
def write(tmp_path):
    def to_file(text: str | bytes, name: str = "theirs.csv") -> Path:
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return to_file


def table(*lines: str, head: str = "time,entity,x,y,h,speed,length,width") -> str:
    return "\n".join([head, *lines]) + "\n"


TWO = table(
    "0.0,ego,0,0,0,10,4,2", "0.0,bv,20,0,0,5,4,2",
    "0.1,ego,1,0,0,10,4,2", "0.1,bv,20.5,0,0,5,4,2",
    "0.2,ego,2,0,0,9,4,2", "0.2,bv,21,0,0,5,4,2",
)  # fmt: skip


# The same figures.


def test_a_trace_of_ours_gives_the_metrics_of_the_simulation_to_the_last_bit(
    xosc, tmp_path, monkeypatch, capsys
):
    path = tmp_path / "t.csv"

    def run(*words):
        monkeypatch.setattr("sys.argv", ["bridgegen", *map(str, words)])
        with pytest.raises(SystemExit) as ended:
            main()
        assert ended.value.code == 0
        return capsys.readouterr().out

    for dt in (None, 0.03):
        step = () if dt is None else ("--dt", dt)
        simulated = json.loads(run("simulate", xosc, "--trace", path, "--json", *step))["metrics"]
        measured = json.loads(run("analyse", "recording", path, "--json"))
        path.unlink()
        assert measured["metrics"] == {name: simulated[name] for name in measured["metrics"]}
        assert set(simulated) - set(measured["metrics"]) <= {"r_red", "iou", "e_position", "map"}
        assert measured["notes"] == []
        assert measured["time_step"] == (dt or 0.05)


def test_the_log_of_esmini_is_read_to_its_last_digit():
    recording = read_recording(LOG)
    lines = [line.split(", ") for line in LOG.read_text("utf-8").splitlines()[7:]]
    rollout = recording.rollout
    assert rollout.names == ("ego", "bv")
    assert rollout.shape == (1, 2, len(lines))
    assert rollout.time_step == pytest.approx(0.05, abs=1e-6)
    # Its header says at which place each is; entity 2 comes 31 fields after entity 1.
    head = [one.strip() for one in LOG.read_text("utf-8").splitlines()[6].split(",")]
    for name, array in (
        ("World_Position_X [m]", rollout.x), ("World_Position_Y [m]", rollout.y),
        ("Current_Speed [m/s]", rollout.v),
    ):  # fmt: skip
        for e in (0, 1):
            told = [float(line[head.index(f"#{e + 1} {name}")]) for line in lines]
            np.testing.assert_array_equal(array[0, e], told)
    for e in (0, 1):
        told = [float(line[head.index(f"#{e + 1} World_Heading_Angle [rad]")]) for line in lines]
        np.testing.assert_allclose(np.cos(rollout.h[0, e]), np.cos(told), atol=1e-12)
        names = ("bb_length [m]", "bb_width [m]", "bb_x [m]")
        box = [float(lines[0][head.index(f"#{e + 1} {name}")]) for name in names]
        np.testing.assert_array_equal(rollout.box[e], box)


def test_the_log_of_esmini_is_measured():
    measured = measure_recording(LOG)
    assert measured.metrics["d_min"] == pytest.approx(float(measured.rollout.distance.min()))
    assert measured.notes == ("accelerations are taken from the speeds",)
    swapped = measure_recording(LOG, ego="bv")
    assert swapped.rollout.names == ("bv", "ego")
    assert swapped.metrics["d_min"] == pytest.approx(measured.metrics["d_min"])


def test_a_small_table_by_hand(write):
    measured = measure_recording(write(TWO))
    assert measured.rollout.names == ("ego", "bv")
    assert measured.metrics["d_min"] == pytest.approx(15.0)
    assert measured.metrics["v_d"] == 9.0
    assert measured.metrics["ttc"] == pytest.approx(15.5 / 5)
    np.testing.assert_allclose(measured.rollout.a[0, 0], [0.0, -10.0, -10.0])
    assert "l_offset" not in measured.metrics
    assert set(measured.notes) == {
        "without the column centre, positions are taken as the boxes' centres",
        "accelerations are taken from the speeds",
    }


def test_columns_lines_and_quotes_come_in_any_order(write):
    rows = list(csv.reader(TWO.splitlines()))
    order = [3, 1, 0, 7, 2, 4, 5, 6]
    mixed = [[row[i] for i in order] for row in rows]
    text = "\ufeff" + "\r\n".join(
        ",".join(f'"{one}"' for one in r) for r in [mixed[0], *mixed[:0:-1]]
    )
    one = measure_recording(write(TWO)).metrics
    other = measure_recording(write(text, "mixed.csv"), ego="ego").metrics
    assert other == one


def test_unused_columns_are_named(write):
    text = "\n".join(line + (",z" if i == 0 else ",1.5") for i, line in enumerate(TWO.splitlines()))
    approve(measure_recording(write(text)).notes, "columns")


def test_boxes_of_a_scenario_file(xosc, tmp_path, write):
    rollout = simulate_file(xosc).rollout
    write_trace(tmp_path / "t.csv", rollout)
    bare = "\n".join(
        ",".join(line.split(",")[:6]) for line in (tmp_path / "t.csv").read_text().splitlines()
    )
    path = write(bare)
    with refuses(FileFormatError, "--boxes"):
        measure_recording(path)
    measured = measure_recording(path, boxes=xosc)
    np.testing.assert_array_equal(measured.rollout.box, rollout.box)
    assert set(boxes_of(xosc)) == set(rollout.names)
    with refuses(FileFormatError, "stranger"):
        measure_recording(write(TWO.replace("bv", "stranger"), "other.csv"), boxes=xosc)


def test_headings_that_jump_by_a_turn_are_made_continuous(write):
    text = table("0,e,0,0,3.1,1,4,2", "1,e,0,0,-3.1,1,4,2", "2,e,0,0,-3.0,1,4,2")
    h = read_recording(write(text)).rollout.h[0, 0]
    assert (np.abs(np.diff(h)) < 0.3).all()


# Time.


def test_rounded_times_are_equal_steps(write):
    lines = [f"{k / 30:.6f},e,{k},0,0,30,4,2" for k in range(3000)]
    rollout = read_recording(write(table(*lines))).rollout
    assert rollout.time_step == pytest.approx(1 / 30, rel=1e-6)
    assert rollout.n_steps == [3000]


UNEQUAL = table(*(f"{t},e,{10 * t},0,0,10,4,2" for t in (0, 0.1, 0.15, 0.3, 0.4, 0.5)))


def test_unequal_steps_are_refused_or_resampled_aloud(write):
    path = write(UNEQUAL)
    with refuses(InputError, "0.05", "0.15 s"):
        read_recording(path)
    recording = read_recording(path, time_step=0.05)
    np.testing.assert_allclose(recording.rollout.x[0, 0], 0.5 * np.arange(11), atol=1e-12)
    approve(recording.notes, "0.05 s")
    for step in (0.0, 2.0, float("nan")):
        with pytest.raises(InputError, match="<= time_step <= 1"):
            read_recording(path, time_step=step)


def test_who_comes_later_and_goes_is_left_out_meanwhile(write):
    text = table(
        *(f"{0.1 * k:.1f},ego,{k},0,0,10,4,2" for k in range(6)),
        *(f"{0.1 * k:.1f},late,{30 - k},0,3.14159,10,4,2" for k in (2, 3)),
    )
    rollout = read_recording(write(text)).rollout
    assert rollout.present[0, 1].tolist() == [False, False, True, True, False, False]
    assert np.isinf(rollout.distance[0, 1, [0, 1, 4, 5]]).all()
    assert measure_recording(write(text)).metrics["d_min"] == pytest.approx(27 - 3 - 4)
    always = read_recording(write(TWO, "two.csv")).rollout
    assert always.present.size == 0
    resampled = read_recording(write(text), time_step=0.05).rollout
    assert resampled.present[0, 1].tolist() == [4 <= k <= 6 for k in range(11)]


def test_others_beyond_the_ego_s_time_are_named(write):
    text = TWO + "0.3,bv,21.5,0,0,5,4,2\n"
    approve(read_recording(write(text)).notes, "bv", "ego")


# Mistakes: each is one clear error with its line.


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1"),
        ("a;b\n1;2\n", "missing"),
        ("time,entity,x,y,speed\n", "missing: h"),
        (table(), "states"),
        (table(head="time,entity,x,y,h,speed,x"), "line 1"),
        (table("0,e,0,0,0,1,4"), "line 2"),
        (table("0,,0,0,0,1,4,2"), "entity"),
        (table("0,e,0,zero,0,1,4,2"), "zero"),
        (table("0,e,nan,0,0,1,4,2"), "nan"),
        (table("0,e,0,0,0,inf,4,2"), "inf"),
        (table("0,e,0,0,0,1_0,4,2"), "1_0"),
        (table("1e10,e,0,0,0,1,4,2"), "1e10"),
        (table("0,e,0,0,0,,4,2"), "speed"),
        (table("0,e,0,0,0,-1,4,2"), "line 2"),
        (table("0,e,0,0,0,1,0,2"), "line 2"),
        (table("0,e,0,0,0,1,4,2"), "e"),
        (table("0,e,0,0,0,1,4,2", "0,e,0,0,0,1,4,2"), "e"),
        (table("0,e,0,0,0,1,4,2", "1,e,0,0,0,1,5,2"), "line 3"),
        (
            table("0,e,0,0,0,1,4,2", "1,e,0,0,0,1,4,2", "0.5,b,0,0,0,1,4,2"),
            "b",
        ),
        ('time,entity,x,y,h,speed\n0,"e\n', "line 2"),
        (table("0,e,0,0,0,1,4,2", "9,e,0,0,0,1,4,2"), "0.0001"),
        ("esmini GIT REV: 1\n", "--csv_logger"),
        (b"time,entity\xff", "11"),
    ],
)  # fmt: skip
def test_a_mistake_is_named_with_its_line(write, text, message):
    with refuses(InputError, message):
        measure_recording(write(text))


def test_a_broken_log_of_esmini(write):
    lines = LOG.read_text("utf-8").splitlines(keepends=True)
    short = [*lines[:9], lines[9].replace(", ego,", ",", 1), *lines[10:12]]
    with refuses(FileFormatError, "line 10", "31"):
        read_recording(write("".join(short)))
    odd = [*lines[:9], lines[9].replace("7.969166", "nan", 1), *lines[10:12]]
    with refuses(FileFormatError, "nan", "speed"):
        read_recording(write("".join(odd)))


def test_many_mistakes_end_the_reading(write):
    with pytest.raises(FileFormatError) as caught:
        read_recording(write(table(*["0,e,x,0,0,1,4,2"] * 1000)))
    assert len(caught.value.problems) == 21


def test_what_is_too_large_is_refused(write, monkeypatch):
    with refuses(UnknownNameError, "ego2"):
        measure_recording(write(TWO), ego="ego2")
    with refuses(InputError, "map"):
        measure_recording(write(TWO), metrics=["map"])
    with refuses(FileFormatError):
        measure_recording(Path("nowhere.csv"))
    with monkeypatch.context() as patch:
        patch.setattr(module, "MAX_STATES", 5)
        with refuses(FileFormatError):
            measure_recording(write(TWO))
    with monkeypatch.context() as patch:
        patch.setattr(module, "MAX_INSTANTS", 2)
        with refuses(InputError):
            measure_recording(write(TWO))


@given(st.lists(st.tuples(st.integers(0, 10**6), st.binary(max_size=6)), max_size=6), st.booleans())
def test_whatever_is_in_the_file_it_is_read_or_refused(tmp_path_factory, changes, log):
    data = bytearray(LOG.read_bytes() if log else TWO.encode())
    for at, text in changes:
        at %= len(data)
        data[at : at + len(text)] = text
    path = tmp_path_factory.mktemp("mutated") / "m.csv"
    path.write_bytes(data)
    try:
        found = measure_recording(path).metrics
    except BridgeGenError as error:
        found = {str(path): 0.0} if str(path) in str(error) else {}
    assert found
    assert not any(np.isnan(value) for value in found.values())


def test_a_trace_leaves_out_who_is_not_there(xosc, tmp_path):
    rollout = simulate_file(xosc).rollout
    present = np.ones(rollout.shape, dtype=bool)
    present[0, 1, :20] = False
    partly = replace(rollout, present=present)
    write_trace(tmp_path / "t.csv", partly)
    back = read_recording(tmp_path / "t.csv").rollout
    n = int(rollout.n_steps[0])
    np.testing.assert_array_equal(back.present, present[:, :, :n])
    np.testing.assert_array_equal(back.distance, partly.distance[:, :, :n])
