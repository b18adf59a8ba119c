from dataclasses import replace

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.pages.data import Column
from bridgegen.pages.playback import Entity, Outline


def test_a_column_of_another_length_is_named(report):
    e = report.evaluations
    short = Column("bv_speed", "m/s", np.zeros(3))
    with refuses(ValueError, "bv_speed", "120"):
        replace(e, parameters=(short,))


def test_a_column_name_may_occur_once(report):
    e = report.evaluations
    with refuses(ValueError, "d_min"):
        replace(e, objectives=(replace(e.objectives[0], name="d_min"),))


@pytest.mark.parametrize("field", ["critical", "status"])
def test_flags_have_one_entry_a_row(report, field):
    with refuses(ValueError, field):
        replace(report.evaluations, **{field: getattr(report.evaluations, field)[1:]})


def test_iterations_ascend(report):
    with refuses(ValueError, "iteration"):
        replace(report.evaluations, iteration=report.evaluations.iteration[::-1])


def test_an_outline_has_a_known_kind_and_finite_points():
    with refuses(ValueError, "grass"):
        Outline("grass", np.zeros((2, 2)))
    with refuses(ValueError):
        Outline("edge", np.zeros((1, 2)))
    with refuses(ValueError):
        Outline("edge", np.array([[0.0, np.nan], [1.0, 1.0]]))


def test_a_box_has_an_extent():
    with refuses(ValueError, "ego"):
        Entity("ego", 0.0, 1.9, 1.4)
    with refuses(ValueError, "ego"):
        Entity("ego", 4.6, 1.9, float("nan"))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"n_steps": 0}, "0001"),
        ({"n_steps": 402}, "402"),
        ({"time_step": 0.0}, "0001"),
        ({"time_step": float("nan")}, "nan"),
        ({"v": np.zeros((2, 7))}, "0001"),
        ({"distance": np.zeros(7)}, "0001"),
        ({"entities": ()}, "entity"),
    ],
)
def test_a_playback_checks_its_shapes(report, change, message):
    with refuses(ValueError, message):
        replace(report.kept[0], **change)


def test_a_playback_belongs_to_an_evaluation(report):
    lost = replace(report.kept[0], evaluation=120)
    with refuses(ValueError, "120"):
        replace(report, kept=(lost,))
