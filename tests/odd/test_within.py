import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from bridgegen.scenario.language.box_sampling import _narrowed, draw_within, in_box
from bridgegen.scenario.language.kinds import FLOAT, INTEGER
from bridgegen.scenario.language.parameters import Axis, Parameter
from bridgegen.scenario.language.reader import load

SPACE = load("crossroads-s4").space(["weather"])
# Rain lifts the clouds, wind thins the fog, and both lower the sun: each range limits another.
RAIN = {
    "precipitation": (20.0, 60.0), "cloudiness": (40.0, 70.0), "fog_density": (30.0, 80.0),
    "sun_altitude_angle": (0.0, 40.0),
}  # fmt: skip
EVERY = load("crossroads-s4").space(tuple(Axis))
LANES = {"lanes_per_direction": (2.0, 3.0), "bv_start": (8.0, 20.0), "intersection_size": (25, 32)}


def box(space, edges):
    both = [
        edges.get(name, (space.parameters[name].low, space.parameters[name].high))
        for name in space.variables
    ]
    low, high = np.array(both).T
    return low, high


def blind(space, low, high, n=400_000):
    """Rows of the box by trying: random rows of the whole space, those outside thrown away."""
    X = space.decode(np.random.default_rng(1).random((n, space.n_var)))
    inside = in_box(space, X, low, high)
    return X[inside], inside.mean()


def p_values(space, X, Y):
    """Of a two-sample test of each searched parameter, and of each pair's product."""
    names = [space.index(name) for name in space.variables]
    A, B = X[:, names], Y[:, names]
    centre = B.mean(axis=0)
    pairs = [(i, j) for i in range(len(names)) for j in range(i)]
    return np.array(
        [stats.ks_2samp(A[:, k], B[:, k]).pvalue for k in range(len(names))]
        + [
            stats.ks_2samp(*(((Z - centre)[:, i] * (Z - centre)[:, j]) for Z in (A, B))).pvalue
            for i, j in pairs
        ]
    )


@pytest.mark.parametrize(("space", "edges"), [(SPACE, RAIN), (EVERY, LANES)])
def test_rows_are_distributed_as_those_that_blind_trying_leaves_in_the_box(space, edges):
    low, high = box(space, edges)
    expected, share = blind(space, low, high)
    drawn = draw_within(space, low, high, 6000, np.random.default_rng(2))
    assert drawn.X.shape == (6000, len(space.names))
    assert in_box(space, drawn.X, low, high).all()
    assert space.violations(drawn.X) == []
    p = p_values(space, drawn.X, expected)
    assert p.min() > 0.01 / len(p)
    assert drawn.share == pytest.approx(share, rel=4.0 / np.sqrt(len(expected)) + 0.02)


def test_the_lottery_matters_and_the_comparison_can_tell():
    space = load("paper/crossroads-s4").space()  # even weather: rain is met often
    low, high = box(space, RAIN)
    U = np.random.default_rng(2).random((6000, space.n_var))
    V, _, chance = _narrowed(space, U, low, high)
    every = space.decode(V[chance > 0.0])
    assert p_values(space, every, blind(space, low, high)[0]).min() < 1e-6


def test_a_box_that_random_search_never_meets_is_filled_all_the_same():
    space = load("paper/crossroads-s4").space()
    narrow = {"ego_speed": (7.0, 7.01), "bv_speed": (2.0, 2.01), "bv_start": (9.0, 9.02)}
    low, high = box(space, narrow | {"fog_density": (61.0, 62.0)})
    drawn = draw_within(space, low, high, 300, np.random.default_rng(0))
    assert len(drawn.X) == 300
    # The wind leaves such fog where it blows below 13 + 39/2.25 = 30.3 %; fog of 61 to 62 is 1 % of
    # what calm air may hold, and 1/61 of the least that it may. Speeds have their whole range or,
    # in rain and fog, somewhat less.
    speeds = 0.01 / 4.0 * 0.01 / 3.1 * 0.02 / 18.0
    assert speeds * 0.13 * 0.01 < drawn.share < speeds * 0.303 / 61.0 * 1.5


def test_rows_kept_by_too_small_a_largest_chance_are_tried_again(monkeypatch):
    """The last rows that are proposed are a hundred times as likely as all before them."""
    proposed = []

    def narrowed(space, U, low, high):
        proposed.append(space.decode(U))
        return U, 1.0, np.full(len(U), 1.0 if len(proposed) == 4 else 0.01)

    monkeypatch.setattr("bridgegen.scenario.language.box_sampling._narrowed", narrowed)
    low, high = box(SPACE, {})
    drawn = draw_within(SPACE, low, high, 1000, np.random.default_rng(0))
    assert len(drawn.X) == 1000
    chunk = {row.tobytes(): k for k, X in enumerate(proposed) for row in X}
    came = np.bincount([chunk[row.tobytes()] for row in drawn.X], minlength=4)
    assert came[:3].sum() == pytest.approx(3 * 4096 * 0.01, abs=40)
    assert came[3] == 1000 - came[:3].sum()


def test_a_whole_space_takes_every_row():
    low, high = box(SPACE, {})
    drawn = draw_within(SPACE, low, high, 100, np.random.default_rng(3))
    U = np.random.default_rng(3).random((4096, SPACE.n_var))  # the first that are proposed
    assert drawn.share == 1.0
    assert np.array_equal(drawn.X, SPACE.decode(U)[:100])


def test_what_no_row_can_be_in_stays_empty():
    low, high = box(SPACE, {"precipitation": (50.0, 100.0), "cloudiness": (0.0, 40.0)})
    drawn = draw_within(SPACE, low, high, 10, np.random.default_rng(0), most=20_000)
    assert (len(drawn.X), drawn.share) == (0, 0.0)
    low, high = box(EVERY, {"lanes_per_direction": (1.2, 1.8)})  # no whole number
    drawn = draw_within(EVERY, low, high, 10, np.random.default_rng(0))
    assert (len(drawn.X), drawn.share) == (0, 0.0)


@given(st.integers(-5, 5), st.integers(0, 4), st.floats(-6, 6), st.floats(0, 6), st.booleans())
def test_shares_are_those_whose_values_lie_in_the_range(lo, width, low, more, whole):
    one = Parameter("p", Axis.EXTENSION, "1", -5, 9, 0, INTEGER if whole else FLOAT)
    first, last = one.shares(low, low + more, float(lo), float(lo + width))
    share = np.linspace(0.0, 1.0, 1001)
    value = one.at(share, float(lo), float(lo + width))
    inside = (low <= value) & (value <= low + more)
    met = inside.mean()
    assert max(float(last - first), 0.0) == pytest.approx(met, abs=0.003)
    within = (first + 1e-9 < share) & (share < last - 1e-9)
    assert inside[within].all()
