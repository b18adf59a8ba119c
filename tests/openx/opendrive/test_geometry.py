"""Reference lines against hand-worked values, Fresnel's functions, and plain summation."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import fresnel

from bridgegen.openx.opendrive.geometry import (
    Curve,
    evaluate,
    pose,
    reference_line,
    reference_pose,
)
from bridgegen.openx.opendrive.model import Lane, LaneSection, Road
from bridgegen.openx.opendrive.plan_view import (
    Arc,
    Geometry,
    Line,
    ParamPoly3,
    Poly3,
    Spiral,
)

CURVATURE = st.floats(-0.2, 0.2)


def geometry(
    shape: object, length: float, x: float = 0.0, y: float = 0.0, h: float = 0.0
) -> Geometry:
    return Geometry(0.0, x, y, h, length, shape)  # type: ignore[arg-type]


def check_derivatives(one: Geometry, tolerance: float = 1e-5) -> Curve:
    """x, y, h, curvature and its rate are derivatives of each other along the line."""
    u, step = np.linspace(0.0, one.length, 4001, retstep=True)
    curve = evaluate(one, u)
    inside = slice(1, -1)

    def slope(values: np.ndarray) -> np.ndarray:
        return (values[2:] - values[:-2]) / (2 * step)

    np.testing.assert_allclose(slope(curve.x), np.cos(curve.h)[inside], atol=tolerance)
    np.testing.assert_allclose(slope(curve.y), np.sin(curve.h)[inside], atol=tolerance)
    np.testing.assert_allclose(slope(curve.h), curve.curvature[inside], atol=tolerance)
    np.testing.assert_allclose(
        slope(curve.curvature), curve.curvature_rate[inside], atol=10 * tolerance
    )
    return curve


def test_line_by_hand() -> None:
    at = pose(geometry(Line(), 10.0, 1.0, 2.0, math.pi / 6), 4.0)
    assert at == pytest.approx((1.0 + 2.0 * math.sqrt(3.0), 4.0, math.pi / 6, 0.0))


def test_quarter_circle_by_hand() -> None:
    # Radius 8 to the right, starting northwards from (8, 0): the centre is (16, 0).
    at = pose(geometry(Arc(-1 / 8), 20.0, 8.0, 0.0, math.pi / 2), 4 * math.pi)
    assert at == pytest.approx((16.0, 8.0, 0.0, -1 / 8), abs=1e-12)


@given(k0=CURVATURE, k1=CURVATURE, length=st.floats(0.5, 150.0))
def test_spiral_against_fresnel(k0: float, k1: float, length: float) -> None:
    rate = (k1 - k0) / length
    if abs(rate) < 1e-6:  # where Fresnel's functions lose all digits
        return
    u = np.linspace(0.0, length, 50)
    curve = evaluate(geometry(Spiral(k0, k1), length), u)
    # Heading k0·u + rate·u²/2 completes to a square: the curve is a piece of Euler's spiral.
    scale = math.sqrt(math.pi / abs(rate))
    turn, start = math.copysign(1.0, rate), k0 / rate
    sin, cos = fresnel((u + start) / scale)
    sin0, cos0 = fresnel(start / scale)
    c, s = scale * (cos - cos0), turn * scale * (sin - sin0)
    back = -0.5 * k0 * start
    x = c * math.cos(back) - s * math.sin(back)
    y = c * math.sin(back) + s * math.cos(back)
    # Cancellation between the two Fresnel values limits this comparison, not ours.
    tolerance = 1e-12 * (length + scale + abs(start)) + 1e-13 * abs(back) * length
    np.testing.assert_allclose(curve.x, x, atol=max(tolerance, 1e-10))
    np.testing.assert_allclose(curve.y, y, atol=max(tolerance, 1e-10))


@given(curvature=CURVATURE, length=st.floats(0.5, 100.0))
def test_spiral_of_equal_curvatures_is_an_arc(curvature: float, length: float) -> None:
    u = np.linspace(0.0, length, 20)
    spiral = evaluate(geometry(Spiral(curvature, curvature), length, 3.0, -2.0, 1.0), u)
    arc = evaluate(geometry(Arc(curvature), length, 3.0, -2.0, 1.0), u)
    for a, b in zip(spiral, arc, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-11)


@pytest.mark.parametrize(
    "one",
    [
        geometry(Arc(0.05), 40.0, 1.0, 2.0, 3.0),
        geometry(Spiral(0.0, 0.1), 30.0, 1.0, 2.0, -3.0),
        geometry(Spiral(0.1, -0.05), 50.0),
        geometry(Poly3(1.0, 0.2, -0.01, 2e-4), 40.0, 5.0, 5.0, 2.0),
        geometry(ParamPoly3(0, 30, 2, -4, 0, 0, 9, -3, "normalized"), 30.0, h=1.0),
        geometry(ParamPoly3(0, 30, 0, -2.7, 0, 0, 4.5, 2.7, "arcLength"), 30.0, h=-2.0),
    ],
    ids=lambda one: type(one.shape).__name__,
)
def test_derivatives_fit(one: Geometry) -> None:
    if isinstance(one.shape, ParamPoly3):
        one = with_its_length(one)
    curve = check_derivatives(one)
    for index in (0, 1000, 4000):
        at = pose(one, float(np.linspace(0.0, one.length, 4001)[index]))
        assert at == pytest.approx([column[index] for column in curve[:4]], abs=1e-12)


def with_its_length(one: Geometry) -> Geometry:
    """Give a paramPoly3 over [0, 1] its true length, and the range that it asks for."""
    shape = one.shape
    assert isinstance(shape, ParamPoly3)
    u = (shape.a_u, shape.b_u, shape.c_u, shape.d_u)
    v = (shape.a_v, shape.b_v, shape.c_v, shape.d_v)
    p = np.linspace(0.0, 1.0, 200_001)
    x, y = (np.polynomial.polynomial.polyval(p, poly) for poly in (u, v))
    length = float(np.hypot(np.diff(x), np.diff(y)).sum())
    scale = 1.0 if shape.p_range == "normalized" else 1.0 / length
    coefficients = [c * scale**k for poly in (u, v) for k, c in enumerate(poly)]
    shape = ParamPoly3(*coefficients, shape.p_range)
    return geometry(shape, length, one.x, one.y, one.hdg)


def test_poly3_is_followed_by_arc_length() -> None:
    shape = Poly3(0.0, 0.0, 0.02, -1e-4)
    u = np.linspace(0.0, 25.0, 200_001)
    v = shape.c * u**2 + shape.d * u**3
    travelled = np.concatenate(([0.0], np.hypot(np.diff(u), np.diff(v)).cumsum()))
    s = np.linspace(0.0, 20.0, 41)
    curve = evaluate(geometry(shape, 20.0), s)
    np.testing.assert_allclose(curve.x, np.interp(s, travelled, u), atol=1e-6)
    np.testing.assert_allclose(curve.y, np.interp(s, travelled, v), atol=1e-6)


@pytest.mark.parametrize("p_range", ["normalized", "arcLength"])
def test_param_poly3_is_the_same_curve_in_both_ranges(p_range: str) -> None:
    length = 20.0
    u, v = (0.0, 19.0, 3.0, -3.0), (0.0, 0.0, 6.0, -2.0)
    scale = 1.0 if p_range == "normalized" else 1.0 / length
    coefficients = [c * scale**k for poly in (u, v) for k, c in enumerate(poly)]
    curve = evaluate(geometry(ParamPoly3(*coefficients, p_range), length), np.array([0.0, length]))
    # u(1) = 19, v(1) = 4; its direction there is (19 + 6 - 9, 12 - 6) = (16, 6).
    assert (curve.x[-1], curve.y[-1]) == pytest.approx((19.0, 4.0))
    assert curve.h[-1] == pytest.approx(math.atan2(6.0, 16.0))


def road(*plan_view: Geometry) -> Road:
    section = LaneSection(0.0, center=(Lane(0),), right=(Lane(-1, "driving"),))
    length = sum(one.length for one in plan_view)
    return Road("1", length, plan_view=plan_view, sections=(section,))


def test_the_geometry_that_holds_at_s() -> None:
    first = Geometry(0.0, 0.0, 0.0, 0.0, 10.0, Line())
    second = Geometry(10.0, 10.0, 0.0, 0.0, 5 * math.pi, Arc(0.1))
    bend = road(first, second)
    assert reference_pose(bend, 4.0)[:2] == (4.0, 0.0)
    assert reference_pose(bend, bend.length) == pytest.approx((20.0, 10.0, math.pi / 2, 0.1))
    s = np.array([12.0, 4.0, 10.0, 0.0, bend.length])  # in any order
    line = reference_line(bend, s)
    for index, one in enumerate(s):
        at = reference_pose(bend, float(one))
        assert at == pytest.approx([column[index] for column in line[:4]], abs=1e-12)


def test_many_points_on_a_long_spiral() -> None:
    """The blocks that bound the memory leave no seams."""
    one = geometry(Spiral(-0.02, 0.02), 1000.0)
    u = np.linspace(0.0, 1000.0, 5001)
    whole = evaluate(one, u)
    single = [pose(one, float(each)) for each in u[::500]]
    np.testing.assert_allclose(np.array(single)[:, :2], np.c_[whole.x, whole.y][::500], atol=1e-9)
