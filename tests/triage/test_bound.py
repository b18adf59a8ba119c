import numpy as np
import pytest
from scipy import stats

from bridgegen.triage.bound import bound, estimate, least_margins


def text(**given):
    nothing = {"evaluations": 1000, "failed": 0, "implausible": 0, "harmful": 0, "modes": 0,
               "space": estimate("random", 0, 1000), "least": (), "ego": "reference"}  # fmt: skip
    return bound(**nothing | given).sentence


def test_nothing_in_a_thousand_draws_bounds_the_share_by_0_37_per_cent():
    """By hand: 1 − 0.025^(1/1000) = 0.00368."""
    space = estimate("random", 0, 1000)
    assert (space.share, space.low) == (0.0, 0.0)
    assert space.high == pytest.approx(1.0 - 0.025**0.001, abs=1e-12)
    assert text().endswith(
        "with 95 % confidence at most 0.37 % of the space is harmful (random draws)."
    )
    assert text().startswith("No failure found in 1000 evaluations: ")


def test_an_upper_bound_is_rounded_up():
    """By hand: 1 − 0.025^(1/256) = 0.014306, which is more than 1.4 %."""
    assert "at most 1.5 % of the space" in text(space=estimate("fresh", 0, 256))


def test_failures_of_fresh_draws_are_said_where_the_search_found_none():
    assert text(space=estimate("fresh", 6, 256), evaluations=30).startswith(
        "No failure found in 30 evaluations, but in 6 of 256 fresh random draws: "
    )
    assert "but in" not in text(space=estimate("fresh", 0, 256))


@pytest.mark.parametrize(("harmful", "rows"), [(0, 40), (3, 256), (17, 17)])
def test_shares_have_scipy_s_exact_interval(harmful, rows):
    ours = estimate("fresh", harmful, rows)
    theirs = stats.binomtest(harmful, rows).proportion_ci(0.95, "exact")
    assert (ours.low, ours.high) == pytest.approx((theirs.low, theirs.high), abs=1e-9)


def test_where_an_algorithm_chose_the_rows_no_share_is_stated():
    space = estimate("", 0, 0)
    assert (space.share, space.low, space.high) == (None, 0.0, 1.0)
    said = text(space=space, harmful=3, modes=2)
    assert said == (
        "reference fails in 2 ways: 3 of 1000 evaluations; the share of the space that is "
        "harmful is not estimated, for the search chose its rows."
    )


def test_sobol_points_are_named_so():
    assert "Sobol points" in text(space=estimate("sobol", 0, 64), evaluations=64)


def test_nothing_is_known_where_every_evaluation_failed():
    assert text(evaluations=7, failed=7) == (
        "No evaluation has a result, so nothing is known of reference."
    )


NAMES = ("harm", "course_ttc", "course_braking")


def test_least_margins_are_those_of_conflicts_that_count():
    """Evaluation 1 is hit by another without its fault: harm 0, though the time to collision is."""
    metrics = np.array([[0.05, np.inf, 0.0], [0.0, 0.0, 60.0], [0.2, 1.9, 2.5], [0.15, 1.2, 1.0]])
    harm = metrics[:, 0]
    ids, fit = np.arange(10, 14), np.ones(4, bool)
    found = {one.quantity: one for one in least_margins(metrics, NAMES, harm, ids, fit)}
    assert {name: (one.value, one.evaluation) for name, one in found.items()} == {
        "harm": (0.2, 12), "course_ttc": (1.2, 13), "course_braking": (2.5, 12),
    }  # fmt: skip
    said = text(least=tuple(found.values()))
    assert "least margin harm 0.20 of 0.3 (evaluation 13), 1.20 s to collision" in said
    nobody = least_margins(metrics[:1], NAMES, harm[:1], ids[:1], fit[:1])
    assert [one.value for one in nobody] == [0.05, None, None]
    failed = least_margins(metrics, NAMES, harm, ids, np.zeros(4, bool))
    assert [one.value for one in failed] == [None, None, None]
