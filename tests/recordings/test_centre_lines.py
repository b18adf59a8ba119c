"""Lanelets of maps that give lanes as centre lines."""

import json
import pickle

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import FileFormatError
from bridgegen.recordings.lanes.find import locate
from bridgegen.recordings.readers.centre_lines import lanelets_of_centre_lines
from bridgegen.recordings.readers.clean import clean
from bridgegen.recordings.readers.formats import read
from bridgegen.recordings.readers.road_lines import CentreLine

from . import writers as w


def _straight(x0, x1, y, n=2):
    return np.column_stack([np.linspace(x0, x1, n), np.full(n, float(y))])


def _lanelets(lines, road=()):
    found, notes = lanelets_of_centre_lines(
        [CentreLine(*line) if isinstance(line, tuple) else line for line in lines],
        dict(enumerate_names(road)), "here",
    )  # fmt: skip
    return {one.name: one for one in found}, notes


def enumerate_names(road):
    return ((f"line {k}", points) for k, points in enumerate(road))


def _ys(bound):
    return bound[:, 1].min(), bound[:, 1].max()


def test_bounds_are_half_way_to_neighbours_and_at_the_lines_of_the_road():
    found, _ = _lanelets(
        [("a", _straight(0, 60, 0)), ("b", _straight(0, 60, 3.2))],
        [_straight(-5, 70, -1.5), _straight(70, -5, 5.0)],
    )
    assert _ys(found["a"].right) == pytest.approx((-1.5, -1.5))
    assert _ys(found["a"].left) == pytest.approx((1.6, 1.6))
    assert _ys(found["b"].right) == pytest.approx((1.6, 1.6))
    assert _ys(found["b"].left) == pytest.approx((5.0, 5.0))
    assert (found["a"].left_same, found["b"].right_same) == ("b", "a")
    assert found["a"].right_same == found["b"].left_same == ""


@pytest.mark.parametrize(("away", "half"), [(0.8, 1.25), (1.4, 1.4), (3.5, 2.25)])
def test_a_lane_is_2_5_to_4_5_m_wide(away, half):
    found, _ = _lanelets([("a", _straight(0, 30, 0))], [_straight(0, 30, away)])
    assert _ys(found["a"].left) == pytest.approx((half, half))
    assert _ys(found["a"].right) == pytest.approx((-1.75, -1.75))  # nothing is there


def test_a_border_that_the_map_names_goes_before_what_is_nearer():
    lines = [CentreLine("a", _straight(0, 30, 0), borders=("line 1",))]
    found, notes = _lanelets(lines, [_straight(0, 30, 1.3), _straight(0, 30, 2.0)])
    assert _ys(found["a"].left) == pytest.approx((2.0, 2.0))
    assert "50% as named" in notes[0]


def test_an_outline_bounds_its_own_lane_only():
    box = np.array([[0, -1.4], [30, -1.4], [30, 1.6], [0, 1.6], [0, -1.4]])
    found, _ = _lanelets(
        [CentreLine("a", _straight(0, 30, 0), outline=box), ("b", _straight(0, 30, 3.9))]
    )
    assert _ys(found["a"].left) == pytest.approx((1.6, 1.6))
    assert _ys(found["a"].right) == pytest.approx((-1.4, -1.4))
    assert _ys(found["b"].right) == pytest.approx((1.95, 1.95))


def test_lines_across_are_no_borders():
    across = [np.array([[x, -9.0], [x, 9.0]]) for x in (10.0, 11.0, 12.0)]
    found, _ = _lanelets([("a", _straight(0, 30, 0))], across)
    assert _ys(found["a"].left) == pytest.approx((1.75, 1.75))


def test_a_lane_is_cut_where_one_beside_it_begins_and_ends():
    found, _ = _lanelets(
        [("a", _straight(0, 100, 0)), ("b", _straight(30, 80, 3.5)), ("c", _straight(0, 100, -3.5))]
    )
    assert set(found) == {"a#1", "a#2", "a#3", "b", "c#1", "c#2", "c#3"}
    assert found["a#2"].left_same == "b"
    assert found["b"].right_same == "a#2"
    assert [found[f"a#{k}"].right_same for k in (1, 2, 3)] == ["c#1", "c#2", "c#3"]
    assert found["a#1"].left_same == found["a#3"].left_same == ""
    assert [found[f"a#{k}"].successors for k in (1, 2, 3)] == [("a#2",), ("a#3",), ()]
    assert (found["a#2"].left[0, 0], found["a#2"].left[-1, 0]) == pytest.approx((30.0, 80.0))


def test_lanes_of_the_other_direction_are_opposite_and_do_not_cut():
    found, _ = _lanelets(
        [("a", _straight(0, 50, 0)), ("b", _straight(50, 0, 3.5)), ("c", _straight(40, 10, -3.5))]
    )
    assert (found["a"].left_opposite, found["b"].left_opposite) == ("b", "a")
    assert found["a"].left_same == ""


def test_without_the_maps_word_a_lane_leads_to_those_that_begin_at_its_end():
    ahead = [("b", _straight(50.3, 90, 0)), ("c", np.array([[50.0, 0.0], [80.0, 9.0]]))]
    turned = [("d", np.array([[50.0, 0.0], [50.0, 30.0]])), ("e", _straight(55, 90, 0))]
    found, _ = _lanelets([("a", _straight(0, 50, 0)), *ahead, *turned])
    assert set(found["a"].successors) == {"b", "c"}
    told = CentreLine("a", _straight(0, 50, 0), successors=("d", "nowhere"))
    found, _ = _lanelets([told, *ahead, *turned])
    assert found["a"].successors == ("d",)


def test_a_map_that_is_turned_and_moved_has_its_lanelets_turned_and_moved():
    bend = np.radians(np.linspace(0.0, 60.0, 40))
    lines = [
        (f"{r}", np.column_stack([r * np.sin(bend), r - r * np.cos(bend) - r + 100.0]))
        for r in (100.0, 103.5, 96.8)
    ]
    c, s = np.cos(2.1), np.sin(2.1)
    turn = np.array([[c, s], [-s, c]])
    here, _ = _lanelets(lines)
    there, _ = _lanelets([(name, points @ turn + [3e5, -2e5]) for name, points in lines])
    assert list(here) == list(there)
    for name, one in here.items():
        assert there[name].left_same == one.left_same
        assert there[name].left == pytest.approx(one.left @ turn + [3e5, -2e5], abs=1e-6)
    middle = here["100.0"]
    assert (middle.left_same, middle.right_same) == ("96.8", "103.5")
    radius = np.hypot(middle.left[:, 0], middle.left[:, 1] - 100.0)
    assert radius == pytest.approx(98.4, abs=0.02)  # half way, to the sagitta of a step


@pytest.mark.parametrize(
    ("points", "says"),
    [
        (np.array([[0.0, 0.0], [np.nan, 0.0]]), "within"),
        (np.array([[0.0, 0.0], [5e8, 0.0]]), "km"),
    ],
)
def test_maps_beyond_bounds_are_refused(points, says):
    with refuses(FileFormatError, says):
        _lanelets([("a", points)])


def test_lines_upon_each_other_are_refused_before_memory_is_used():
    heap = [np.array([[0.0, 0.0], [1.0, k * 1e-6]]) for k in range(5000)]
    with refuses(FileFormatError):
        _lanelets([(f"{k}", points) for k, points in enumerate(heap)])


LANES = {"11": _straight(-10, 120, -4.0, 40), "12": _straight(-10, 120, -7.5, 40)}
EDGES = {"21": _straight(-10, 120, -2.2, 40), "22": _straight(-10, 120, -9.3, 40)}


def _womd(path):
    whole = json.loads(path.read_text())
    for kind, lines in (("lane", LANES), ("road_edge", EDGES)):
        for name, points in lines.items():
            geometry = [{"x": x, "y": y, "z": 0.0} for x, y in points.tolist()]
            whole["roads"].append({"id": int(name), "type": kind, "geometry": geometry})
    whole["roads"].append({"id": 7, "type": "crosswalk", "geometry": []})
    path.write_text(json.dumps(whole))


def _scenarionet(path):
    whole = pickle.loads(path.read_bytes())
    for name, points in LANES.items():
        whole["map_features"][name] = {
            "type": "LANE_SURFACE_STREET", "polyline": points.astype(np.float32), "exit_lanes": [],
        }  # fmt: skip
    for name, points in EDGES.items():
        whole["map_features"][name] = {"type": "ROAD_EDGE_BOUNDARY", "polyline": points.tolist()}
    whole["map_features"]["crosswalk"] = {"type": "CROSSWALK", "polygon": np.zeros((4, 3))}
    path.write_bytes(pickle.dumps(whole))


@pytest.mark.parametrize(
    ("write", "add"), [(w.write_womd, _womd), (w.write_scenarionet, _scenarionet)]
)
def test_the_same_map_gives_the_same_lanelets_in_each_format(tmp_path, write, add):
    path = write(tmp_path)
    add(path)
    (found,) = read(path)
    expected, _ = _lanelets(list(LANES.items()), EDGES.values())
    assert {one.name for one in found.facts.lanelets} == set(expected)
    for one in found.facts.lanelets:
        other = expected[one.name]
        assert one.left == pytest.approx(other.left, abs=1e-4)
        assert one.right == pytest.approx(other.right, abs=1e-4)
        assert (one.left_same, one.right_same) == (other.left_same, other.right_same)
    assert any("2 centre lines" in note for note in found.facts.notes)


def test_a_lane_change_is_one_on_the_lanes_of_the_map(tmp_path):
    path = w.write_womd(tmp_path)
    _womd(path)
    (found,) = read(path)
    located = locate(clean(found).traffic)
    assert (located.lanes.source, located.fit.vehicle_share) == ("lanelets", 1.0)
    truck = located.placed.lane[-60:]
    assert [located.lanes.names[k] for k in truck[[0, -1]]] == ["12", "11"]
    assert np.count_nonzero(np.diff(truck)) == 1
    assert located.lanes.left[truck[0]] == truck[-1]


@pytest.mark.parametrize(
    ("write", "break_", "says"),
    [
        (w.write_womd, lambda whole: whole.update(roads=3), "roads"),
        (
            w.write_womd,
            lambda whole: whole.update(roads=[{"type": "lane", "geometry": [{"x": 1.0}]}]),
            "geometry",
        ),
        (w.write_scenarionet, lambda whole: whole.update(map_features=[1]), "be a dictionary"),
        (
            w.write_scenarionet,
            lambda whole: whole.update(map_features={5: {"type": "LANE_X", "polyline": [1, 2]}}),
            "feature",
        ),
    ],
)
def test_malformed_maps_are_an_error_with_their_place(tmp_path, write, break_, says):
    path = write(tmp_path)
    is_json = path.suffix == ".json"
    whole = json.loads(path.read_text()) if is_json else pickle.loads(path.read_bytes())
    break_(whole)
    path.write_bytes(json.dumps(whole).encode() if is_json else pickle.dumps(whole))
    with refuses(FileFormatError, says):
        list(read(path))


def _segment(left, right, **more):
    side = {"left": left, "right": right}
    points = {
        f"{name}_lane_boundary": [{"x": x, "y": y, "z": 0.0} for x, y in line]
        for name, line in side.items()
    }
    neighbours = {"left_neighbor_id": None, "right_neighbor_id": None}
    return {"lane_type": "VEHICLE", "successors": [], **points, **neighbours, **more}


@pytest.mark.parquet
def test_the_map_beside_an_argoverse_scenario_gives_its_lanes(tmp_path):
    pytest.importorskip("pyarrow")
    path = w.write_argoverse(tmp_path)
    lines = {y: [(-10.0, y), (120.0, y)] for y in (-9.0, -6.0, -2.0, 1.0)}
    back = {y: line[::-1] for y, line in lines.items()}
    segments = {
        "1": _segment(lines[-6.0], lines[-9.0], left_neighbor_id=2, successors=[3, 9]),
        "2": _segment(lines[-2.0], lines[-6.0], left_neighbor_id=3, right_neighbor_id=1),
        "3": _segment(back[-2.0], back[1.0], left_neighbor_id=2, lane_type="BIKE"),
    }
    beside = tmp_path / "log_map_archive_0a1e.json"
    beside.write_text(json.dumps({"lane_segments": segments}))
    (found,) = read(path)
    one, two, three = found.facts.lanelets
    assert found.facts.map == beside.name
    assert (one.left_same, one.right_same, one.successors) == ("2", "", ("3", "9"))
    assert (two.left_same, two.right_same, two.left_opposite) == ("", "1", "3")
    assert (three.left_same, three.left_opposite, three.kinds) == ("", "2", ("bicycleLane",))
    assert two.left.tolist() == [list(point) for point in lines[-2.0]]
    segments["1"]["left_lane_boundary"] = [{"x": 1.0, "y": 2.0}]
    beside.write_text(json.dumps({"lane_segments": segments}))
    with refuses(FileFormatError, "log_map_archive_0a1e", "log_map_archive_0a1e.json"):
        list(read(path))
