"""Gravity along roads that rise, fall and bank: by hand-worked numbers, and by laws."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.base.physics import GRAVITY, GRIP
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.plan_view import Cubic
from bridgegen.openx.opendrive.routes import plan_route
from bridgegen.simulation.embedded._motion_kernels import SLOW, bicycle
from bridgegen.simulation.embedded.places.slopes import LEVEL, slopes

from .storyboards import (
    crossroads,
    events,
    friction,
    lane,
    run,
    scenario,
    simulator,
    speeding,
    start,
)

SPEED = 10.0
INWARDS, OUTWARDS = 1, -1  # lanes of the arms, whose roads begin at the junction
ENGINE, BRAKES = 5.0, 9.0  # of the vehicles in storyboards.py
GRADE, BANK = 0.06, 0.05
RISE = math.atan(GRADE)


def sloped(grade: float = 0.0, bank: float = 0.0, height: float = 0.0) -> OpenDrive:
    """Return the crossroads with all roads rising and banked along their reference lines."""
    level = crossroads()
    up = (Cubic(0.0, height, grade, 0.0, 0.0),)
    side = (Cubic(0.0, bank, 0.0, 0.0, 0.0),) if bank else ()
    roads = [replace(road, elevations=up, superelevations=side) for road in level.roads]
    return replace(level, roads=tuple(roads))


def step(
    roads: OpenDrive, demanded: float, curvature: float = 0.0, way: int = INWARDS,
    speed: float = SPEED,
) -> tuple[float, float]:  # fmt: skip
    """Return acceleration [m/s²] and curvature [1/m] of the ego's first step on the arm."""
    made = simulator(scenario(("ego",), start("ego", lane(1, way, 50.0), speed)))
    batch = made.batch(made.roads([roads]), np.zeros(1, dtype=np.int64), {})
    batch.start()
    batch.before_driver(0)
    batch.after_driver(0, np.array([demanded]), np.array([curvature]))
    record, dt = batch.record, made.program.time_step
    h, v = record.h[0, 0], record.v[0, 0]
    travelled = 0.5 * (v[0] + v[1]) * dt
    bend = math.remainder(h[1] - h[0], math.tau) / travelled if travelled else 0.0
    return float(record.a[0, 0, 0]), bend


@pytest.mark.parametrize(("way", "climbs"), [(OUTWARDS, 1.0), (INWARDS, -1.0)])
def test_downhill_a_vehicle_brakes_less_and_uphill_it_speeds_up_less(way, climbs):
    pull = climbs * GRAVITY * math.sin(RISE)
    brakes, _ = step(sloped(GRADE), -20.0, way=way)
    assert brakes == pytest.approx(-GRIP * math.cos(RISE) - pull)
    speeds_up, _ = step(sloped(GRADE), 20.0, way=way)
    assert speeds_up == pytest.approx(ENGINE - pull)


def test_what_a_driver_asks_for_it_gets_within_the_limits():
    assert step(sloped(GRADE), -3.0)[0] == pytest.approx(-3.0)
    assert step(sloped(-GRADE), 2.0)[0] == pytest.approx(2.0)


def test_a_bend_that_is_banked_inwards_can_be_driven_faster():
    """Along the road a positive superelevation falls to the right."""
    v, weight = 20.0, GRIP * math.cos(BANK)
    sideways = GRAVITY * math.sin(BANK)
    for way, falls_right in ((OUTWARDS, 1.0), (INWARDS, -1.0)):
        _, left = step(sloped(bank=BANK), 0.0, 0.1, way, v)
        _, right = step(sloped(bank=BANK), 0.0, -0.1, way, v)
        assert left * v * v == pytest.approx(weight - falls_right * sideways)
        assert right * v * v == pytest.approx(-weight - falls_right * sideways)


def test_a_vehicle_stands_on_a_hill_as_long_as_its_tyres_hold():
    assert step(sloped(GRADE), 0.0, speed=0.0) == (0.0, 0.0)
    assert step(sloped(1.0), 0.0, speed=0.0)[0] == pytest.approx(
        GRAVITY * math.sin(math.pi / 4) - GRIP * math.cos(math.pi / 4)
    )


def test_height_alone_changes_no_bit():
    text = scenario(("ego", "bv"), start("ego", lane(1, INWARDS, 90.0), 8.0)
                    + start("bv", lane(1, INWARDS, 60.0), 6.0),
                    events(("e", "bv", speeding(0.0, "linear rate 4"), STANDS)))  # fmt: skip
    one, other = run(text), run(text, roads=sloped(height=120.0))
    for field in ("x", "y", "h", "v", "a"):
        np.testing.assert_array_equal(getattr(one, field), getattr(other, field))
    third = run(text, roads=sloped(-0.12))
    assert np.abs(one.x[0, 0] - third.x[0, 0]).max() < 1.0  # a driver that copes with both


STANDS = """<Condition name="c" delay="0" conditionEdge="none"><ByValueCondition>
<SimulationTimeCondition value="1" rule="greaterOrEqual"/></ByValueCondition></Condition>"""


@pytest.mark.parametrize(("way", "climbs"), [(OUTWARDS, 1.0), (INWARDS, -1.0)])
def test_the_grade_is_the_derivative_of_the_height(way, climbs):
    cubics = (Cubic(0.0, 5.0, 0.02, 1e-3, -1e-5), Cubic(60.0, 9.0, 0.03, 0.0, 0.0))
    level = crossroads()
    roads = [replace(road, elevations=cubics) if road.id == "1" else road for road in level.roads]
    model = replace(level, roads=tuple(roads))
    ends = (("1", way, 0.0), ("1", way, 100.0))
    route = plan_route(model, ends[way > 0], [], ends[way < 0])
    found = slopes(model, route, 0.5, 201)
    s = np.arange(201) * 0.5
    s = s if climbs > 0 else 100.0 - s
    rise = np.where(s < 60.0, 0.02 + 2e-3 * s - 3e-5 * s * s, 0.03)
    np.testing.assert_allclose(
        found[s != 60.0, 0], climbs * GRAVITY * np.sin(np.arctan(rise))[s != 60.0]
    )
    np.testing.assert_allclose((1.0 - found[s != 60.0, 2]), np.cos(np.arctan(rise))[s != 60.0])
    assert slopes(level, route, 0.5, 201) is LEVEL


def test_attentive_drivers_brake_within_what_a_wet_road_gives():
    """Straight at a standing car, too late: downhill less than uphill."""
    names, stands = ("ego", "bv"), start("ego", lane(1, INWARDS, 50.0), 0.0)
    privates = stands + start("bv", lane(1, INWARDS, 80.0), 25.0)
    text = scenario(names, privates, environment=friction(0.5))
    for grade in (0.0, GRADE, -GRADE):  # they drive against the road's direction
        found = run(text, None, sloped(grade), others="attentive")
        angle = math.atan(grade)
        gives = 0.5 * GRIP * math.cos(angle) - GRAVITY * math.sin(angle)
        assert found.a[0, 1].min() == pytest.approx(-gives)


limits = np.array([60.0, ENGINE, BRAKES, 0.2])
numbers = st.floats(-20.0, 20.0)


@given(numbers, st.floats(-0.3, 0.3), st.floats(SLOW, 40.0), st.floats(-2.0, 2.0),
       st.floats(-2.0, 2.0), st.floats(2.5, 9.0))  # fmt: skip
def test_tyres_never_give_more_than_they_can(demanded, curvature, v, uphill, aside, grip):
    dt = 1e-3  # so that neither standstill nor the fastest speed cuts it
    _, _, h, end, a = bicycle(
        0.0, 0.0, 0.0, v, demanded, curvature, limits, grip, uphill, aside, dt
    )
    bend = h / (0.5 * (v + end) * dt)
    if abs(bend) < limits[3] * (1.0 - 1e-9):
        assert math.hypot(a + uphill, v * v * bend + aside) <= grip * (1.0 + 1e-6) + 1e-6
    assert abs(bend) <= limits[3] * (1.0 + 1e-9)
