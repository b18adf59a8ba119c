"""A run that is read chunk by chunk is the run that is read at once."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridgegen.assess.conflict.findings import Findings
from bridgegen.jobs.compare.fronts import front
from bridgegen.jobs.compare.record import _Reader, points
from bridgegen.results.store.rows import Rows


def rows_of(n: int, seed: int) -> Rows:
    """A made-up run: metrics d_min and v_d on a coarse grid, some rows failed, some critical."""
    rng = np.random.default_rng(seed)
    metrics = rng.integers(0, 6, (n, 2)) / 2.0
    metrics[:, 0] += 0.5
    status = (rng.random(n) < 0.2).astype(np.int64)
    metrics[status != 0] = np.nan
    kinds = np.array(["", "crossing", "turning"], dtype=object)
    found = replace(Findings.none(n), conflict_type=kinds[rng.integers(0, 3, n)])
    return Rows(
        id=np.arange(n), batch=np.zeros(n, np.int64), seconds=np.arange(n) / 10.0,
        U=rng.random((n, 1)), X=rng.random((n, 1)), metrics=metrics, F=np.zeros((n, 1)),
        status=status, critical=(status == 0) & (rng.random(n) < 0.4),
        cause=np.zeros(n, np.int8), findings=found,
    )  # fmt: skip


@settings(max_examples=30)
@given(st.integers(0, 90), st.integers(1, 120), st.integers(1, 40), st.integers(0, 5))
def test_chunks_do_not_matter(n, budget, chunk, seed):
    rows = rows_of(n, seed)
    at = points(budget)
    reader = _Reader(["d_min", "v_d"], ["d_min", "v_d"], at)
    for start in range(0, n, chunk):
        reader.take(rows.take(np.arange(start, min(start + chunk, n))))
    assert (reader.count, reader.failed) == (n, int((rows.status != 0).sum()))
    assert reader.found == [int(rows.critical[:k].sum()) for k in at]
    numbers = np.flatnonzero(rows.critical)
    assert reader.hits == [(k + 1, k / 10.0) for k in numbers.tolist()]
    kinds = set(rows.findings.conflict_type[rows.critical]) - {""}
    assert {kind for kind, *_ in reader.modes} == kinds
    good = rows.status == 0
    terms = rows.metrics * [-1.0, 1.0]
    for k, seen in zip(at, reader.fronts, strict=True):
        assert np.array_equal(seen, -front(-terms[:k][good[:k]]))
    if good.any():
        assert np.array_equal(reader.low, terms[good].min(axis=0))
        assert np.array_equal(reader.high, terms[good].max(axis=0))
    else:
        assert reader.low is None


@pytest.mark.parametrize(("budget", "expected"), [(1, [1]), (3, [1, 2, 3]), (100, None)])
def test_a_curve_ends_at_the_budget(budget, expected):
    at = points(budget).tolist()
    assert at[-1] == budget
    assert at == (expected or list(range(2, 101, 2)))
