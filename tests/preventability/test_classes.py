"""The class of a cell, by the outcomes of the driver and of the models."""

import numpy as np
import pytest

from bridgegen.preventability.classes import CellClass, Outcome, classes

A, C, F, N, X = (
    Outcome.AVOIDED, Outcome.COLLIDED, Outcome.FAILED, Outcome.NOT_APPLICABLE, Outcome.NOT_NEEDED,
)  # fmt: skip


@pytest.mark.parametrize(
    ("driver", "models", "expected"),
    [
        (A, (X, X), CellClass.AVOIDED),
        (A, (C, C), CellClass.AVOIDED),
        (C, (A, X), CellClass.PREVENTABLE),
        (C, (C, A), CellClass.PREVENTABLE),
        (C, (F, A), CellClass.PREVENTABLE),
        (C, (C, C), CellClass.UNPREVENTABLE),
        (C, (C, N), CellClass.UNPREVENTABLE),
        (C, (C, F), CellClass.NO_RESULT),  # the one that failed might have avoided it
        (C, (F, F), CellClass.NO_RESULT),
        (C, (N, N), CellClass.NO_RESULT),
        (C, (C, X), CellClass.NO_RESULT),
        (F, (A, A), CellClass.NO_RESULT),
        (N, (A, A), CellClass.NOT_APPLICABLE),
    ],
)
def test_the_class_follows_from_the_outcomes(driver, models, expected):
    found = classes(np.array([driver], np.int8), np.array(models, np.int8)[:, np.newaxis])
    assert found.tolist() == [expected]


def test_every_class_has_a_label_of_its_own():
    assert len({one.label for one in CellClass}) == len(CellClass)
