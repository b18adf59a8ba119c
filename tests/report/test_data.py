from dataclasses import replace

import numpy as np
import pytest

from bridgegen.pages.data import Column
from bridgegen.pages.playback import Entity, Outline


def test_a_column_of_another_length_is_named(report):
    e = report.evaluations
    short = Column("bv_speed", "m/s", np.zeros(3))
    with pytest.raises(ValueError, match=r"bv_speed \[m/s\] must have shape \(120\), got \(3,\)"):
        replace(e, parameters=(short,))


def test_a_column_name_may_occur_once(report):
    e = report.evaluations
    with pytest.raises(ValueError, match="unique, got d_min twice"):
        replace(e, objectives=(replace(e.objectives[0], name="d_min"),))


@pytest.mark.parametrize("field", ["critical", "status"])
def test_flags_have_one_entry_a_row(report, field):
    with pytest.raises(ValueError, match=f"{field} must have shape"):
        replace(report.evaluations, **{field: getattr(report.evaluations, field)[1:]})


def test_iterations_ascend(report):
    with pytest.raises(ValueError, match="iteration must ascend"):
        replace(report.evaluations, iteration=report.evaluations.iteration[::-1])


def test_an_outline_has_a_known_kind_and_finite_points():
    with pytest.raises(ValueError, match=r"one of .*driving.*; got 'grass'"):
        Outline("grass", np.zeros((2, 2)))
    with pytest.raises(ValueError, match="needs 2 points, got 1"):
        Outline("edge", np.zeros((1, 2)))
    with pytest.raises(ValueError, match="must be finite"):
        Outline("edge", np.array([[0.0, np.nan], [1.0, 1.0]]))


def test_a_box_has_an_extent():
    with pytest.raises(ValueError, match="box of 'ego'"):
        Entity("ego", 0.0, 1.9, 1.4)
    with pytest.raises(ValueError, match="box of 'ego'"):
        Entity("ego", 4.6, 1.9, float("nan"))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"n_steps": 0}, r"n_steps of playback '0001' must be in 1..401, got 0"),
        ({"n_steps": 402}, r"must be in 1..401, got 402"),
        ({"time_step": 0.0}, r"time_step \[s\] of playback '0001' must be > 0"),
        ({"time_step": float("nan")}, "must be > 0, got nan"),
        ({"v": np.zeros((2, 7))}, r"v \[m/s\] of playback '0001' must have shape"),
        ({"distance": np.zeros(7)}, r"distance \[m\] of playback '0001' must have shape"),
        ({"entities": ()}, "needs an entity"),
    ],
)
def test_a_playback_checks_its_shapes(report, change, message):
    with pytest.raises(ValueError, match=message):
        replace(report.kept[0], **change)


def test_a_playback_belongs_to_an_evaluation(report):
    lost = replace(report.kept[0], evaluation=120)
    with pytest.raises(ValueError, match=r"must be in 0..119, got 120"):
        replace(report, kept=(lost,))
