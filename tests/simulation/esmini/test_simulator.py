"""Rows by esmini."""

import numpy as np
import pytest

from bridgegen.odd.reader import load
from bridgegen.pipeline import Pipeline


@pytest.mark.esmini
@pytest.mark.parametrize("name", ["crossroads-s1", "crossroads-s4", "cut-in"])
def test_it_is_as_here(esmini, name):
    """esmini moves by the speed at a step's end: half a step of the change of speed."""
    logical = load(name)
    space = logical.space()
    here = Pipeline(logical, space, ego="route-follower")
    there = Pipeline(logical, space, ego="route-follower", simulator=esmini)
    X = space.decode(np.random.default_rng(4).random((4, space.n_var)))
    expected, got = here.rollout(X), there.rollout(X)
    assert got.status.tolist() == [0] * 4, got.messages
    np.testing.assert_array_equal(got.n_steps, expected.n_steps)
    np.testing.assert_array_equal(got.began, expected.began)
    np.testing.assert_allclose(got.v, expected.v, atol=1e-9)
    np.testing.assert_allclose(got.x, expected.x, atol=0.3)
    np.testing.assert_allclose(got.y, expected.y, atol=0.3)
