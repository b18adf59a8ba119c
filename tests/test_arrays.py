"""Arrays at the border to compiled code."""

import pytest
from tests.approval import refuses


@pytest.mark.parametrize("values", [[[1.0, float("nan")]], [[1.0, float("inf")]]])
def test_arrays_refuse_what_is_not_finite(values):
    from bridgegen.base.arrays import as_float

    with refuses(ValueError):
        as_float("speed [m/s]", values, (None, 2))
    assert as_float("speed [m/s]", values, (1, 2), finite=False).shape == (1, 2)


def test_arrays_refuse_another_shape():
    from bridgegen.base.arrays import as_float

    with refuses(ValueError):
        as_float("x", [[1, 2], [3, 4]], (None, 3))
