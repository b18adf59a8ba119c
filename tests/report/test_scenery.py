from dataclasses import replace

import numpy as np
import pytest

from bridgegen.engine.pipeline import Pipeline
from bridgegen.openx.opendrive.furniture import Object
from bridgegen.pages.scenery import street_lights
from bridgegen.scenario.language.reader import load


@pytest.fixture(scope="module")
def roads():
    scenario = load("crossroads-s1")
    pipeline = Pipeline(scenario, scenario.space())
    return pipeline.runner.concrete(pipeline.space.row({})).roads


def test_street_lights_stand_beside_their_road(roads):
    """One on each side, 10 m along a straight road; a pole counts if its name says so."""
    first = roads.roads[0]
    posts = (
        Object(id="a", s=10.0, t=6.0, type="streetLamp"),
        Object(id="b", s=10.0, t=-6.0, type="pole", name="Street lamp 2"),
        Object(id="c", s=20.0, t=-6.0, type="pole", name="flag"),
    )
    lit = replace(roads, roads=(replace(first, objects=first.objects + posts), *roads.roads[1:]))
    found = street_lights(lit)
    assert found.shape == (2, 2)
    assert np.hypot(*(found[0] - found[1])) == pytest.approx(12.0)
    line = first.plan_view[0]
    middle = found.mean(axis=0)
    assert np.hypot(*(middle - [line.x, line.y])) == pytest.approx(10.0)


def test_a_road_without_has_none(roads):
    assert street_lights(roads).shape == (0, 2)
