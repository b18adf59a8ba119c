"""A run's figures, counted by hand."""

import math

import numpy as np

from bridgegen.assess.cause import Cause
from bridgegen.results.store.summary import summarise


def test_five_evaluations_of_which_one_failed_by_hand():
    critical = np.array([False, False, True, True, False])
    ok = np.array([True, True, True, True, False])
    d_min = np.array([4.0, 3.0, 0.0, 1.0, np.nan])
    v_d = np.array([0.0, 2.0, 8.0, 6.0, np.nan])
    cause = np.array([0, 0, Cause.PLANNING, Cause.CONTROL, 0], np.int8)
    found = summarise(critical, ok, d_min, v_d, cause, 12.5)
    assert (found.evaluations, found.critical, found.failed) == (5, 2, 1)
    assert found.r_critic == 0.4
    assert (found.first, found.fiftieth) == (3, None)
    assert (found.d_min_best, found.d_min_median) == (0.0, 2.0)
    assert (found.v_d_best, found.v_d_median) == (8.0, 4.0)
    assert found.seconds == 12.5
    assert found.causes == {"perception": 0, "planning": 1, "control": 1, "unavoidable": 0}


def test_the_first_and_the_fiftieth_are_counted_from_one():
    """Every second of 120 is critical, from the second on: the 2nd, and the 100th."""
    critical = np.arange(120) % 2 == 1
    ok, nothing = np.ones(120, bool), np.zeros(120)
    for n, fiftieth in ((99, None), (100, 100), (120, 100)):
        part = slice(0, n)
        found = summarise(critical[part], ok[part], nothing[part], nothing[part],
                          np.zeros(n, np.int8), 1.0)  # fmt: skip
        assert (found.first, found.fiftieth) == (2, fiftieth)
    assert found.causes == {}


def test_a_run_that_has_nothing_yet_or_failed_throughout():
    for n in (0, 3):
        nothing = np.full(n, np.nan)
        found = summarise(np.zeros(n, bool), np.zeros(n, bool), nothing, nothing,
                          np.zeros(n, np.int8), 0.0)  # fmt: skip
        assert (found.evaluations, found.critical, found.failed) == (n, 0, n)
        assert (found.first, found.fiftieth) == (None, None)
        assert math.isnan(found.d_min_best)
        assert math.isnan(found.v_d_median)
        assert math.isnan(found.r_critic) is (n == 0)
