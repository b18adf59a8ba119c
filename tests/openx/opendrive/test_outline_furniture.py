"""What stands on and beside the roads, as it is drawn."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from shapely.geometry import Polygon

from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.furniture import CornerLocal, Object, Outline
from bridgegen.openx.opendrive.outline import crosswalk_stripes, lights, outline, outline_of
from bridgegen.scenario.ontology.individuals import build_static

from .kinds import KINDS, model


@pytest.fixture(scope="module")
def signals():
    return model("signals")


def test_stripes_lie_along_the_road_side_by_side(signals):
    """Four crosswalks of 4 m over four lanes of 3.5 m: 14 m hold 14 stripes of 0.48 m."""
    for road in signals.roads:
        stripes = [Polygon(one) for one in crosswalk_stripes(road)]
        if road.is_connecting:
            assert stripes == []
            continue
        assert len(stripes) == 14
        gap = 14.0 / 29
        assert [one.area for one in stripes] == pytest.approx([gap * 4.0] * 14)
        for one, other in pairwise(stripes):
            assert one.distance(other) == pytest.approx(gap)


def test_the_maps_own_stop_lines_replace_ours(signals):
    """Behind the crosswalk: 6 m before the junction, and none at its edge."""
    stops = [points for kind, points in outline(signals) if kind == "stop"]
    assert len(stops) == 4
    assert [np.abs(line).max() for line in stops] == pytest.approx([13.0 + 6.25] * 4)


def test_lights_face_who_comes(signals):
    found = lights(signals)
    assert len(found) == 4
    for one in found:
        inwards = np.array([-one.x, -one.y]) / np.hypot(one.x, one.y)
        assert inwards @ [np.cos(one.h), np.sin(one.h)] > 0.7


def test_nobody_waits_on_a_motorway_nor_in_the_ring():
    motorway = replace(KINDS["merge"], road_type="motorway")
    merge = opendrive_from_owl(build_static({}, motorway))
    assert not [kind for kind, _ in outline(merge) if kind == "stop"]
    ring = [points for kind, points in outline(model("roundabout")) if kind == "stop"]
    assert len(ring) == 4  # of the legs, which give way


def test_the_ring_is_round_inside():
    """The island's edge is as far from the middle as the ring's inner border, all the way round."""
    shapes = outline(model("roundabout"), step=0.2)
    area = Polygon()
    for kind, points in shapes:
        if kind in ("driving", "junction"):
            area = area.union(Polygon(points).buffer(1e-3))
    (island,) = (Polygon(ring) for ring in area.interiors)
    away = [np.hypot(x, y) for x, y in island.exterior.coords]
    assert min(away) == pytest.approx(15.0 - 2.5, abs=0.15)
    assert max(away) == pytest.approx(15.0 - 2.5, abs=0.15)


def test_an_outline_of_its_own_is_turned_and_moved(signals):
    road = next(one for one in signals.roads if not one.is_connecting)
    box = Outline(corners_local=tuple(
        CornerLocal(u, v, 0.0, 0.0) for u, v in ((0, 0), (2, 0), (2, 1), (0, 1), (0, 0))
    ))  # fmt: skip
    one = Object(id="9", s=10.0, t=1.0, hdg=np.pi / 2, type="barrier", outline=box)
    corners = outline_of(road, one)
    assert corners.shape == (4, 2)  # the last is the first
    assert Polygon(corners).area == pytest.approx(2.0)
    straight = outline_of(road, replace(one, hdg=0.0))
    along = straight[1] - straight[0]
    across = corners[1] - corners[0]
    assert along @ across == pytest.approx(0.0, abs=1e-9)
