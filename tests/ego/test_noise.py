import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats
from tests.approval import refuses

from bridgegen.drivers.noise import noise_key

NUMBERS = st.floats(allow_nan=False, allow_infinity=False)
ROWS = st.dictionaries(st.text(max_size=5), NUMBERS, min_size=1, max_size=5)


@given(ROWS, st.randoms())
def test_a_key_does_not_depend_on_the_order_of_names(values, random):
    names = list(values)
    random.shuffle(names)
    assert noise_key({name: values[name] for name in names}, 1) == noise_key(values, 1)


@given(st.lists(st.tuples(NUMBERS, NUMBERS), min_size=1, max_size=10))
def test_a_key_depends_on_its_own_row_alone(rows):
    a, b = np.array(rows).T
    keys = noise_key({"a": a, "b": b}, len(rows))
    for i, (x, y) in enumerate(rows):
        assert noise_key({"a": x, "b": y}, 1)[0] == keys[i]


@given(NUMBERS, NUMBERS)
def test_values_that_differ_have_other_keys(a, b):
    same = a == b
    assert (noise_key({"x": a}, 1) == noise_key({"x": b}, 1))[0] == same
    assert (noise_key({"x": a, "y": b}, 1) == noise_key({"x": b, "y": a}, 1))[0] == same
    assert noise_key({"x": a}, 1) != noise_key({"y": a}, 1)


def test_minus_zero_is_zero():
    assert noise_key({"x": -0.0}, 1) == noise_key({"x": 0.0}, 1)


def test_one_number_stands_for_all_rows():
    assert (noise_key({"x": 2.5}, 3) == noise_key({"x": [2.5, 2.5, 2.5]}, 3)).all()


def test_keys_of_a_grid_of_values_are_spread_evenly():
    keys = noise_key({"x": np.arange(20_000) * 1e-3}, 20_000)
    assert stats.kstest(keys / 2.0**64, "uniform").pvalue > 1e-3
    low = (keys & np.uint64(0xFFFFFFFF)) / 2.0**32
    assert stats.kstest(low, "uniform").pvalue > 1e-3


def test_a_key_is_for_ever():
    # Handed-over files hold keys: a changed hash would change what they replay.
    assert int(noise_key({"speed": 6.9, "fog": 0.0}, 1)[0]) == 0x54567A7D124E850B


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_value_that_is_not_finite_is_refused(bad):
    with refuses(ValueError, "speed"):
        noise_key({"speed": [1.0, bad]}, 2)
