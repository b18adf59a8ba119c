"""Traces of ASAM OSI: what other readers of MCAP and Protocol Buffers find in them."""

import struct
import zlib
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.approval import approve, refuses

from bridgegen.base.errors import InputError
from bridgegen.base.protobuf import flat, rows
from bridgegen.cli import main
from bridgegen.drivers import kinds
from bridgegen.drivers.osi import OSI, message
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.simulate import simulate_file
from bridgegen.jobs.search.export import export_traces
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.recordings.readers.formats import read
from bridgegen.recordings.readers.mcap import read_messages
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.osi.trace import Surroundings, ground_truths
from bridgegen.simulation.rollout import Rollout
from bridgegen.simulation.trace import write_trace


@pytest.fixture(scope="module")
def xosc(tmp_path_factory):
    scenario = load("crosses-on-red")
    pipeline = Pipeline(scenario, scenario.space())
    folder = tmp_path_factory.mktemp("scenario")
    return write_scenario(pipeline, pipeline.space.row({}), folder, "one")[2]


@pytest.fixture(scope="module")
def traces(xosc, tmp_path_factory):
    return export_traces(xosc, out=tmp_path_factory.mktemp("osi"))


@pytest.fixture(scope="module")
def result(xosc):
    return simulate_file(xosc)


def test_a_reader_finds_the_motion_to_the_last_bit(result, traces):
    assert [path.name for path in traces] == ["one_gt.mcap", "one_sv.mcap"]
    rollout, n = result.rollout, int(result.rollout.n_steps[0])
    for path in traces:
        (found,) = read(path)
        assert found.names == ("1", "2")
        for e in range(2):
            own = slice(found.first[e], found.first[e + 1])
            x, y, h, a = (getattr(rollout, name)[0, e, :n] for name in "xyha")
            ahead = rollout.box[e, 2]
            assert found.time[own].tolist() == [round(k * 5e7) * 1e-9 for k in range(n)]
            np.testing.assert_allclose(found.x[own], x + ahead * np.cos(h), rtol=0, atol=1e-12)
            np.testing.assert_allclose(found.y[own], y + ahead * np.sin(h), rtol=0, atol=1e-12)
            turned = (found.heading[own] - h + np.pi) % (2 * np.pi) - np.pi
            np.testing.assert_allclose(turned, 0.0, atol=1e-12)
            np.testing.assert_allclose(found.acceleration[own], a, atol=1e-12)
            # The velocity is that of the place that is stated.
            np.testing.assert_allclose(
                np.gradient(found.x[own], 0.05), found.vx[own], rtol=0, atol=0.5
            )
        assert (found.length.tolist(), found.kind.tolist()) == (
            rollout.box[:, 0].tolist(),
            rollout.kinds.tolist(),
        )


def test_lanes_and_lamps_are_those_of_the_map(result, traces):
    (found,) = read(traces[0])
    around = result.around()
    driven = [lane for road in around.roads.roads for s in road.sections for lane in s.lanes]
    assert len(found.facts.lanelets) == sum(lane.drivable for lane in driven)
    assert any("100% as named" in note for note in found.facts.notes)
    x, y = found.x[0], found.y[0]
    assert min(np.hypot(*(lane.left - (x, y)).T).min() for lane in found.facts.lanelets) < 60.0
    # Three lamps a signal, of which as many are lit as its state says.
    rollout, n = result.rollout, int(result.rollout.n_steps[0])
    states = rollout.lights[0, :, :n]
    lit = np.array([0, 1, 2, 1, 1])[states].sum(0)
    time = np.arange(n) * 0.05
    seen = np.zeros(n, int)
    for light in found.facts.lights.values():
        begins, words = zip(*light.changes, strict=True)
        now = np.searchsorted(begins, time + 1e-6, side="right") - 1
        seen += np.array([word != "off" for word in words])[now]
    assert len(found.facts.lights) == 3 * len(states)
    assert seen.tolist() == lit.tolist()


def test_the_index_of_the_file_leads_to_each_message(traces):
    data = traces[1].read_bytes()
    stored = [one.data for one in read_messages(traces[1])]
    start, _, crc = struct.unpack("<QQI", data[-28:-8])
    assert zlib.crc32(data[start:-12]) == crc
    at, found = start, []
    while at < len(data) - 8:
        code, size = struct.unpack_from("<BQ", data, at)
        if code == 8:
            chunk, _, _, _, index = struct.unpack_from("<QQIHQ", data, at + 9 + 16)
            code, size_of_chunk, first, last, _, _ = struct.unpack_from("<BQQQQI", data, chunk)
            records = data[chunk + 9 + 40 : chunk + 9 + size_of_chunk]
            (length,) = struct.unpack_from("<I", data, index + 11)
            for time, offset in struct.iter_unpack("<QQ", data[index + 15 : index + 15 + length]):
                _, size_of_one, _, _, logged, _ = struct.unpack_from("<BQHIQQ", records, offset)
                assert first <= time == logged <= last
                found.append(records[offset + 31 : offset + 9 + size_of_one])
        at += 9 + size
    assert found == stored


def test_googles_library_reads_all_by_the_schema_in_the_file():
    pb2 = pytest.importorskip("google.protobuf.descriptor_pb2")
    from google.protobuf import descriptor_pool, message_factory

    pool = descriptor_pool.DescriptorPool()
    for file in pb2.FileDescriptorSet.FromString(OSI.descriptors()).file:
        pool.Add(file)
    kind = message_factory.GetMessageClass(pool.FindMessageTypeByName("osi3.GroundTruth"))
    (_, first), (_, second) = ground_truths(_two(), Surroundings())
    truth = kind.FromString(first)
    assert truth.SerializeToString(deterministic=True) == first
    (only,) = truth.moving_object  # the other one is not there yet
    lights = only.vehicle_classification.light_state
    assert (only.base.position.x, only.source_reference[0].identifier[1]) == (11.5, "ego")
    assert (lights.indicator_state, lights.brake_light_state) == (5, 3)  # warning, normal
    assert [each.type for each in kind.FromString(second).moving_object] == [2, 3]


def _two():
    """A car that signals, and a pedestrian who comes later."""
    zeros = np.zeros((1, 2, 2))
    return Rollout(
        time_step=0.1,
        names=("ego", "walker"),
        box=np.array([[4.6, 1.9, 1.5], [0.5, 0.6, 0.0]]),
        x=zeros + 10.0,
        y=zeros,
        h=zeros,
        v=zeros,
        a=zeros,
        offset=zeros,
        n_steps=np.array([2]),
        status=np.zeros(1, np.int8),
        kinds=np.array([kinds.CAR, kinds.PEDESTRIAN]),
        present=np.array([[[True, True], [False, True]]]),
        lamps=np.full((1, 2, 2), kinds.HAZARD | kinds.BRAKE, np.int8),
    )


def test_left_hand_traffic_is_not_mirrored():
    left = replace(_two(), y=np.ones((1, 2, 2)), left_hand=True)
    (_, mirrored), _ = ground_truths(left, Surroundings())
    (_, plain), _ = ground_truths(replace(left, left_hand=False), Surroundings())
    assert struct.pack("<d", -1.0) in mirrored
    assert struct.pack("<d", -1.0) not in plain


@settings(max_examples=30)
@given(st.lists(st.floats(allow_nan=False), min_size=1, max_size=4), st.integers(0, 2**63))
def test_all_instants_at_once_are_each_alone(values, number):
    def lamp(x, mode):
        base = message("BaseStationary", position=message("Vector3d", x=x, y=1.0))
        about = message("TrafficLight.Classification", mode=mode, color="RED")
        value = message("Identifier", value=number)
        return message("TrafficLight", id=value, base=base, classification=about)

    modes = np.arange(len(values), dtype=np.uint8)
    each = [flat(lamp(x, mode)) for x, mode in zip(values, modes.tolist(), strict=True)]
    assert rows(lamp(np.array(values), modes), len(values)) == each


def test_every_way_to_a_trace_gives_the_same_bytes(xosc, result, traces, tmp_path, monkeypatch):
    write_trace(tmp_path / "own.mcap", result.rollout, around=result.around)
    command = ["bridgegen", "export", str(xosc), "--flavour", "osi", "--out", str(tmp_path)]
    monkeypatch.setattr("sys.argv", command)
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 0
    for path in (tmp_path / "own.mcap", tmp_path / traces[0].name):
        assert path.read_bytes() == traces[0].read_bytes()
    assert (tmp_path / traces[1].name).read_bytes() == traces[1].read_bytes()


def test_a_recording_becomes_a_trace(result, tmp_path):
    write_trace(tmp_path / "states.csv", result.rollout)
    notes = []
    paths = export_traces(tmp_path / "states.csv", out=tmp_path, notes=notes)
    approve(note.replace(str(tmp_path), "FOLDER") for note in notes)
    (before,), (after,) = read(tmp_path / "states.csv"), read(paths[0])
    assert np.abs(before.x - after.x).max() < 0.05
    with refuses(InputError, "states.csv"):
        export_traces(tmp_path / "states.csv", ego="reference")
