"""How far two simulators agree."""

import numpy as np
import pytest
from scipy.stats import spearmanr
from tests.approval import refuses

from bridgegen.search.screened.agreement import (
    NOTE,
    Agreement,
    counts,
    place_of,
    rank_correlation,
)


def agreement(**changes):
    values = {
        "screen": "embedded", "simulator": "esmini", "screen_evaluations": 200,
        "screen_budget": 400, "compared": 20, "both": 5, "screen_only": 3, "simulator_only": 2,
        "rank_correlation": 0.5, "false_early": 2, "false_late": 1,
    }  # fmt: skip
    return Agreement(**values | changes)


def test_the_rank_correlation_is_scipy_s():
    rng = np.random.default_rng(0)
    x = rng.integers(0, 9, 50).astype(float)  # with ties
    y = x + rng.integers(0, 9, 50)
    assert rank_correlation(x, y) == pytest.approx(spearmanr(x, y).statistic, abs=1e-12)
    assert rank_correlation(x, np.zeros(50)) is None
    assert rank_correlation(x[:1], y[:1]) is None


def test_counts():
    screened = np.array([1, 1, 1, 0, 0, 0], bool)
    critical = np.array([1, 1, 0, 1, 0, 0], bool)
    assert counts(screened, critical) == (2, 1, 1)
    assert agreement().neither == 10


def test_the_place_is_where_the_difference_was_made():
    rng = np.random.default_rng(0)
    U = rng.random((90, 8))
    difference = np.where((U[:, 3] >= 1 / 3) & (U[:, 3] < 2 / 3), 1.0, 0.1)
    found = place_of([f"x{i}" for i in range(8)], U, difference + 0.01 * rng.random(90))
    assert (found.parameter, found.low, found.high) == ("x3", 1 / 3, 2 / 3)
    assert found.inside == pytest.approx(1.0, abs=0.02)
    assert found.outside == pytest.approx(0.1, abs=0.02)


def test_differences_by_chance_have_no_place():
    """At most one in a hundred draws has one; of 200, ten would be a chance of 1e-4."""
    names, found = [f"x{i}" for i in range(8)], 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        found += place_of(names, rng.random((60, 8)), rng.random(60)) is not None
    assert found < 10


@pytest.mark.parametrize("difference", [np.zeros(30), np.ones(30)])
def test_equal_differences_have_no_place(difference):
    assert place_of(["x"], np.linspace(0.0, 1.0, 30)[:, np.newaxis], difference) is None


def test_a_record_and_back():
    found = agreement(place=None, ended_after=4, ended_because="so")
    assert Agreement.from_notes({NOTE: found.to_dict(), "other": 1}) == found
    assert Agreement.from_notes({"other": 1}) is None


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"both": -1}, "both"),
        ({"both": 30}, "more critical rows than compared"),
        ({"rank_correlation": "x"}, "rank_correlation"),
        ({"screen": ["x"]}, "screen"),
        ({"place": {"parameter": "x"}}, "place.low"),
    ],
)
def test_damaged_notes_are_named(changes, message):
    with refuses(ValueError, message):
        Agreement.from_notes({NOTE: agreement().to_dict() | changes})
