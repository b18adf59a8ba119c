import numpy as np

from bridgegen.search.surrogates.subset import telling


def test_of_many_rows_the_smallest_half_is_kept_and_the_rest_is_spread():
    values = np.random.default_rng(1).permutation(1000).astype(np.float64)
    kept = telling(values, 100)
    assert (np.diff(kept) > 0).all()
    assert sorted(values[kept])[:50] == list(range(50))
    assert sorted(values[kept])[-1] == 999
    assert np.diff(sorted(values[kept])[50:]).max() < 25
    np.testing.assert_array_equal(telling(values[:100], 100), np.arange(100))
