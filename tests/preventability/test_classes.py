"""The class of a cell, by the outcomes of the driver and of the models."""

from dataclasses import replace

import numpy as np
import pytest

from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.preventability.classes import CellClass, Outcome, classes, collides
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.rollout import Rollout

A, C, F, N, X = (
    Outcome.AVOIDED, Outcome.COLLIDED, Outcome.FAILED, Outcome.NOT_APPLICABLE, Outcome.NOT_NEEDED,
)  # fmt: skip


@pytest.mark.parametrize(
    ("driver", "models", "expected"),
    [
        (A, (X, X), CellClass.AVOIDED),
        (A, (C, C), CellClass.AVOIDED),
        (C, (A, X), CellClass.PREVENTABLE),
        (C, (C, A), CellClass.PREVENTABLE),
        (C, (F, A), CellClass.PREVENTABLE),
        (C, (C, C), CellClass.UNPREVENTABLE),
        (C, (C, N), CellClass.UNPREVENTABLE),
        (C, (C, F), CellClass.NO_RESULT),  # the one that failed might have avoided it
        (C, (F, F), CellClass.NO_RESULT),
        (C, (N, N), CellClass.NO_RESULT),
        (C, (C, X), CellClass.NO_RESULT),
        (F, (A, A), CellClass.NO_RESULT),
        (N, (A, A), CellClass.NOT_APPLICABLE),
    ],
)
def test_the_class_follows_from_the_outcomes(driver, models, expected):
    found = classes(np.array([driver], np.int8), np.array(models, np.int8)[:, np.newaxis])
    assert found.tolist() == [expected]


def test_every_class_has_a_label_of_its_own():
    assert len({one.label for one in CellClass}) == len(CellClass)


def still(x: float, y: float = 0.0, h: float = 0.0, n_steps: int = 2) -> Rollout:
    """An ego at the origin, 4 m by 2 m, and another at (x, y, h), 2 m by 1 m; at instant 1 only."""
    place = np.zeros((1, 2, 2))
    xs, ys, hs = place.copy(), place.copy(), place.copy()
    xs[0, 1], ys[0, 1], hs[0, 1] = (100.0, x), y, h
    return Rollout(
        time_step=0.1, names=("ego", "other"), box=np.array([[4.0, 2.0, 1.0], [2.0, 1.0, 0.0]]),
        x=xs, y=ys, h=hs, v=place, a=place, offset=place, n_steps=np.array([n_steps]),
        status=np.zeros(1, np.int8),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("rollout", "expected"),
    [
        (still(3.98 + 0.005), True),  # the ego's front is at 3 m, the other's rear at x - 1 m
        (still(3.995), False),  # 5 mm are a touch
        (still(4.5), False),
        (still(1.0, 1.48), True),  # beside it: flanks at 1 m and y - 0.5 m
        (still(1.0, 1.495), False),
        (still(3.4, 0.0, np.pi / 2), True),  # across the way: its flank is at x - 0.5 m
        (still(3.6, 0.0, np.pi / 2), False),
        (still(3.98, n_steps=1), False),  # after the scenario's end
    ],
)
def test_boxes_collide_that_overlap_by_more_than_a_centimetre(rollout, expected):
    assert collides(rollout).tolist() == [expected]


def test_rows_that_end_where_the_ego_collides_have_the_same_outcomes():
    """And the same motion until then."""
    scenario = load("r157/cut-in")
    space = scenario.space()
    X = space.decode(np.random.default_rng(5).random((96, space.n_var)))
    pipeline = Pipeline(scenario, space, PipelineOptions(ego="route-follower"))
    whole, short = pipeline.runner.run(X), pipeline.runner.run(X, until_collision=True)
    hit = collides(whole)
    assert 10 < hit.sum() < 86
    np.testing.assert_array_equal(collides(short), hit)
    assert (short.n_steps[hit] < whole.n_steps[hit]).all()
    np.testing.assert_array_equal(short.n_steps[~hit], whole.n_steps[~hit])
    real = np.arange(whole.shape[2]) < short.n_steps[:, np.newaxis]
    for name in ("x", "y", "h", "v"):
        at = np.broadcast_to(real[:, np.newaxis], whole.shape)
        np.testing.assert_array_equal(getattr(short, name)[at], getattr(whole, name)[at])
    last = short.take(np.flatnonzero(hit))
    deep = collides(replace(last, n_steps=last.n_steps - 1))
    assert deep.mean() < 0.5  # they end at once: most overlap by 2 cm within a time step
