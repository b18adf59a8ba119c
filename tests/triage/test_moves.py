import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.search.triage.moves import around, nearest, ranges, searched

seeds = st.integers(0, 2**32 - 1)


@given(seeds)
def test_feasible_values_are_kept_to_the_last_bit(every, seed):
    X = every.decode(np.random.default_rng(seed).random((20, every.n_var))) + 0.0
    assert (nearest(every, searched(every, X)) == X).all()


@given(seeds, st.floats(0.0, 3.0))
def test_any_wish_becomes_a_feasible_row(every, seed, size):
    random = np.random.default_rng(seed)
    X = every.decode(random.random((20, every.n_var)))
    wish = searched(every, X) + size * random.normal(size=(20, every.n_var)) * ranges(every)
    assert not every.violations(nearest(every, wish))


@given(seeds, st.integers(0, 10**6))
def test_neighbours_are_near_feasible_and_the_row_s_own(every, seed, number):
    x = every.decode(np.random.default_rng(number).random((1, every.n_var)))[0]
    first, second = around(every, x, seed, number, 8, 0.025)
    again = around(every, x, seed, number, 8, 0.025)
    assert (first == again[0]).all()
    assert (second == again[1]).all()
    assert not every.violations(np.concatenate([first, second]))
    other = around(every, x, seed, number + 1, 8, 0.025)[0]
    assert (first != other).any()


def test_a_neighbour_moves_by_at_most_the_radius_where_nothing_limits_it(space):
    x = space.row({})
    near = around(space, x, 0, 7, 4000, 0.025)[0]
    by = (searched(space, near) - searched(space, x[np.newaxis])) / ranges(space)
    assert np.abs(by).max() <= 0.025 + 1e-12
    assert np.abs(by).max() > 0.024
    assert np.abs(by.mean(axis=0)).max() < 0.001  # uniform: mean 0, deviation 0.025/√3
    assert np.allclose(by.std(axis=0), 0.025 / np.sqrt(3.0), rtol=0.05)
