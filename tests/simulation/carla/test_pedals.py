"""From demands to pedals."""

import math

import carla
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.adapters.carla import frame
from bridgegen.adapters.carla.pedals import Car, Pedals
from bridgegen.adapters.carla.settings import TIME_STEP

from .stand_in_actors import blueprints


class Alone:
    """A vehicle of the stand-in without a server."""

    def __init__(self, model="vehicle.lincoln.mkz_2017", v=10.0, friction=3.5):
        (blueprint,) = [one for one in blueprints() if one.id == model]
        self.actors = {0: None}
        self.car = blueprint.make(self, carla.Transform(), None)
        self.actors = {0: self.car}
        self.car.velocity = carla.Vector3D(x=v)
        self.car.friction = [friction] * 4
        self.pedals = Pedals(Car.of(self.car.get_physics_control()), v)

    def rpc(self, name):
        """There is no server."""

    def drive(self, acceleration, curvature, seconds):
        """Return ``(n, 2)``: speed, and curvature of the way at each step."""
        told = []
        for _ in range(round(seconds / TIME_STEP)):
            v, yaw = self.speed, self.car.transform.rotation.yaw
            self.car.apply_control(self.pedals.control(acceleration, curvature, v))
            self.car.step(TIME_STEP)
            turned = -math.radians(self.car.transform.rotation.yaw - yaw)
            told.append((self.speed, turned / max(0.5 * (v + self.speed) * TIME_STEP, 1e-9)))
        return np.array(told)

    @property
    def speed(self):
        return math.hypot(self.car.velocity.x, self.car.velocity.y)


@pytest.mark.parametrize("acceleration", [-6.0, -3.0, -1.0, 0.0, 1.0, 2.0])
@pytest.mark.parametrize("model", ["vehicle.lincoln.mkz_2017", "vehicle.carlamotors.carlacola"])
def test_the_car_does_what_is_demanded(acceleration, model):
    """After half a second, within 0.5 m/s of the speed that the demands come to, for two."""
    alone = Alone(model, v=15.0)
    speed = alone.drive(acceleration, 0.0, 2.0)[:, 0]
    meant = np.maximum(15.0 + acceleration * TIME_STEP * np.arange(1, 41), 0.0)
    assert np.abs(speed - meant)[10:].max() < 0.5
    assert np.abs(speed - meant)[-1] < 0.35


@pytest.mark.parametrize("curvature", [-0.1, -0.02, 0.01, 0.05, 0.12])
def test_the_way_bends_as_is_demanded(curvature):
    """After 0.6 s, within 6 %: the origin is not the rear axle, and steering takes its time."""
    alone = Alone(v=5.0)
    bent = alone.drive(0.0, curvature, 2.0)[:, 1]
    np.testing.assert_allclose(bent[12:], curvature, rtol=0.06)


def test_without_grip_it_does_not_make_up_for_it_afterwards():
    """On ice, braking is demanded for 2 s; then the demand ends, and it soon does, too."""
    alone = Alone(v=20.0, friction=0.35)
    alone.drive(-8.0, 0.0, 2.0)
    slow = alone.speed
    assert slow > 17.0
    alone.car.friction = [3.5] * 4
    assert alone.drive(0.0, 0.0, 3.0)[-1, 0] > slow - 2.0


def test_it_stands_where_it_stands():
    alone = Alone(v=3.0)
    alone.drive(-4.0, 0.0, 2.0)
    where = alone.car.transform.location.x
    alone.drive(0.0, 0.0, 3.0)
    assert alone.speed == 0.0
    assert alone.car.transform.location.x == pytest.approx(where)
    alone.drive(1.5, 0.0, 2.0)
    assert 2.0 < alone.speed < 3.5


@given(
    a=st.lists(st.floats(-20.0, 20.0), min_size=2, max_size=20),
    c=st.lists(st.floats(-1.0, 1.0), min_size=20, max_size=20),
    v=st.floats(0.0, 60.0),
)
def test_controls_are_in_their_ranges_and_never_jump(a, c, v):
    pedals = Pedals(Car(2.8, 0.6, ((0.0, 1.0), (100.0, 0.5))), v)
    last = carla.VehicleControl()
    for acceleration, curvature in zip(a, c, strict=False):
        now = pedals.control(acceleration, curvature, v)
        assert 0.0 <= now.throttle <= 1.0
        assert 0.0 <= now.brake <= 1.0
        assert now.throttle == 0.0 or now.brake == 0.0
        assert -1.0 <= now.steer <= 1.0
        assert abs(now.steer - last.steer) <= 2.5 * TIME_STEP + 1e-6
        if not (acceleration <= 0.0 and v < 0.1):  # it is held
            pressed = (now.throttle - now.brake) - (last.throttle - last.brake)
            assert abs(pressed) <= 8.0 * TIME_STEP + 1e-6
        last = now


def test_left_of_ours_is_left_of_carlas():
    pedals = Pedals(Car(2.8, 0.6), 5.0)
    assert pedals.control(0.0, 0.1, 5.0).steer < 0.0
    assert frame.steering(0.5) == -0.5
