"""Models that are computed instead of simulated."""

import numpy as np
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.jobs.preventability.arithmetic import NAMES
from bridgegen.jobs.preventability.classes import CellClass
from bridgegen.jobs.preventability.preventability import map_preventability


def test_a_computed_cut_in_crashes_where_the_commissions_code_does(tmp_path):
    """Its counts at 60 km/h (`tests/ego/test_preventable.py`), by relative speeds of 10 to 50 km/h.

    The scenario has no lateral speeds below 0.3 m/s, at which `un-r157` crashes up to 30 km/h.
    """
    grid = ["gap=1:59:59", "relative_speed=10 km/h:50 km/h:5", "lateral_speed=0.3:1.7:15"]
    found = map_preventability(
        "r157/cut-in", NAMES, models=["computed:un-r157"], grid=grid, out=tmp_path / "map"
    )
    crashes = {
        name: (found.classes[name] != CellClass.AVOIDED).sum(axis=(0, 2)).tolist() for name in NAMES
    }
    assert crashes["computed:fsm"] == [38, 85, 121, 157, 212]
    assert crashes["computed:un-r157"][3:] == [378, 438]
    un_r157 = found.classes["computed:un-r157"]
    assert set(np.unique(un_r157).tolist()) == {CellClass.AVOIDED, CellClass.UNPREVENTABLE}
    fsm = found.classes["computed:fsm"]
    assert (un_r157[fsm == CellClass.PREVENTABLE] == CellClass.AVOIDED).all()


def test_a_computed_deceleration_starts_at_the_headway(tmp_path):
    """Where the other one brakes harder than the ego, their stopping distances say who crashes."""
    grid = ["headway=1:2:5", "deceleration=8.2:9.8:2", "ego_speed=20:36:3"]
    found = map_preventability(
        "r157/deceleration", "computed:un-r157", models=["fsm"], grid=grid, out=tmp_path / "map"
    )
    headway, braking, speed = np.meshgrid(*found.grid.values, indexing="ij")
    reaction, ramp, most = 0.75, 0.6, 0.774 * 9.81  # s, s, m/s²
    needed = reaction + ramp / 2 + 0.5 * speed * (1 / most - 1 / braking)
    avoided = found.classes["computed:un-r157"] == CellClass.AVOIDED
    np.testing.assert_array_equal(avoided, headway >= needed)
    assert 0 < avoided.sum() < avoided.size


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
    with refuses(InputError, "r157-cut-in", "r157-following"):
        map_preventability(
            "r157/following", "computed:fsm", grid=["ego_speed=10:20:3"], out=tmp_path / "map"
        )
