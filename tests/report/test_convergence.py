from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import ks_2samp

from bridgegen.pages.convergence import batches, telling_parameters, trend
from bridgegen.pages.data import Column, Evaluations


def rows(iteration, critical=None, status=None):
    n = len(iteration)
    return Evaluations(
        iteration=np.array(iteration, dtype=np.int64),
        parameters=(), metrics=(), objectives=(),
        critical=np.zeros(n, bool) if critical is None else np.array(critical, bool),
        status=np.zeros(n, np.int64) if status is None else np.array(status),
    )  # fmt: skip


def test_shares_by_hand():
    b = batches(rows([0, 0, 1, 1, 1, 4], [1, 0, 1, 1, 0, 0]))
    assert b.first.tolist() == b.last.tolist() == [1, 2, 5]
    assert b.evaluations.tolist() == [2, 5, 6]
    assert b.share == pytest.approx([0.5, 2 / 3, 0.0])
    assert b.cumulative == pytest.approx([0.5, 0.6, 0.5])
    assert b.group.tolist() == [0, 0, 1, 1, 1, 2]


def test_no_evaluation_makes_no_batch():
    b = batches(rows([]))
    assert b.first.size == b.last.size == b.share.size == b.group.size == 0


@given(
    counts=st.lists(st.integers(1, 5), min_size=1, max_size=60),
    limit=st.integers(1, 20),
    seed=st.integers(0, 99),
)
def test_merging_neither_loses_nor_doubles_an_evaluation(counts, limit, seed):
    iteration = np.repeat(np.arange(len(counts)), counts)
    critical = np.random.default_rng(seed).random(iteration.size) < 0.4
    b = batches(rows(iteration, critical), limit)
    assert b.first.size <= limit
    assert b.evaluations[-1] == iteration.size
    assert b.cumulative[-1] == pytest.approx(critical.mean())
    sizes = np.bincount(b.group, minlength=b.first.size)
    assert (b.share * sizes).sum() == pytest.approx(critical.sum())
    assert (b.first[1:] == b.last[:-1] + 1).all()
    assert b.first[0] == 1
    assert b.last[-1] == len(counts)


def test_trend_by_hand():
    values = np.array([4.0, 1.0, 2.0, 3.0, 5.0, np.inf, np.nan, np.nan])
    group = np.array([0, 0, 0, 0, 0, 1, 1, 2])
    t = trend(values, group, 3, larger_is_worse=False)
    assert [t.lower[0], t.median[0], t.upper[0], t.best[0]] == [2.0, 3.0, 4.0, 1.0]
    assert np.isnan(t.median[1:]).all()  # nothing finite there
    assert trend(values, group, 3, larger_is_worse=True).best[0] == 5.0


def test_the_planted_parameter_tells_most():
    rng = np.random.default_rng(0)
    x = rng.random((300, 4))
    critical = x[:, 2] + 0.3 * x[:, 1] > 0.9
    columns = tuple(Column(f"p{j}", "1", x[:, j], searched=j < 3) for j in range(4))
    columns += (Column("constant", "1", np.ones(300), searched=True),)
    ok = np.ones(300, bool)
    names = telling_parameters(columns, critical, ok)
    score = {
        c.name: ks_2samp(c.values[critical], c.values[~critical]).statistic for c in columns[:3]
    }
    assert names == sorted(score, key=score.__getitem__, reverse=True)
    assert names[0] == "p2"


@pytest.mark.parametrize("critical", [np.zeros(5, bool), np.ones(5, bool)])
def test_without_two_groups_the_declared_order_stays(critical):
    columns = tuple(Column(n, "1", np.arange(5.0) + i, searched=True) for i, n in enumerate("ba"))
    assert telling_parameters(columns, critical, np.ones(5, bool)) == ["b", "a"]


def test_failed_rows_do_not_tell():
    values = np.array([1.0, 1.0, 1.0, np.nan, 99.0])
    column = Column("p", "1", values, searched=True)
    ok = np.array([1, 1, 1, 0, 0], bool)
    assert telling_parameters((column,), np.array([1, 0, 0, 1, 1], bool), ok) == []


def test_failed_rows_count_in_the_share(report):
    e = replace(report.evaluations, status=np.ones(120, np.int64))
    assert batches(e).evaluations[-1] == 120
