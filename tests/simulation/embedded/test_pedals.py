"""Pedals, wheel and gear that a storyboard holds: by hand-worked numbers."""

import math

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import UnsupportedError
from bridgegen.base.physics import GRIP
from bridgegen.simulation.embedded.motion._pedal_kernels import PARKED, RATIO

from .storyboards import after, crossroads, events, lane, run, scenario, speeding, start

ENGINE, BRAKES, WHEELBASE, DT = 5.0, 9.0, 2.8, 0.05  # of the vehicles in storyboards.py
EGO = start("ego", lane(3, -1, 20.0), 5.0)
ROADS = crossroads(arm_length=300.0)


def holds(inner: str) -> str:
    return f"""<ControllerAction><OverrideControllerValueAction>{inner}
</OverrideControllerValueAction></ControllerAction>"""


def brake(value: float | str, active: str = "true", rate: str = "", tag: str = "Brake") -> str:
    rate = f' maxRate="{rate}"' if rate else ""
    return holds(f'<{tag} active="{active}"><BrakePercent value="{value}"{rate}/></{tag}>')


def throttle(value: float | str, active: str = "true") -> str:
    return holds(f'<Throttle active="{active}" value="{value}"/>')


def moved(*script: tuple[float, str], speed: float = 10.0, initial: str = "", **kwargs):
    """Return the speeds of a car that the storyboard moves, and the accelerations."""
    rows = [(f"e{k}", "bv", action, after(t)) for k, (t, action) in enumerate(script)]
    bv = start("bv", lane(1, 1, 280.0), speed)
    bv = bv.replace("</Private>", f"<PrivateAction>{initial}</PrivateAction></Private>" if initial
                    else "</Private>")  # fmt: skip
    text = scenario(("ego", "bv"), EGO + bv, events(*rows), **kwargs)
    found = run(text, None, ROADS)
    return found.v[0, 1], found.a[0, 1]


def test_the_brake_slows_by_its_share_and_let_go_of_the_car_rolls_on():
    v, _ = moved((1.0, brake(0.5)), (2.0, brake(0.5, "false")))
    assert v[20] == pytest.approx(10.0)
    assert v[40] == pytest.approx(10.0 - 0.5 * BRAKES)
    assert (v[40:] == v[40]).all()
    v, _ = moved((1.0, brake(1.0)))
    assert v[21] == pytest.approx(10.0 - GRIP * DT)  # the tyres give no more
    assert v[-1] == 0.0


def test_the_throttle_speeds_up_by_its_share():
    v, _ = moved((1.0, throttle(0.4)))
    assert v[60] == pytest.approx(10.0 + 2.0 * 0.4 * ENGINE)


def test_a_script_s_speeds_are_what_the_pedals_make_of_them():
    """It is to speed up by 2 m/s²; its engine is cut off, and comes back."""
    idle = holds('<Clutch active="true" value="1"/>')
    back = holds('<Clutch active="false" value="1"/>')
    faster = speeding(30.0, "linear rate 2")
    v, _ = moved((0.5, idle), (1.0, faster), (2.0, back), (3.0, faster))
    assert (v[:60] == 10.0).all()
    assert v[80] == pytest.approx(12.0)


@pytest.mark.parametrize(
    "gear",
    ['<Gear active="true"><ManualGear number="0"/></Gear>',
     '<Gear active="true"><AutomaticGear gear="n"/></Gear>'],
)  # fmt: skip
def test_without_a_gear_the_throttle_does_nothing(gear):
    v, _ = moved((0.5, holds(gear)), (1.0, throttle(1.0)))
    assert (v == 10.0).all()


def test_the_parking_brake_and_both_brakes():
    v, _ = moved((1.0, brake(1.0, tag="ParkingBrake")))
    assert v[40] == pytest.approx(10.0 - PARKED)
    both = brake(1.0, tag="ParkingBrake"), brake(0.3)
    v, _ = moved((1.0, both[0]), (1.0, both[1]))
    assert v[40] == pytest.approx(10.0 - PARKED - 0.3 * BRAKES)


def test_a_pedal_moves_no_faster_than_its_rate():
    """To 0.6 at 0.5 a second: 1.2 s. The speed is the sum over steps of what holds at their end."""
    v, _ = moved((1.0, brake(0.6, rate="0.5")))
    share = np.minimum(0.5 * DT * np.arange(1, 41), 0.6)
    assert v[21:61] == pytest.approx(10.0 - np.cumsum(share) * BRAKES * DT)


def test_from_the_start_on_and_in_the_way_of_version_1_1():
    v, _ = moved(initial=holds('<Brake active="true" value="0.2"/>'))
    assert v[20] == pytest.approx(10.0 - 0.2 * BRAKES)


def test_rows_vary_them():
    declared = '<ParameterDeclaration name="p" parameterType="double" value="0.5"/>'
    bv = start("bv", lane(1, 1, 280.0), 10.0)
    script = events(("e", "bv", brake("$p"), after(1.0)))
    text = scenario(("ego", "bv"), EGO + bv, script, parameters=declared)
    found = run(text, None, ROADS, p=[0.0, 0.1, 0.4])
    assert found.v[:, 1, 40] == pytest.approx(10.0 - np.array([0.0, 0.1, 0.4]) * BRAKES)


def test_what_is_let_go_of_and_was_never_held_changes_no_bit():
    one, other = moved(), moved((1.0, brake(0.7, "false")), (2.0, throttle(1.0, "false")))
    for a, b in zip(one, other, strict=True):
        np.testing.assert_array_equal(a, b)


def ego(*script: tuple[float, str]):
    rows = [(f"e{k}", "ego", action, after(t)) for k, (t, action) in enumerate(script)]
    text = scenario(("ego",), start("ego", lane(1, 1, 280.0), 10.0), events(*rows))
    return run(text, "route-follower", ROADS)


def test_a_driver_s_pedals_are_held_too():
    found = ego((1.0, brake(0.3)), (2.0, brake(0.3, "false")))
    v = found.v[0, 0]
    assert v[40] - v[20] == pytest.approx(-0.3 * BRAKES)
    assert v[-1] == pytest.approx(10.0, abs=0.2)  # it makes for its speed again


def test_a_driver_s_wheel_turns_the_front_wheels():
    wheel = '<SteeringWheel active="{}" value="0.8"/>'
    found = ego((1.0, holds(wheel.format("true"))), (1.5, holds(wheel.format("false"))))
    h, v = np.unwrap(found.h[0, 0]), found.v[0, 0]
    travelled = 0.5 * (v[20:30] + v[21:31]) * DT
    assert np.diff(h)[20:30] == pytest.approx(travelled * math.tan(0.8 / RATIO) / WHEELBASE)


@pytest.mark.parametrize(
    ("inner", "message"),
    [
        ('<SteeringWheel active="true" value="0.1"/>', "the steering wheel of 'bv', which keeps"),
        ('<Brake active="true"><BrakeForce value="900"/></Brake>', "BrakeForce"),
        ('<Gear active="true"><AutomaticGear gear="r"/></Gear>', "a gear that leads back"),
        ('<Gear active="true" number="-1"/>', "a gear that leads back"),
    ],
)
def test_what_is_not_held_here_is_named_with_its_line(inner, message):
    with refuses(UnsupportedError, message):
        moved((1.0, holds(inner)))
