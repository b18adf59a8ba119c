import json
from math import log

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from tests.approval import refuses

from bridgegen.assess import metrics
from bridgegen.assess.objective import (
    Objective,
    Thresholds,
    entropy_weights,
    needs_sample,
    positivised,
)
from bridgegen.base.errors import InputError, UnknownNameError

PAPER = (("d_min", 0.8297), ("v_d", 0.1703))
UNWEIGHTED = (("d_min", None), ("v_d", None))
NAMES = ("n_collision", "d_min", "v_d")
KMH = 1 / 3.6


def paper() -> Objective:
    return Objective.build(PAPER)


@pytest.mark.parametrize(
    ("method", "d_min", "v_d", "fitness"),
    [("RS", 13.38, 17.92, -8.05), ("PPO", 2.00, 20.57, 1.84)],
)
def test_reproduces_the_papers_result_table(method, d_min, v_d, fitness):
    """Table "Experimental Results": averages of d_min [m], v_d [km/h] and fitness = −F."""
    F, ok = paper().F([[d_min, v_d * KMH]], ("d_min", "v_d"))
    assert ok.all()
    assert F.shape == (1, 1)
    assert round(-F[0, 0], 2) == fitness


def test_the_tables_pso_row_does_not_follow_from_its_own_d_min_and_v_d():
    F, _ = paper().F([[4.91, 20.49 * KMH]], ("d_min", "v_d"))
    assert round(-F[0, 0], 2) == -0.58  # printed: 16.59


def test_columns_are_found_by_name():
    row = {"v_d": 5.0, "ttc": 3.0, "d_min": 2.0, "n_collision": 0.0}
    F, _ = paper().F([list(row.values())], list(row))
    assert F[0, 0] == pytest.approx(0.8297 * 2.0 - 0.1703 * 18.0)


@pytest.mark.parametrize("name", list(metrics.METRICS))
def test_more_critical_is_smaller_F(name):
    """On either scale, for every metric, alone and among many."""
    values = np.array([[0.1], [0.5], [0.8]])  # within every cap
    worse = values if metrics.get(name).sense == "smaller" else values[::-1]
    for settings in (
        {},
        {"scale": "standardised", "sample": (values, [name])},
        {"objectives": "many"},
        {"objectives": "many", "scale": "standardised", "sample": (values, [name])},
    ):
        F, _ = Objective.build([(name, 0.7)], **settings).F(worse, [name])
        assert (np.diff(F[:, 0]) > 0).all()


def test_many_objectives_are_a_column_each_and_weights_have_no_part():
    objective = Objective.build(PAPER, objectives="many")
    F, _ = objective.F([[2.0, 5.0], [0.0, 0.0]], ("d_min", "v_d"))
    np.testing.assert_allclose(F, [[2.0, -18.0], [0.0, 0.0]])
    assert not np.signbit(F[1]).any()
    assert (objective.n_obj, paper().n_obj) == (2, 1)
    assert objective.weights == (1.0, 1.0)


def test_standardised_by_the_samples_range_and_beyond_it():
    sample = ([[4.0, 0.0], [2.0, 10.0], [12.0, 5.0]], ("d_min", "v_d"))
    objective = Objective.build(PAPER, scale="standardised", sample=sample)
    # r of d_min: 12 m is 0, 2 m is 1; of v_d: 0 m/s is 0, 10 m/s is 1. Not clipped outside.
    F, _ = objective.F([[12.0, 0.0], [2.0, 10.0], [7.0, 10.0], [0.0, 20.0]], ("d_min", "v_d"))
    np.testing.assert_allclose(
        F[:, 0],
        [0.0, -1.0, -(0.8297 * 0.5 + 0.1703), -(0.8297 * 1.2 + 0.1703 * 2.0)],
    )


def test_a_metric_constant_in_the_sample_counts_in_its_own_unit():
    sample = ([[3.0, 0.0], [5.0, 0.0]], ("d_min", "n_collision"))
    terms = [("d_min", 1.0), ("n_collision", 2.0)]
    objective = Objective.build(terms, scale="standardised", sample=sample)
    F, _ = objective.F([[5.0, 0.0], [5.0, 1.0]], ("d_min", "n_collision"))
    np.testing.assert_allclose(F[:, 0], [0.0, -2.0])


def test_infinite_metrics_count_as_their_cap():
    cap = metrics.get("ttc").cap
    F, ok = Objective.build([("ttc", 1.0)]).F([[np.inf], [cap], [2 * cap], [1.0]], ["ttc"])
    assert ok.all()
    np.testing.assert_array_equal(F[:, 0], [cap, cap, cap, 1.0])


@pytest.mark.parametrize("objectives", ["one", "many"])
@pytest.mark.parametrize("scale", ["raw", "standardised"])
def test_failed_rows_are_marked_and_filled_with_what_nothing_is_worse_than(scale, objectives):
    rng = np.random.default_rng(0)
    good = rng.uniform(0, [300.0, 40.0], (200, 2))
    rows = np.vstack([good, [[np.nan, np.nan], [np.inf, 0.0]]])
    objective = Objective.build(
        PAPER, scale=scale, objectives=objectives, sample=(good, ("d_min", "v_d"))
    )
    F, ok = objective.F(rows, ("d_min", "v_d"))
    assert np.isfinite(F).all()
    assert ok.tolist() == [True] * 200 + [False, True]
    assert (F[200] >= F).all()
    np.testing.assert_array_equal(F[200], F[201])  # as harmless as a metric can say
    alone, alone_ok = objective.F(rows[200:201], ("d_min", "v_d"))
    np.testing.assert_array_equal(alone, F[200:201])
    assert not alone_ok.any()


def test_a_row_does_not_depend_on_its_batch():
    rows = np.random.default_rng(1).uniform(0, 30, (53, 3))
    names = ("d_min", "v_d", "a_change")
    objective = Objective.build(
        [(name, None) for name in names],
        weights="entropy", scale="standardised", sample=(rows, names),
    )  # fmt: skip
    whole, _ = objective.F(rows, names)
    for k in (0, 17, 52):
        assert objective.F(rows[k : k + 1], names)[0].tobytes() == whole[k : k + 1].tobytes()
    assert objective.F(rows[::-1], names)[0].tobytes() == whole[::-1].tobytes()
    assert objective.F(rows[:0], names)[0].shape == (0, 1)


# Critical scenarios: the paper's table of thresholds.


@pytest.mark.parametrize(
    ("n_collision", "d_min", "v_d", "expected"),
    [
        (0, 2.0, 5.0, False),
        (0, 1.99, 5.0, True),
        (0, 1.99, 1.0, True),
        (0, 1.99, 0.99, False),  # the ego was standing
        (1, 0.0, 0.0, True),  # a collision counts even then
        (2, 0.0, 9.0, True),
        (0, 50.0, 9.0, False),
        (np.nan, np.nan, np.nan, False),
    ],
)
def test_critical(n_collision, d_min, v_d, expected):
    assert paper().critical([[n_collision, d_min, v_d]], NAMES).tolist() == [expected]


def test_thresholds_are_the_users():
    rows = [[0, 2.5, 3.0], [0, 1.9, 0.9], [1, 3.0, 0.0], [2, 3.0, 0.0]]
    thresholds = Thresholds(n_collision_above=1, d_min_below=3.0, v_d_at_least=0.5)
    objective = Objective.build(PAPER, thresholds=thresholds)
    assert objective.critical(rows, NAMES).tolist() == [True, True, False, True]
    assert paper().critical(rows, NAMES).tolist() == [False, False, True, True]
    with refuses(InputError, "d_min_below", "nan"):
        Thresholds(d_min_below=float("nan"))


def test_needed_metrics_are_the_terms_and_the_thresholds():
    assert paper().needed_metrics == ("d_min", "v_d", "n_collision")
    assert Objective.build([("ttc", 1.0)]).needed_metrics == ("ttc", "n_collision", "d_min", "v_d")


# Entropy weights, Eqs. 4 to 7.


def test_entropy_weights_by_hand():
    """Columns p = (0, 1/3, 2/3) and p = (0, 0, 1), m = 3."""
    E = (log(3) / 3 + 2 * log(1.5) / 3) / log(3)
    R = [[0.0, 0.0], [0.5, 0.0], [1.0, 1.0]]
    np.testing.assert_allclose(entropy_weights(R), np.array([1 - E, 1.0]) / (2 - E), rtol=1e-14)


@given(arrays(float, st.tuples(st.integers(2, 30), st.integers(1, 6)), elements=st.floats(0, 1)))
def test_entropy_weights_agree_with_scipys_entropy(R):
    varies = np.ptp(R, axis=0) > 0
    got = entropy_weights(R)
    assert got.sum() == pytest.approx(1.0)
    assert (got >= 0).all()
    if not varies.any():
        np.testing.assert_allclose(got, 1 / R.shape[1])
        return
    assert (got[~varies] == 0).all()
    E = np.array([scipy.stats.entropy(c) / log(len(c)) if c.any() else 1.0 for c in R.T])
    d = np.where(varies, 1 - E, 0.0)
    if d.sum() > 1e-6:  # else rounding decides
        np.testing.assert_allclose(got, d / d.sum(), atol=1e-9)


@given(st.permutations(range(8)), st.lists(st.floats(0.1, 10), min_size=3, max_size=3))
def test_entropy_weights_depend_on_neither_order_nor_scale(order, factors):
    R = np.random.default_rng(3).random((8, 3))
    np.testing.assert_allclose(entropy_weights(R[order] * factors), entropy_weights(R), rtol=1e-9)


def test_a_rare_event_weighs_more_than_what_all_share():
    rng = np.random.default_rng(0)
    R = np.column_stack([np.arange(100) == 7, rng.uniform(0.4, 1.0, 100)])
    rare, common = entropy_weights(R)
    assert rare > 10 * common


def test_entropy_weights_without_information():
    np.testing.assert_array_equal(entropy_weights(np.full((5, 4), 0.3)), np.full(4, 0.25))
    np.testing.assert_array_equal(entropy_weights([[0.2, 0.9]]), [0.5, 0.5])
    np.testing.assert_array_equal(entropy_weights([[0.0, 1.0], [0.0, 1.0]]), [0.5, 0.5])
    np.testing.assert_array_equal(entropy_weights([[0.0, 0.0], [0.0, 1.0]]), [0.0, 1.0])


def test_entropy_weights_where_rounding_decides():
    """Columns that vary in the last bits only: their entropy rounds to 1, or beyond."""
    for m in range(2, 200):
        nearly = np.ones((m, 1))
        nearly[0] -= 2.0**-53
        weights = entropy_weights(np.hstack([nearly, np.ones((m, 1))]))
        np.testing.assert_allclose(weights, [1.0, 0.0])
        informative = np.linspace(0, 1, m)[:, None]
        assert (entropy_weights(np.hstack([nearly, informative])) >= 0.0).all()


@pytest.mark.parametrize("R", [[[-0.1, 0.5]], [[np.nan, 0.5]], np.zeros((0, 2)), np.zeros(3)])
def test_entropy_weights_refuse_what_is_no_share(R):
    with pytest.raises(ValueError, match="R must"):
        entropy_weights(R)


def test_weights_of_a_sample_standardise_positivise_and_leave_out_failed_rows():
    names = ("d_min", "v_d", "n_collision")
    good = np.array([[10.0, 0.0, 0.0], [6.0, 3.0, 0.0], [np.inf, 9.0, 0.0], [2.0, 8.0, 0.0]])
    cap = metrics.get("d_min").cap
    sample = np.vstack([good[:2], np.full((1, 3), np.nan), good[2:]])
    objective = Objective.build(
        [(name, None) for name in names], weights="entropy", sample=(sample, names)
    )
    R = np.column_stack(
        [(cap - np.minimum(good[:, 0], cap)) / (cap - 2.0), good[:, 1] / 9.0, np.zeros(4)]
    )
    np.testing.assert_allclose(objective.weights, entropy_weights(R), rtol=1e-12)
    assert objective.weights[2] == 0.0
    # On the raw scale the sample leaves nothing behind but the weights.
    a, b, _ = objective.weights
    F, _ = objective.F([[4.0, 5.0, 1.0]], names)
    assert F[0, 0] == pytest.approx(a * 4.0 - b * 18.0)


def test_positivised_is_larger_for_more_critical():
    x = positivised([[3.0, 4.0], [np.inf, 0.0]], ("ttc", "v_d"), ("v_d", "ttc"))
    np.testing.assert_array_equal(x, [[4.0, -3.0], [0.0, -metrics.get("ttc").cap]])


def test_a_sample_is_needed_for_entropy_weights_and_the_standardised_scale():
    assert not needs_sample("fixed", "raw")
    assert needs_sample("entropy", "raw")
    assert needs_sample("fixed", "standardised")
    assert not needs_sample("entropy", "raw", "many")  # weights have no part there
    Objective.build(UNWEIGHTED, weights="entropy", objectives="many")
    with refuses(ValueError):
        Objective.build(UNWEIGHTED, weights="entropy")
    with refuses(InputError):
        Objective.build(
            UNWEIGHTED, weights="entropy", sample=(np.full((3, 2), np.nan), ("d_min", "v_d"))
        )


# What a store keeps.


@pytest.mark.parametrize("objectives", ["one", "many"])
@pytest.mark.parametrize("scale", ["raw", "standardised"])
def test_comes_back_from_json_to_the_last_bit(scale, objectives):
    rows = np.random.default_rng(5).uniform(0, 20, (40, 2))
    objective = Objective.build(
        UNWEIGHTED, weights="entropy", scale=scale, objectives=objectives,
        thresholds=Thresholds(d_min_below=1.5), sample=(rows, ("d_min", "v_d")),
    )  # fmt: skip
    again = Objective.from_dict(json.loads(json.dumps(objective.to_dict())))
    assert again == objective
    assert again.F(rows, ("d_min", "v_d"))[0].tobytes() == (
        objective.F(rows, ("d_min", "v_d"))[0].tobytes()
    )


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"extra": 1}, "extra"),
        ({"weights": [1.0]}, "weights"),
        ({"weights": "ab"}, "objective"),
        ({"weights": [1.0, float("inf")]}, "weights"),
        ({"names": ["d_min", "dmin"]}, "d_min"),
        ({"scale": "standardised"}, "low"),
        ({"low": [0.0, 0.0]}, "low"),
        ({"span": [1.0, 0.0], "low": [0.0, 0.0], "scale": "standardised"}, "span"),
        ({"thresholds": {"d_min_under": 2.0}}, "objective"),
        ({"thresholds": None}, "objective"),
    ],
)
def test_a_damaged_record_is_refused(change, message):
    with refuses(InputError, message):
        Objective.from_dict(paper().to_dict() | change)


# Bad input.


@pytest.mark.parametrize(
    ("terms", "settings", "message"),
    [
        ([("d_mim", 1.0)], {}, "d_mim"),
        (PAPER, {"weights": "entropie"}, "entropie"),
        (PAPER, {"scale": "standardized"}, "standardized"),
        (PAPER, {"objectives": "two"}, "two"),
    ],
)
def test_unknown_names_suggest_the_nearest(terms, settings, message):
    with refuses(UnknownNameError, message):
        Objective.build(terms, **settings)


@pytest.mark.parametrize(
    ("terms", "settings", "message"),
    [
        ([], {}, "objective"),
        ([("d_min", 1.0), ("d_min", 2.0)], {}, "each"),
        ([("d_min", None), ("v_d", 1.0)], {}, "d_min"),
        (PAPER, {"weights": "entropy"}, "d_min"),
        ([("d_min", -1.0)], {}, "1 finite weights ≥ 0"),
        ([("d_min", float("nan"))], {}, "1 finite weights ≥ 0"),
        ([("d_min", 0.0), ("v_d", 0.0)], {}, "weight"),
    ],
)
def test_senseless_objectives_are_refused(terms, settings, message):
    with refuses(InputError, message):
        Objective.build(terms, **settings)


def test_all_problems_at_once():
    with pytest.raises(InputError) as caught:
        Objective.build(UNWEIGHTED)
    assert len(caught.value.problems) == 2


def test_a_missing_column_is_an_error_not_a_guess():
    with refuses(ValueError, "v_d"):
        paper().F([[1.0]], ["d_min"])
    with refuses(ValueError, "n_collision"):
        paper().critical([[1.0, 2.0]], ["d_min", "v_d"])
    with refuses(ValueError, "metrics"):
        paper().F([[1.0, 2.0, 3.0]], ["d_min", "v_d"])


# ------------------------------------------------------------------------ harm


def by_harm(**more) -> Objective:
    return Objective.build([("harm", 1.0)], rule="harm", **more)


def test_harm_is_critical_from_a_near_miss_on():
    values = [[0.29], [0.3], [0.61], [np.nan]]
    assert by_harm().critical(values, ["harm"]).tolist() == [False, True, True, False]
    F, ok = by_harm().F(values, ["harm"])
    assert F[:3, 0].tolist() == [-0.29, -0.3, -0.61]
    assert ok.tolist() == [True, True, True, False]


def test_any_conflict_counts_where_that_is_asked_for():
    every = by_harm(count="any")
    assert every.names == ("harm_any",)
    assert every.critical([[0.0, 0.7]], ["harm", "harm_any"]).tolist() == [True]
    assert by_harm().critical([[0.0, 0.7]], ["harm", "harm_any"]).tolist() == [False]


def test_what_could_not_happen_is_not_fit():
    F, ok = by_harm().F([[0.9], [0.2]], ["harm"], fit=[False, True])
    assert ok.tolist() == [False, True]
    assert F[0, 0] == 0.0 > F[1, 0]  # as if nothing had happened


def test_an_objective_of_an_earlier_version_goes_by_its_thresholds():
    earlier = {k: v for k, v in paper().to_dict().items() if k not in ("rule", "count")}
    assert Objective.from_dict(earlier) == paper()
    assert Objective.from_dict(by_harm(count="any").to_dict()) == by_harm(count="any")


@pytest.mark.parametrize(
    ("wrong", "message"),
    [({"rule": "luck"}, "critical"), ({"count": "none"}, "conflicts")],
)
def test_unknown_rules_are_refused(wrong, message):
    with refuses(UnknownNameError, message):
        Objective.from_dict({**paper().to_dict(), **wrong})
