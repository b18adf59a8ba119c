"""The magic formula's own facts."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.simulation.embedded.chassis._tyre_kernels import (
    SMALL,
    lateral,
    lateral_left,
    longitudinal,
    longitudinal_left,
    stiffness_factor,
)
from bridgegen.simulation.embedded.chassis.parameters import CLASSES, Tyre, chassis

CAR = chassis(CLASSES["car"], 2.8, 1.5, 0.6)
TYRE, LOAD = Tyre(), 5.0
MUS = st.floats(0.1, 1.0)


def magic(b, c, d, e, slip):
    """Pacejka, Tyre and Vehicle Dynamics, 2nd ed., equation 4.6."""
    return d * math.sin(c * math.atan(b * slip - e * (b * slip - math.atan(b * slip))))


def side(alpha, mu):
    return lateral(alpha, mu * LOAD, stiffness_factor(12.0, mu, CAR), CAR)


@given(st.floats(-1.5, 1.5), MUS)
def test_the_lateral_force_is_the_magic_formula_s(alpha, mu):
    expected = magic(12.0 / (TYRE.c_y * mu), TYRE.c_y, mu * LOAD, TYRE.e_y, alpha)
    assert side(alpha, mu) == pytest.approx(-expected, rel=2e-6, abs=1e-15)


def test_the_series_joins_the_formula():
    alpha = SMALL / stiffness_factor(12.0, 0.85, CAR)
    below, above = side(alpha * (1.0 - 1e-9), 0.85), side(alpha * (1.0 + 1e-9), 0.85)
    assert above == pytest.approx(below, rel=1e-6)


@given(st.floats(-20.0, 20.0), st.floats(-0.1, 0.1), MUS)
def test_the_slip_gives_the_force_that_is_wanted_or_the_largest_one(wanted, alpha, mu):
    force, kappa = longitudinal(wanted, alpha, LOAD, mu, CAR)
    b = TYRE.k_x / (TYRE.c_x * mu)

    def given_by(kappa):
        pure = magic(b, TYRE.c_x, mu * LOAD, TYRE.e_x, kappa)
        return pure * longitudinal_left(alpha, kappa, CAR)

    assert abs(force) <= mu * LOAD * (1.0 + 1e-12)
    assert force * wanted >= 0.0
    assert given_by(kappa) == pytest.approx(force, rel=0.03, abs=1e-3 * mu * LOAD)
    if abs(force) < abs(wanted):  # control of slip
        best = max(
            (k / 1000.0 for k in range(400)), key=lambda k: magic(b, TYRE.c_x, 1, TYRE.e_x, k)
        )
        assert abs(kappa) == pytest.approx(best, abs=0.002)
    else:
        assert force == wanted


@given(st.floats(-0.5, 0.5), st.floats(-0.2, 0.2))
def test_braking_and_cornering_leave_each_other_less(alpha, kappa):
    assert 0.0 < lateral_left(alpha, kappa, CAR) <= 1.0
    assert 0.0 < longitudinal_left(alpha, kappa, CAR) <= 1.0
    assert lateral_left(alpha, 0.0, CAR) == longitudinal_left(0.0, kappa, CAR) == 1.0


def test_no_load_no_force():
    assert longitudinal(-5.0, 0.0, 0.0, 0.85, CAR) == (0.0, 0.0)
    assert lateral(0.1, 0.0, 10.0, CAR) == 0.0
