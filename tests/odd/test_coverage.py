"""Coverage of bins and of their combinations, against hand-worked cases and plain counting."""

from itertools import combinations, product
from math import comb

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.scenario.language import coverage as binned
from bridgegen.scenario.language import coverage as module
from bridgegen.scenario.language.coverage import Ways, coverage, coverage_map
from bridgegen.scenario.language.kinds import INTEGER
from bridgegen.search.algorithms import Problem
from bridgegen.search.algorithms.pairwise import Pairwise


def none(X):
    return np.zeros(len(X), bool)


def test_two_parameters_by_hand(build, make_parameter):
    space = build([make_parameter("a"), make_parameter("b", -1.0, 1.0)]).space()
    X = np.array([[0.0, -1.0], [4.9, 0.9], [5.0, 0.0], [10.0, 1.0]])
    found = coverage(space, X, np.array([False, True, False, False]), bins=2)
    a, b = found.parameters
    assert a.edges.tolist() == [0.0, 5.0, 10.0]
    assert (a.name, a.axis, a.unit, a.integer) == ("a", "extension", "1", False)
    assert (a.evaluated.tolist(), a.critical.tolist()) == ([2, 2], [1, 0])
    # 0 is on b's inner edge and belongs to the upper bin; the ends belong to the outer ones.
    assert (b.evaluated.tolist(), b.critical.tolist()) == ([1, 3], [0, 1])
    one, two = found.ways  # two parameters have no triples
    assert (one.total, one.feasible, one.evaluated, one.critical) == (4, 4, 4, 2)
    # (low, low), (low, high), (high, high) twice; (high, low) is missing.
    assert (two.total, two.feasible, two.evaluated, two.critical) == (4, 4, 3, 1)
    assert two.share == 0.75


def test_how_much_of_the_road_that_is_by_hand(build, make_parameter):
    space = build([make_parameter("a"), make_parameter("b", -1.0, 1.0)]).space()
    X = np.array([[0.0, -1.0], [4.9, 0.9], [5.0, 0.0], [10.0, 1.0]])
    road = np.array([[1.0, -0.5], [2.0, -0.5], [9.0, -0.5], [9.0, 0.5], [1.0, 0.5]])
    found = coverage(space, X, np.array([False, True, False, False]), bins=2, met=road)
    a, b = found.parameters
    assert (a.met.tolist(), b.met.tolist()) == ([0.6, 0.4], [0.6, 0.4])
    one, two = found.ways
    assert one.met_evaluated == 1.0
    assert one.met_critical == pytest.approx((0.6 + 0.4) / 2)  # a is low, b is high
    assert two.met_evaluated == pytest.approx(0.8)  # all but (high, low)
    assert two.met_critical == pytest.approx(0.2)
    without = coverage(space, X, np.array([False, True, False, False]), bins=2)
    assert without.ways[0].met_evaluated is None
    assert without.parameters[0].met is None


def test_whole_numbers_have_a_bin_each(build, make_parameter):
    space = build([make_parameter("n", 2.0, 4.0, kind=INTEGER)]).space()
    found = coverage(space, np.array([[2.0], [4.0], [4.0]]), none([0] * 3), bins=50)
    (n,) = found.parameters
    assert n.integer
    assert n.edges.tolist() == [1.5, 2.5, 3.5, 4.5]
    assert n.evaluated.tolist() == [1, 0, 2]
    assert [(w.strength, w.total, w.evaluated) for w in found.ways] == [(1, 3, 2)]


def test_what_constraints_exclude_is_not_feasible(build, make_parameter):
    """b <= a leaves, of the 5 × 5 pairs, the diagonal and what is below it."""
    space = build([make_parameter("a"), make_parameter("b")], bounds=[("b", None, "a")]).space()
    found = coverage(space, np.empty((0, 2)), none([]))
    assert found.ways[1].total == 25
    assert found.ways[1].feasible == 15
    assert found.ways[1].evaluated == 0
    assert found.parameters[1].feasible.all()


def test_what_was_evaluated_is_feasible(build, make_parameter):
    """Even what is too rare for the sample: here there is no sample at all."""
    space = build([make_parameter("a"), make_parameter("b")]).space()
    found = coverage(space, np.array([[1.0, 9.0]]), np.array([True]), sample=0)
    assert found.ways[1] == Ways(2, 25, 1, 1, 1)
    assert coverage(space, np.empty((0, 2)), none([]), sample=0).ways[0].share == 0.0


def test_only_searched_parameters_count(build, make_parameter):
    scenario = build([make_parameter("a"), make_parameter("b"), make_parameter("c")])
    space = scenario.space(fixed={"b": 3.0})
    found = coverage(space, np.array([[1.0, 3.0, 9.0]]), none([0]), sample=100)
    assert [one.name for one in found.parameters] == ["a", "c"]
    assert [one.evaluated.tolist() for one in found.parameters] == [
        [1, 0, 0, 0, 0],
        [0, 0, 0, 0, 1],
    ]


def counted(bins_of, shape, t):
    """Plain Python: the distinct combinations of bins of rows."""
    return sum(
        len({tuple(row[list(chosen)]) for row in bins_of})
        for chosen in combinations(range(len(shape)), t)
    )


def agree(drawn, found):
    """Check that a map's totals are those of the coverage alone, and of its own cells."""
    whole = drawn.total
    assert (whole.evaluations, whole.critical, whole.sample, whole.ways) == (
        found.evaluations, found.critical, found.sample, found.ways,
    )  # fmt: skip
    for one, same in zip(whole.parameters, found.parameters, strict=True):
        assert (one.name, one.unit, one.axis, one.integer) == (
            same.name, same.unit, same.axis, same.integer,
        )  # fmt: skip
        for name in ("edges", "evaluated", "critical", "feasible"):
            assert np.array_equal(getattr(one, name), getattr(same, name))
    for pair in drawn.pairs:
        counts = (pair.feasible, pair.evaluated, pair.critical)
        assert pair.ways == Ways(2, pair.evaluated.size, *(int((c > 0).sum()) for c in counts))


@given(st.data())
@settings(max_examples=40)
@pytest.mark.parametrize("cells", [1 << 24, 1])
def test_as_counted_one_by_one(build, make_parameter, cells, data):
    sizes = data.draw(st.lists(st.integers(2, 5), min_size=1, max_size=5), "sizes")
    bins = data.draw(st.integers(1, 4), "bins")
    floats = data.draw(st.lists(st.booleans(), min_size=len(sizes), max_size=len(sizes)))
    shape = [bins if real else size for real, size in zip(floats, sizes, strict=True)]
    space = build(
        make_parameter(f"p{k}", 0.0, 1.0)
        if real
        else make_parameter(f"p{k}", 1.0, float(size), kind=INTEGER)
        for k, (real, size) in enumerate(zip(floats, sizes, strict=True))
    ).space()
    rng = np.random.default_rng(data.draw(st.integers(0, 2**32)))
    X = space.decode(rng.random((data.draw(st.integers(0, 40)), space.n_var)))
    hit = rng.random(len(X)) < 0.3
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(binned, "_CELLS", cells)
        found = coverage(space, X, hit, bins=bins, sample=50)
        drawn = coverage_map(space, X, hit, bins=bins, sample=50)
    which = np.array(
        [
            np.minimum(column * bins, bins - 1).astype(int) if real else column.astype(int) - 1
            for column, real in zip(X.T, floats, strict=True)
        ]
    ).T
    agree(drawn, found)
    for pair, (i, j) in zip(drawn.pairs, combinations(range(space.n_var), 2), strict=True):
        assert (pair.first, pair.second) == (space.variables[i], space.variables[j])
        for cell in product(range(shape[i]), range(shape[j])):
            there = (which[:, [i, j]] == cell).all(axis=1)
            assert pair.evaluated[cell] == there.sum()
            assert pair.critical[cell] == (there & hit).sum()
            assert pair.feasible[cell] or not there.any()
    sample = coverage(space, X[:0], hit[:0], bins=bins, sample=50)
    for way, alone in zip(found.ways, sample.ways, strict=True):
        t = way.strength
        chosen = combinations(shape, t)
        assert way.total == sum(len(list(product(*map(range, one)))) for one in chosen)
        assert way.evaluated == counted(which, shape, t)
        assert way.critical == counted(which[hit], shape, t)
        assert max(way.evaluated, alone.feasible) <= way.feasible <= way.total
        assert way.feasible <= way.evaluated + alone.feasible
    for number, one in enumerate(found.parameters):
        assert (
            one.evaluated.tolist()
            == np.bincount(which[:, number], minlength=shape[number]).tolist()
        )
        assert one.critical.sum() == hit.sum()


def test_a_pair_by_hand(build, make_parameter):
    """Where b <= a, the pair of bins (a low, b high) is in no scenario."""
    space = build([make_parameter("a"), make_parameter("b")], bounds=[("b", None, "a")]).space()
    X = np.array([[2.0, 1.0], [9.0, 8.0], [8.0, 1.0], [7.0, 6.0]])
    found = coverage_map(space, X, np.array([False, True, False, False]), bins=2)
    (pair,) = found.pairs
    assert (pair.first, pair.second) == ("a", "b")
    assert pair.evaluated.tolist() == [[1, 0], [1, 2]]  # rows are a's bins
    assert pair.critical.tolist() == [[0, 0], [0, 1]]
    assert pair.feasible.tolist() == [[True, False], [True, True]]
    assert found.total.ways[1] == pair.ways == Ways(2, 4, 3, 3, 1)


def test_a_grid_that_is_too_large_is_only_summed(build, make_parameter, monkeypatch):
    names = [make_parameter("n", 1.0, 4.0, kind=INTEGER), make_parameter("a")]
    space = build(names).space()
    X = space.decode(np.random.default_rng(0).random((9, 2)))
    whole = coverage_map(space, X, none(X))
    monkeypatch.setattr(module, "MAX_GRID", 19)
    (pair,) = coverage_map(space, X, none(X)).pairs
    assert (pair.evaluated, pair.critical, pair.feasible) == (None, None, None)
    assert pair.ways == whole.pairs[0].ways


def test_one_parameter_has_no_pairs(build, make_parameter):
    space = build([make_parameter("a")]).space()
    found = coverage_map(space, np.array([[1.0]]), none([0]), sample=10)
    assert found.pairs == ()
    assert [one.strength for one in found.total.ways] == [1]


def test_pairs_are_told_whatever_the_strength(build, make_parameter):
    space = build([make_parameter("a"), make_parameter("b")]).space()
    found = coverage_map(space, np.array([[1.0, 2.0]]), none([0]), strength=1, sample=10)
    assert len(found.total.ways) == len(found.pairs) == 1


def test_a_covering_array_covers_all_pairs(build, make_parameter):
    space = build(make_parameter(f"p{k}") for k in range(8)).space()
    search = Pairwise(Problem.unnamed(8), 0)
    U = np.concatenate([search.ask() for _ in range(3)])
    found = coverage(space, space.decode(U), none(U))
    pairs = found.ways[1]
    assert (pairs.total, pairs.feasible, pairs.evaluated) == (comb(8, 2) * 25,) * 3


def test_the_catalogue_s_constraints_leave_most_pairs(s4):
    """Rain needs cloud: the pair (most rain, least cloud) is in no scenario."""
    found = coverage(s4.space(), np.empty((0, len(s4.space().names))), none([]), strength=2)
    assert [w.total for w in found.ways] == [50, 45 * 25]
    assert found.ways[0].feasible == 50
    assert 1000 < found.ways[1].feasible < 1125


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"bins": 0}, "1 <= bins <= 1000 must hold, got 0"),
        ({"bins": 1001}, "got 1001"),
        ({"strength": 0}, "1 <= strength <= 3 must hold, got 0"),
        ({"strength": 4}, "got 4"),
    ],
)
def test_limits(build, make_parameter, more, message):
    space = build([make_parameter("a")]).space()
    with pytest.raises(InputError, match=message):
        coverage(space, np.empty((0, 1)), none([]), **more)
    with pytest.raises(InputError, match=message):
        coverage_map(space, np.empty((0, 1)), none([]), **more)


def test_wrong_shapes(build, make_parameter):
    space = build([make_parameter("a")]).space()
    with refuses(ValueError):
        coverage(space, np.empty((0, 2)), none([]))
    with refuses(ValueError, "critical"):
        coverage(space, np.zeros((3, 1)), none([0]))
