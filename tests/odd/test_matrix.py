"""Matrices of scenario files: which rows they stand for, and what is wrong with others."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import approve, refuses

from bridgegen.base.errors import ScenarioError
from bridgegen.jobs.suite.rows import rows_of
from bridgegen.scenario.language import protocols as matrices
from bridgegen.scenario.language.protocols import Grid
from bridgegen.scenario.language.reader import load, shipped_text

GRID = """
  - edition: "2030"
    name: slow
    source: Ours.
    values:
      gap: [10 m, 40 m]
      lateral_speed: [0.5, 1.0]
    sets:
      - {ego_speed: 72 km/h, relative_speed: 36 km/h}
      - {ego_speed: 36 km/h, relative_speed: 36 km/h}
"""


@pytest.fixture
def written(tmp_path):
    """Return a function that writes r157/cut-in with a matrix."""

    def write(text, *, head="matrix:"):
        path = tmp_path / "cut-in.yaml"
        given = shipped_text("r157/cut-in").decode().replace("r157-cut-in", "cut-in")
        path.write_text(f"{given}\n{head}{text}", "utf-8")
        return path

    return write


def test_all_combinations_that_keep_the_bounds_are_rows(written):
    scenario = load(written(GRID))
    (grid,) = scenario.matrix
    assert (len(grid), grid.label, grid.names) == (
        8, "2030 slow", ("gap", "lateral_speed", "ego_speed", "relative_speed"),
    )  # fmt: skip
    space = scenario.space()
    rows = rows_of(scenario, space, 100, 0)
    assert rows.names == ("ego_speed", "relative_speed", "gap", "lateral_speed")
    assert rows.excluded == 4  # the other car drives at 10 km/h or more: not 36 - 36
    found = {tuple(row) for row in rows.X[:, [space.index(name) for name in rows.names]].tolist()}
    assert found == set(product([20.0], [10.0], [10.0, 40.0], [0.5, 1.0]))
    others = space.index("other_speed"), space.index("change_time")
    assert {tuple(row) for row in rows.X[:, others].tolist()} == {(10.0, 7.0), (10.0, 3.5)}
    assert not space.violations(rows.X)


def test_an_edition_is_chosen_or_rows_are_drawn(written):
    more = GRID + '  - {edition: "2031", source: Ours., values: {gap: [20]}}\n'
    scenario = load(written(more))
    space = scenario.space()
    assert len(rows_of(scenario, space, 100, 0).X) == 5
    assert len(rows_of(scenario, space, 100, 0, "2031").X) == 1
    drawn = rows_of(scenario, space, 7, 0, "none")
    assert (len(drawn.X), drawn.grids) == (8, ())
    defaults = space.row({})
    defaults[space.index("gap")] = 20.0
    values = rows_of(scenario, space, 0, 0, "2031").X[0, : len(scenario.parameters)]
    given_ = space.row({"gap": 20.0})[: len(scenario.parameters)]
    np.testing.assert_array_equal(values, given_)


def test_a_matrix_belongs_to_the_fingerprint(written):
    without = load(written("", head="")).fingerprint
    some = load(written(GRID)).fingerprint
    other = load(written(GRID.replace("40 m", "41 m"))).fingerprint
    assert len({without, some, other}) == 3


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("gap: [10 m", "gapp: [10 m", "gapp"),
        ("gap: [10 m", "gap: [500 m", "120"),
        ("gap: [10 m", "gap: [10 s", "gap"),
        ("gap: [10 m", "change_time: [10", "change_time"),
        ("40 m]", "10]", "twice"),
        ("gap: [10 m, 40 m]", "gap: []", "empty"),
        ("gap: [10 m, 40 m]", "ego_speed: [20]", "ego_speed"),
        ("36 km/h, relative_speed: 36 km/h", "36 km/h", "sets"),
        ('"2030"', "2030", "text"),
        ("name: slow", "nam: slow", "nam"),
        ("name: slow", "points: 2", "points"),
        ("name: slow", "score: colour", "impact"),
    ],
)
def test_mistakes_are_told_with_their_lines(written, old, new, message):
    assert old in GRID
    with refuses(ScenarioError, message) as refused:
        load(written(GRID.replace(old, new, 1)))
    (problem,) = refused.value.problems
    assert "cut-in.yaml, line " in problem


def test_an_empty_grid_and_two_of_one_name_are_refused(written):
    empty = '\n  - {edition: "1", source: Ours.}\n  - {edition: "1", source: Ours.}\n'
    with pytest.raises(ScenarioError) as refused:
        load(written(empty))
    text = "\n".join(refused.value.problems)
    assert text.count("a grid must have values or sets") == 2
    approve(text, "called")


def test_too_many_combinations_are_refused(written, monkeypatch):
    monkeypatch.setattr(matrices, "MOST_ROWS", 7)
    with refuses(ScenarioError):
        load(written(GRID))


_VALUES = st.lists(st.floats(-5, 5), min_size=1, max_size=4, unique=True).map(tuple)


@given(
    values=st.dictionaries(st.sampled_from("abc"), _VALUES, min_size=1, max_size=3),
    sets=st.lists(st.tuples(st.floats(-1, 1), st.floats(-1, 1)), max_size=3),
)
def test_a_grid_is_the_product_of_its_values_and_sets(values, sets):
    together = tuple((("x", x), ("y", y)) for x, y in sets)
    grid = Grid("1", "", "Ours.", tuple(values.items()), together)
    columns = grid.columns()
    expected = [
        (*one, *pair) for *one, pair in product(*values.values(), [(x, y) for x, y in sets] or [()])
    ]
    assert list(zip(*(columns[name] for name in grid.names), strict=True)) == expected
    assert len(grid) == len(expected)
