"""Arrays at the border to compiled code."""

import pytest


@pytest.mark.parametrize("values", [[[1.0, float("nan")]], [[1.0, float("inf")]]])
def test_arrays_refuse_what_is_not_finite(values):
    from bridgegen.base.arrays import as_float

    with pytest.raises(
        ValueError, match=r"speed \[m/s\] must be finite, got (nan|inf) at \[0, 1\]"
    ):
        as_float("speed [m/s]", values, (None, 2))
    assert as_float("speed [m/s]", values, (1, 2), finite=False).shape == (1, 2)


def test_arrays_refuse_another_shape():
    from bridgegen.base.arrays import as_float

    with pytest.raises(ValueError, match=r"x must have shape \(·, 3\), got \(2, 2\)"):
        as_float("x", [[1, 2], [3, 4]], (None, 3))
