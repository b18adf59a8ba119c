"""Models that are computed instead of simulated."""

import numpy as np
import pytest

from bridgegen.base.errors import InputError
from bridgegen.drivers.preventable import avoids_cut_in, avoids_deceleration
from bridgegen.jobs.preventability.arithmetic import NAMES
from bridgegen.jobs.preventability.classes import CellClass
from bridgegen.jobs.preventability.preventability import map_preventability


def test_a_computed_cut_in_is_the_regulation_s(tmp_path):
    grid = ["gap=1:60:12", "relative_speed=10 km/h:50 km/h:5", "lateral_speed=0.5:1.5:3"]
    found = map_preventability(
        "r157/cut-in", NAMES, models=["computed:un-r157"], grid=grid, out=tmp_path / "map"
    )
    gap, relative, lateral = np.meshgrid(*found.grid.values, indexing="ij")
    speed = 60.0 / 3.6
    for name in NAMES:
        expected = avoids_cut_in(
            speed, speed - relative, gap, lateral, driver=name.partition(":")[2]
        )
        np.testing.assert_array_equal(found.classes[name] == CellClass.AVOIDED, expected)
    un_r157 = found.classes["computed:un-r157"]
    assert set(np.unique(un_r157).tolist()) == {CellClass.AVOIDED, CellClass.UNPREVENTABLE}
    fsm = found.classes["computed:fsm"]
    assert not (fsm == CellClass.PREVENTABLE).any() or (un_r157[fsm == 1] == 0).all()


def test_a_computed_deceleration_starts_at_the_headway(tmp_path):
    grid = ["headway=1:2:5", "deceleration=5:9.8:4", "ego_speed=20:36:3"]
    found = map_preventability(
        "r157/deceleration", "computed:un-r157", models=["fsm"], grid=grid, out=tmp_path / "map"
    )
    headway, braking, speed = np.meshgrid(*found.grid.values, indexing="ij")
    expected = avoids_deceleration(speed, speed, headway * speed, braking)
    np.testing.assert_array_equal(found.classes["computed:un-r157"] == CellClass.AVOIDED, expected)
    assert 0 < expected.sum() < expected.size


def test_a_computed_cut_out_agrees_with_the_simulated_driver(tmp_path):
    """Nothing turns before the ego there: un-r157 brakes for a vehicle that stands."""
    grid = ["gap=20:150:14", "ego_speed=20 km/h:130 km/h:6", "lateral_speed=1:2.4:3"]
    found = map_preventability(
        "r157/cut-out", ["un-r157", "computed:un-r157"], grid=grid, out=tmp_path / "map"
    )
    simulated, computed = (found.classes[name] for name in found.drivers)
    applies = simulated != CellClass.NOT_APPLICABLE
    np.testing.assert_array_equal(applies, computed != CellClass.NOT_APPLICABLE)
    assert applies.sum() > 100
    agree = (simulated == CellClass.AVOIDED) == (computed == CellClass.AVOIDED)
    assert agree[applies].mean() >= 0.98


def test_other_scenarios_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"computed in r157-cut-in, .*, and not in r157-following"):
        map_preventability(
            "r157/following", "computed:fsm", grid=["ego_speed=10:20:3"], out=tmp_path / "map"
        )
