"""All readers make the same table of the same traffic."""

import pickle
import re
from typing import NamedTuple

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import FileFormatError
from bridgegen.drivers.kinds import CAR, TRUCK
from bridgegen.recordings.readers.format import read_head
from bridgegen.recordings.readers.formats import FORMATS, files_of, read, recognise

from . import binary_writers as b
from . import writers as w


class Case(NamedTuple):
    """A writer, and what its format cannot say."""

    write: object
    format: str
    place: float = 1e-6  # m
    heading: float = 1e-6  # rad
    speed: float = 1e-6  # m/s; where there is one number, it says nothing of sliding or swinging
    accelerates: bool = True
    boxes: bool = True
    kinds: bool = True
    lanes: bool = False


SWINGS = 0.3
"""Of the truck's centre about its rear axle, and of its front [m/s]."""
parquet = pytest.mark.parquet
CASES = [
    pytest.param(Case(w.write_states, "states", speed=SWINGS, kinds=False), id="states"),
    # no headings: those with which the rear axle follows the centre, or the front
    pytest.param(Case(w.write_highd, "levelX", heading=2e-3, lanes=True), id="highD"),
    pytest.param(Case(w.write_ind, "levelX"), id="inD"),
    pytest.param(Case(w.write_ngsim, "NGSIM", 0.03, 0.01, SWINGS, lanes=True), id="NGSIM"),
    pytest.param(Case(w.write_ngsim_text, "NGSIM", 0.03, 0.01, SWINGS, lanes=True),
                 id="NGSIM text"),
    pytest.param(Case(w.write_smarts, "SMARTS", speed=SWINGS, accelerates=False, lanes=True),
                 id="SMARTS"),
    pytest.param(Case(w.write_commonroad, "CommonRoad", speed=SWINGS), id="CommonRoad"),
    pytest.param(Case(w.write_interaction, "INTERACTION", accelerates=False), id="INTERACTION"),
    pytest.param(Case(w.write_sumo, "SUMO FCD", speed=SWINGS, boxes=False), id="SUMO"),
    pytest.param(Case(w.write_womd, "WOMD JSON", accelerates=False, kinds=False), id="WOMD"),
    pytest.param(
        Case(w.write_argoverse, "Argoverse 2", accelerates=False, boxes=False, kinds=False),
        id="AV2", marks=parquet,
    ),
    pytest.param(Case(w.write_scenarionet, "ScenarioNet", accelerates=False, kinds=False),
                 id="ScenarioNet"),
    pytest.param(Case(b.write_osi, "OSI", lanes=True), id="OSI"),
    pytest.param(Case(b.write_osi_view, "OSI", lanes=True), id="OSI SensorView"),
    pytest.param(Case(b.write_mcap, "OSI", lanes=True), id="OSI MCAP"),
    pytest.param(Case(b.write_dat, "esmini", speed=SWINGS, accelerates=False), id="esmini"),
]  # fmt: skip


@pytest.mark.parametrize("case", CASES)
def test_a_reader_returns_what_was_written(case, tmp_path):
    if case.format == "Argoverse 2":
        pytest.importorskip("pyarrow")
    (found,) = read(case.write(tmp_path))
    assert found.facts.format == case.format
    assert found.facts.time_step == pytest.approx(w.STEP)
    assert found.names == w.NAMES
    if case.kinds:
        assert found.kind.tolist() == [CAR, CAR, TRUCK]
    if case.boxes:
        assert np.column_stack([found.length, found.width]) == pytest.approx(np.array(w.SIZES))
    truth = [w.states(p) for p in range(3)]
    assert found.first.tolist() == [0, w.N, 2 * w.N, 3 * w.N]
    start = found.time[0]  # a format's clock may begin anywhere
    for p, states in enumerate(found.states()):
        t, x, y, h, vx, vy, a = truth[p]
        assert found.time[states] - start == pytest.approx(t, abs=1e-6)
        assert found.x[states] == pytest.approx(x, abs=case.place)
        assert found.y[states] == pytest.approx(y, abs=case.place)
        assert found.heading[states] == pytest.approx(h, abs=case.heading)
        assert found.vx[states] == pytest.approx(vx, abs=case.speed)
        assert found.vy[states] == pytest.approx(vy, abs=case.speed)
        if case.accelerates:
            assert found.acceleration[states] == pytest.approx(a, abs=max(1e-6, case.heading))
        else:
            assert np.isnan(found.acceleration[states]).all()
        assert (found.lane[states] == (p + 2 if case.lanes else found.lane[states][0])).all()


@pytest.mark.parametrize("case", CASES)
def test_a_file_is_of_one_format_only(case, tmp_path):
    if case.format == "Argoverse 2":
        pytest.importorskip("pyarrow")
    head = read_head(case.write(tmp_path))
    assert [one.name for one in FORMATS if one.recognises(head)] == [case.format]


def test_the_name_does_not_matter(tmp_path):
    path = w.write_interaction(tmp_path).rename(tmp_path / "tracks.bin")
    assert recognise(read_head(path)).name == "INTERACTION"


def test_highd_that_drives_leftwards_and_stands_points_left(tmp_path):
    path = w.write_highd(tmp_path)
    lines = path.read_text().splitlines()
    stands = [lines[0], *(f"{k},9,10.0,3.0,4.0,2.0,0.0,0.0,0,0,0,2" for k in range(5))]
    path.write_text("\n".join(stands) + "\n")
    (tmp_path / "01_tracksMeta.csv").write_text(
        "id,width,height,class,drivingDirection\n9,4.0,2.0,Car,1\n"
    )
    (found,) = read(path)
    assert found.heading == pytest.approx(np.full(5, np.pi))
    assert (found.x[0], found.y[0]) == (12.0, -4.0)


def test_traffic_lights_of_scenarionet_change_when_they_are_recorded_to(tmp_path):
    path = w.write_scenarionet(tmp_path)
    whole = pickle.loads(path.read_bytes())
    words = ["LANE_STATE_STOP"] * 10 + ["LANE_STATE_GO"] * 5 + ["odd"] * (w.N - 10)
    lit = {"type": "TRAFFIC_LIGHT", "state": {"object_state": words}, "lane": 184}
    far = lit | {"lane": 7, "stop_point": np.zeros(3, np.float32)}
    whole["dynamic_map_states"] = {
        184: lit | {"stop_point": np.array([3.0, 4.5, 0.0], np.float32)},
        7: far,
    }
    line = np.column_stack([np.arange(6.0), np.full(6, 4.0), np.zeros(6)]).astype(np.float32)
    whole["map_features"] = {
        "184": {"type": "LANE_SURFACE_STREET", "polyline": line},
        "7": {"type": "LANE_SURFACE_STREET", "polyline": line + np.float32(100.0)},
    }
    path.write_bytes(pickle.dumps(whole))
    (found,) = read(path)
    light, unknown = (found.facts.lights[name] for name in ("184", "7"))
    assert light.lane == "184"
    assert [word for _, word in light.changes] == ["red", "green", "unknown"]
    assert [time for time, _ in light.changes] == pytest.approx([0.0, 1.0, 1.5])
    assert light.path.tolist() == [[3.0, 4.5], [4.0, 4.0], [5.0, 4.0]]
    assert len(unknown.path) == 0


@pytest.mark.parametrize(("wrong", "rule"), [
    ({"stop_point": ["a"]}, "stop_point"),
    ({"state": {"object_state": "red"}}, "object_state"),
])  # fmt: skip
def test_lights_of_scenarionet_are_checked(tmp_path, wrong, rule):
    path = w.write_scenarionet(tmp_path)
    whole = pickle.loads(path.read_bytes())
    whole["dynamic_map_states"] = {"1": {"state": {"object_state": []}, "lane": [1]} | wrong}
    whole["map_features"] = {"[1]": {"polyline": [[0.0, 0.0], [1.0, 0.0]]}}
    path.write_bytes(pickle.dumps(whole))
    with refuses(FileFormatError, rule):
        list(read(path))


def test_a_folder_gives_its_recordings_and_names_the_rest(tmp_path):
    tracks, table = w.write_highd(tmp_path), w.write_states(tmp_path)
    note = tmp_path / "readme.txt"
    note.write_text("hello\n")
    assert files_of(tmp_path) == ([tracks, table], [note])


def test_the_ids_of_two_places_are_two_recordings(tmp_path):
    path = w.write_ngsim(tmp_path)
    text = path.read_text()
    path.write_text(text + text.split("\n", 1)[1].replace("us-101", "i-80"))
    assert [one.facts.name for one in read(path)] == ["us-101", "i-80"]


def test_vehicles_of_an_argoverse_file_have_the_box_of_their_kind_only_after_cleaning(tmp_path):
    pytest.importorskip("pyarrow")
    (found,) = read(w.write_argoverse(tmp_path))
    assert np.isnan(found.length).all()


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "is empty"),
        (b"PK\x03\x04" + b"../../etc/passwd", "is an archive (zip)"),
        (b"\x1f\x8b\x08\x00abc", "is an archive (gzip)"),
        (b"a,b,c\n1,2,3\n", "no known format"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "is a Git LFS pointer"),
        (b"id,frameRate,locationId\n1,25,2\n", "belongs to a recording"),
        (b"SQLite format 3\x00" + b"\x00" * 84, "no valid database"),
        (b"<commonRoad commonRoadVersion='2017'/>", "commonRoadVersion must be"),
        (b"<!DOCTYPE a [<!ENTITY b 'c'>]><commonRoad>&b;</commonRoad>", "DOCTYPE"),
        (b"<!DOCTYPE a [<!ENTITY b 'c'>]><fcd-export>&b;</fcd-export>", "DOCTYPE"),
        (b'{"objects": [{"position": 3}]}', "must be lists"),
    ],
)
def test_what_is_no_recording_is_refused(tmp_path, data, says):
    path = tmp_path / "file"
    path.write_bytes(data)
    with pytest.raises(FileFormatError, match=re.escape(says)) as error:
        list(read(path))
    assert str(path) in str(error.value)
