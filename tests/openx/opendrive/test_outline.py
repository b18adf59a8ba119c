"""The picture of a road network: its areas and lines, measured."""

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest
from shapely.geometry import LineString, Polygon
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.model import Lane, OpenDrive, RoadMark, Width
from bridgegen.openx.opendrive.outline import AREAS, LINES, outline


def by_kind(shapes: list[tuple[str, np.ndarray]]) -> dict[str, list[np.ndarray]]:
    found: dict[str, list[np.ndarray]] = {}
    for kind, points in shapes:
        assert points.shape[1:] == (2,)
        assert len(points) >= 2
        assert np.isfinite(points).all()
        found.setdefault(kind, []).append(points)
    assert set(found) <= {*AREAS, *LINES}
    return found


def test_default_crossroads_by_hand(crossroads: Callable[..., OpenDrive]) -> None:
    shapes = outline(crossroads())
    assert [kind in LINES for kind, _ in shapes] == sorted(kind in LINES for kind, _ in shapes)
    found = by_kind(shapes)
    # Four arms of 60 m with four lanes of 3.5 m.
    assert [Polygon(area).area for area in found["driving"]] == pytest.approx([60.0 * 14.0] * 4)
    assert sum(LineString(line).length for line in found["centre"]) == pytest.approx(4 * 60.0)
    assert sum(LineString(line).length for line in found["broken"]) == pytest.approx(8 * 60.0)
    assert [LineString(line).length for line in found["stop"]] == pytest.approx([7.0] * 4)
    # A square of 26 m less its corners: 6 m squares in which kerbs of radius 6 m are inscribed.
    (junction,) = found["junction"]
    wanted = 26.0**2 - np.pi * 6.0**2
    assert Polygon(junction).area == pytest.approx(wanted, abs=0.5)
    assert Polygon(junction).is_valid


def test_stop_lines_lie_across_the_lanes_in(crossroads: Callable[..., OpenDrive]) -> None:
    south = by_kind(outline(crossroads()))["stop"][0]
    np.testing.assert_allclose(
        south[np.argsort(south[:, 0])], [(0.0, -13.0), (7.0, -13.0)], atol=1e-9
    )


def test_nothing_drivable_lies_outside(crossroads: Callable[..., OpenDrive]) -> None:
    """The areas cover every lane's centre and touch without gaps."""
    model = crossroads(lanes=3, size=30.0)
    found = by_kind(outline(model, step=0.2))
    whole = Polygon(found["junction"][0])
    for area in found["driving"]:
        whole = whole.union(Polygon(area).buffer(1e-6))
    assert whole.geom_type == "Polygon"
    from bridgegen.openx.opendrive.lanes import lane_pose

    for road in model.roads:
        for lane in road.sections[0].lanes:
            for s in np.linspace(0.0, road.length, 9):
                x, y = lane_pose(road, lane.id, float(s))[:2]
                assert whole.buffer(0.05).contains(LineString([(x, y), (x, y + 1e-3)]))


def test_markings_and_lanes_beside(crossroads: Callable[..., OpenDrive]) -> None:
    model = crossroads()
    road = model.road("1")
    section = road.sections[0]
    outer, inner = section.left
    solid = dataclasses.replace(inner, road_marks=(RoadMark(0.0, "solid"),))
    none = dataclasses.replace(section.right[0], road_marks=(RoadMark(0.0, "none"),))
    walk = Lane(3, "sidewalk", widths=(Width(0.0, 2.0, 0.0, 0.0, 0.0),))
    park = Lane(-3, "parking", widths=(Width(0.0, 2.5, 0.0, 0.0, 0.0),))
    wild = Lane(-4, "none", widths=(Width(0.0, 9.0, 0.0, 0.0, 0.0),))
    section = dataclasses.replace(
        section, left=(walk, outer, solid), right=(none, section.right[1], park, wild)
    )
    changed = dataclasses.replace(road, sections=(section,))
    found = by_kind(outline(dataclasses.replace(model, roads=(changed,), junctions=())))
    assert Polygon(found["sidewalk"][0]).area == pytest.approx(2.0 * 60.0)
    assert Polygon(found["shoulder"][0]).area == pytest.approx(2.5 * 60.0)
    assert Polygon(found["driving"][0]).area == pytest.approx(14.0 * 60.0)
    assert len(found["solid"]) == 1
    assert "broken" not in found


def test_one_junction_of_town05(town05: OpenDrive) -> None:
    found = by_kind(outline(town05, "965"))
    assert len(found["driving"]) == 6  # roads 0, 1, 17, 47, 18, 40
    (area,) = found["junction"]
    # A square of about 24.5 m less its corners: squares of about 5.2 m with a kerb in each.
    shape = Polygon(area).buffer(0.01)  # joints leave gaps of millimetres
    assert shape.geom_type == "Polygon"
    assert shape.area == pytest.approx(24.5**2 - np.pi * 5.2**2, rel=0.02)
    corners = [line for line in found["edge"] if LineString(line).length < 10.0]
    assert len(corners) == 4
    assert all(np.hypot(*np.diff(line, axis=0).T).max() < 1.1 for line in corners)  # no spurs
    assert len(found["sidewalk"]) == 12
    everything = by_kind(outline(town05))
    assert len(everything["junction"]) == 21


def test_no_such_junction(crossroads: Callable[..., OpenDrive]) -> None:
    with refuses(InputError, "100"):
        outline(crossroads(), "7")
