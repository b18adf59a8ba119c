"""Which scenarios besides the exported ones have their motion in the page."""

import numpy as np
import pytest

from bridgegen.pages.further import spread_evenly


def test_numbers_are_those_of_van_der_corput():
    assert spread_evenly(8, 8).tolist() == [0, 4, 2, 6, 1, 5, 3, 7]
    assert spread_evenly(1, 5).tolist() == [0]
    assert spread_evenly(0, 5).tolist() == []


@pytest.mark.parametrize("n", [5, 100, 1000, 4097])
def test_every_first_part_is_spread_over_all(n):
    assert sorted(spread_evenly(n, n)) == list(range(n))
    for most in (1, 3, 17, n // 2):
        found = spread_evenly(n, most)
        assert len(found) == min(n, most)
        gaps = np.diff([0, *sorted(found), n])
        assert gaps.max() <= 4 * n / most + 1
