import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from bridgegen.base.statistics import paired_drop

counts = st.integers(0, 40)


def test_the_interval_is_the_published_one():
    # R. Newcombe, Statistics in Medicine 17 (1998) 2635-2650, Table III, method 10:
    # 36 both, 12 and 2 discordant, 0 neither.
    drop, low, high = paired_drop(36, 12, 2, 0)
    assert drop == pytest.approx(0.2)
    assert (low, high) == pytest.approx((0.0569, 0.3404), abs=5e-5)


def test_two_independent_margins_are_added_in_squares():
    """By hand: where no case changes the correlation (a margin is empty) phi is 0."""
    drop, low, high = paired_drop(20, 12, 0, 0)  # 32 of 32 before, 20 of 32 after
    before = stats.binomtest(32, 32).proportion_ci(method="wilson")
    after = stats.binomtest(20, 32).proportion_ci(method="wilson")
    assert drop == 12 / 32
    below = ((1.0 - before.low) ** 2 + (after.high - 20 / 32) ** 2) ** 0.5
    above = 20 / 32 - after.low
    assert (low, high) == pytest.approx((drop - below, drop + above), abs=1e-9)


@given(counts, counts, counts, counts)
def test_laws(both, gone, new, neither):
    drop, low, high = paired_drop(both, gone, new, neither)
    assert -1.0 <= low <= drop <= high <= 1.0
    # A change and its reverse are the same with the sign turned.
    turned = paired_drop(both, new, gone, neither)
    assert turned == pytest.approx((-drop, -high, -low), abs=1e-12)
    # By as much as the harmful share drops, the harmless one rises.
    swapped = paired_drop(neither, new, gone, both)
    assert swapped == pytest.approx((-drop, -high, -low), abs=1e-12)


@pytest.mark.parametrize("n", [32, 100])
def test_significance_is_near_that_of_mcnemar_s_test(n):
    """The exact test of gone against new; they disagree within a case or two of its limit."""
    ours = min(k for k in range(n + 1) if paired_drop(n - k, k, 0, 0)[1] > 0.0)
    theirs = min(k for k in range(1, n + 1) if stats.binomtest(k, k).pvalue < 0.05)
    assert abs(ours - theirs) <= 1


def test_nothing_says_nothing():
    assert paired_drop(0, 0, 0, 0) == (0.0, -1.0, 1.0)
