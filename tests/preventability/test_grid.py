"""Axes over parameters, and the rows of cells."""

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.jobs.preventability.grid import DEFAULT_GRIDS, Grid, GridAxis, grid_of, read_axis
from bridgegen.scenario.language.reader import load

CUT_IN = load("r157/cut-in").space()


def test_an_axis_reads_as_it_is_written():
    assert read_axis("gap=1:120:60") == ("gap", GridAxis(1.0, 120.0, 60))
    assert read_axis("ego_speed=20 km/h:130 km/h:12")[1] == GridAxis("20 km/h", "130 km/h", 12)


@pytest.mark.parametrize(
    "text", ["gap", "gap=1:2", "gap=1:2:3:4", "=1:2:3", "gap=1::3", "gap=1:2:x"]
)
def test_what_is_no_axis_is_refused(text):
    with pytest.raises(InputError, match="--grid"):
        read_axis(text)


@pytest.mark.parametrize(
    ("axes", "message"),
    [
        (["speed=1:2:3"], "ego_speed"),
        (["other_speed=1:2:3"], "other_speed"),  # derived
        (["gap=1:120:0"], "got 0"),
        (["gap=1:120:-5"], "-5"),
        (["gap=20:10:5"], "20"),
        (["gap=1:500:5"], "120 m"),
        (["gap=1 km/h:5:5"], "1 km/h"),
        (["gap=a:5:5"], "gap"),
        (["gap=nan:5:5"], "gap"),
        (["gap=1:120:100000", "lateral_speed=1:1.8:1000"], "50"),
        (["gap=1:120:9", "gap=1:120:9"], "parameter"),
    ],
)
def test_a_wrong_axis_is_one_clear_error(axes, message):
    with refuses(InputError, message):
        grid_of("r157-cut-in", CUT_IN, axes)


def test_all_wrong_axes_are_named_at_once():
    with pytest.raises(InputError) as error:
        grid_of("r157-cut-in", CUT_IN, ["gap=1:120:0", "speed=1:2:3"])
    assert len(error.value.problems) == 2


def test_a_category_is_no_axis():
    with refuses(InputError, "stationary_type", "r157-cut-out"):
        grid_of("r157-cut-out", load("r157/cut-out").space(), ["stationary_type=0:1:2"])


def test_a_scenario_without_a_grid_of_its_own_asks_for_axes():
    with refuses(InputError, "cut-in"):
        grid_of("cut-in", load("cut-in").space(), None)


def test_rows_are_those_of_the_space_and_the_last_axis_is_fastest():
    axes = {"gap": GridAxis(10.0, 30.0, 3), "ego_speed": GridAxis(20.0, 30.0, 2)}
    grid = Grid.of(CUT_IN, axes)
    X, ok = grid.rows(0, grid.cells)
    assert ok.all()
    expected = [
        CUT_IN.row({"gap": gap, "ego_speed": speed})
        for gap in (10.0, 20.0, 30.0)
        for speed in (20.0, 30.0)
    ]
    np.testing.assert_array_equal(X, expected)
    np.testing.assert_array_equal(grid.rows(2, 5)[0], X[2:5])


def test_cells_that_break_a_constraint_do_not_apply():
    """The other drives at 10 km/h at least: 30 km/h less than the ego from 40 km/h on."""
    axes = {"ego_speed": GridAxis("20 km/h", "60 km/h", 5)}
    grid = Grid.of(load("r157/cut-in").space(fixed={"relative_speed": 30.0 / 3.6}), axes)
    assert grid.rows(0, 5)[1].tolist() == [False, False, True, True, True]


@pytest.mark.parametrize("name", ["r157/cut-in", "r157/cut-out", "r157/deceleration"])
def test_the_grids_of_the_regulation_keep_to_its_ranges(name):
    scenario = load(name)
    space = scenario.space()
    grid = grid_of(scenario.name, space, None)
    assert scenario.name in DEFAULT_GRIDS
    X, ok = grid.rows(0, grid.cells)
    assert 0.5 < ok.mean() <= 1.0
    some = np.random.default_rng(3).choice(np.flatnonzero(ok), 200)
    assert space.violations(X[some]) == []
    not_some = np.flatnonzero(~ok)[:50]
    assert all(space.violations(X[[i]]) for i in not_some)
