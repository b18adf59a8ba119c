"""Which model stands for whom."""

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.adapters.carla.stage import choose
from bridgegen.base.errors import InputError
from bridgegen.drivers.kinds import ANIMAL, CAR, NAMES, TRUCK
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load, names
from bridgegen.scenario.participants import OBJECT_CLASSES

from .stand_in_actors import blueprints

KNOWN = {one.id for one in blueprints()}


class Body:
    name = "vehicle.tesla.model3"


def test_who_is_named_as_a_blueprint_is_that():
    assert choose(Body(), TRUCK, (9.0, 2.5, 3.5), KNOWN) == "vehicle.tesla.model3"


def test_what_the_server_lacks_is_named():
    with refuses(InputError):
        choose(object(), CAR, (4.6, 1.9, 1.5), {"vehicle.bh.crossbike"})


def test_a_child_stands_for_an_animal():
    assert choose(object(), ANIMAL, (1.5, 0.5, 1.0), KNOWN) == "walker.pedestrian.0010"


def test_there_is_something_for_every_kind():
    assert [one.name for one in OBJECT_CLASSES if not KNOWN.intersection(one.carla)] == []


@pytest.mark.parametrize("scenario", names())
def test_everybody_of_the_catalogue_has_a_model(scenario):
    """The nearest in size of its kind: on foot if it is, with wheels if it has."""
    logical = load(scenario)
    pipeline = Pipeline(logical, logical.space())
    program = pipeline.runner.simulator.program
    storyboard = pipeline.runner.concrete(pipeline.space.row({})).storyboard
    objects = {one.name: one.entity_object for one in storyboard.entities.scenario_objects}
    for e, name in enumerate(program.names):
        size = tuple(program.bodies[e, [0, 1, 7]].tolist())
        kind = NAMES[int(program.kinds[e])]
        model = choose(objects[name], int(program.kinds[e]), size, KNOWN)
        expected = {"pedestrian": "walker", "animal": "walker", "other": "static"}
        assert model.startswith(expected.get(kind, "vehicle"))
        assert np.isfinite(size).all()
