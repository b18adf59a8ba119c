import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bridgegen.pages.series import LARGEST, packed, unpacked

SCALES = st.sampled_from([1, 100, 1000, 10_000])
VALUES = arrays(
    np.float64, st.integers(0, 40),
    elements=st.one_of(st.floats(-1e6, 1e6), st.sampled_from([np.nan, np.inf, -np.inf])),
)  # fmt: skip


@given(VALUES, SCALES)
def test_they_come_back_to_half_a_unit_and_what_is_missing_stays_missing(values, scale):
    runs = json.loads(json.dumps(packed(values, scale)))
    back = unpacked(runs, len(values), scale)
    there = np.isfinite(values)
    assert np.isfinite(back).tolist() == there.tolist()
    error = np.abs(back[there] - values[there])
    assert (error <= 0.5 / scale + 1e-9 + 4e-16 * np.abs(values[there])).all()


@given(arrays(np.float64, 5, elements=st.floats(width=64)))
def test_what_is_too_large_to_count_is_missing(values):
    back = unpacked(packed(values, 1000), 5, 1000)
    assert np.isfinite(back).tolist() == (np.abs(values) <= (LARGEST + 0.5) / 1000).tolist()


@pytest.mark.parametrize(
    ("values", "runs"),
    [
        ([], []),
        ([np.nan], []),
        ([2.0], [[0, 1, 2]]),
        ([5.0] * 400, [[0, 400, 5]]),  # what stands still
        ([1.0, 3.0, 5.0, 7.0], [[0, 4, 1, 2]]),  # what moves steadily
        ([0.0, 0.0, 1.0, 3.0], [[0, 4, 0, 0, 1, 1]]),
        ([np.nan, 4.0, 5.0, np.inf, 1.0], [[1, 2, 4, 1], [4, 1, 1]]),
    ],
)
def test_by_hand(values, runs):
    assert packed(np.array(values), 1) == runs
