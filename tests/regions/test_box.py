import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.scenario.language.parameters import Axis
from bridgegen.scenario.language.reader import load
from bridgegen.search.algorithms.tree import Leaf, fit_leaves
from bridgegen.search.regions.box import Box, joined, readable, whole

EVERY = load("crossroads-s4").space(tuple(Axis))
OUTER = whole(EVERY)
LANES = EVERY.variables.index("lanes_per_direction")


@st.composite
def leaves(draw):
    """Leaves as a tree makes them; of whole numbers, edges lie between two."""
    low, high = OUTER.low.copy(), OUTER.high.copy()
    for k in range(EVERY.n_var):
        ends = sorted(draw(st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0))))
        width = high[k] - low[k]
        if k == LANES:
            low[k], high[k] = draw(st.sampled_from([(1, 1.5), (1.5, 2.5), (1.5, 3), (1, 3)]))
        elif draw(st.booleans()) and ends[1] - ends[0] > 1e-6:
            low[k], high[k] = OUTER.low[k] + width * np.array(ends)
    return Leaf(np.maximum(low, OUTER.low), np.minimum(high, OUTER.high), 1, 1)


@given(leaves())
def test_edges_have_few_digits_and_move_little(leaf):
    box = readable(leaf, EVERY, OUTER)
    assert (OUTER.low <= box.low).all()
    assert (box.low <= box.high).all()
    assert (box.high <= OUTER.high).all()
    for k in set(range(EVERY.n_var)) - {LANES}:
        width, whole_width = leaf.high[k] - leaf.low[k], (OUTER.high - OUTER.low)[k]
        step = 10.0 ** np.floor(np.log10(min(width / 10, whole_width / 30)))
        for ours, exact, end in (
            (box.low[k], leaf.low[k], OUTER.low[k]), (box.high[k], leaf.high[k], OUTER.high[k])
        ):  # fmt: skip
            assert abs(ours - exact) <= width / 20 * (1 + 1e-9)
            assert exact != end or ours == end
            steps = ours / step
            whole_steps = abs(steps - round(steps)) < 1e-6 * max(1.0, abs(steps))
            assert whole_steps or ours in (OUTER.low[k], OUTER.high[k])


def test_whole_numbers_stay_whole():
    low, high = OUTER.low.copy(), OUTER.high.copy()
    low[LANES] = np.nextafter(1.5, 2)
    box = readable(Leaf(low, high, 1, 1), EVERY, OUTER)
    assert (box.low[LANES], box.high[LANES]) == (2.0, 3.0)


def test_narrowing_keeps_the_outer_edges():
    parent = Box(OUTER.low + 0.123456 * (OUTER.high - OUTER.low), OUTER.high)
    box = readable(Leaf(parent.low, parent.high, 1, 1), EVERY, parent)
    free = np.arange(EVERY.n_var) != LANES
    assert np.array_equal(box.low[free], parent.low[free])
    assert not box.narrows(box).any()


def test_boxes_that_are_joined_hold_the_same_rows():
    X = np.random.default_rng(1).random((2000, 3))
    leaves = fit_leaves(X, X.sum(axis=1) > 1.6, low=[0] * 3, high=[1] * 3, min_rows=20)
    some = [leaf for leaf in leaves if leaf.share > 0.5]
    fewer = joined(some)
    assert len(fewer) < len(some)
    for rows in (X, np.random.default_rng(2).random((2000, 3))):
        before = np.sum([leaf.holds(rows) for leaf in some], axis=0)
        after = np.sum([leaf.holds(rows) for leaf in fewer], axis=0)
        assert np.array_equal(before, after)
    assert sum(leaf.rows for leaf in fewer) == sum(leaf.rows for leaf in some)


def test_a_larger_box_meets_earlier_ones_again():
    """Four quarters: whichever two are first joined, the halves become the whole."""

    def quarter(a, b):
        edge = np.nextafter(0.5, 1)
        low = np.array([edge if a else 0.0, edge if b else 0.0])
        return Leaf(low, np.array([1.0 if a else 0.5, 1.0 if b else 0.5]), 1, a)

    for order in ([(0, 0), (1, 1), (0, 1), (1, 0)], [(0, 1), (1, 0), (1, 1), (0, 0)]):
        (one,) = joined([quarter(a, b) for a, b in order])
        assert (one.low.tolist(), one.high.tolist()) == ([0, 0], [1, 1])
        assert (one.rows, one.critical) == (4, 2)


@pytest.mark.parametrize(("gap", "boxes"), [(np.nextafter(0.5, 1), 1), (0.6, 2)])
def test_only_what_touches_is_joined(gap, boxes):
    one = Leaf(np.array([0.0]), np.array([0.5]), 1, 1)
    other = Leaf(np.array([gap]), np.array([1.0]), 2, 1)
    assert len(joined([other, one])) == boxes
