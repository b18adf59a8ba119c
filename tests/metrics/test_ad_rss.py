"""rss against Intel's ad-rss-lib (PyPI: ``ad-rss``, LGPL-2.1), which is called and not shipped.

Its Python module names its submodules as attributes only. Skipped where it is not installed.
"""

import warnings

import numpy as np
import pytest

from bridgegen.assess.metrics.distances import Parameters, rss
from bridgegen.drivers import preventable

with warnings.catch_warnings():
    warnings.simplefilter("ignore")  # a converter that is registered twice
    ad_rss = pytest.importorskip("ad_rss")
physics = ad_rss.physics
core, structured, world = ad_rss.rss.core, ad_rss.rss.structured, ad_rss.rss.world
P = Parameters()


def filled(of):
    """Set every number of a structure to one that is valid; the library refuses NaN."""
    for name in dir(of):
        value = getattr(of, name)
        if name.startswith("_") or callable(value):
            continue
        if hasattr(value, "cMaxValue"):
            setattr(of, name, type(value)(1.0))
        elif isinstance(value, int) and not isinstance(value, bool) and name.endswith("_steps"):
            setattr(of, name, 1)
        elif type(value).__module__ in ("physics", "world", "core"):
            filled(value)


def state(v, response, sideways=0.0, p=P):
    """A participant with the assumptions of a metric's parameters."""
    made = core.RelativeObjectState()
    filled(made.dynamics)
    filled(made.unstructured_object_state)
    made.object_type = world.ObjectType.OtherVehicle
    d, m = made.dynamics, made.structured_object_state
    d.alpha_lon.accel_max = physics.Acceleration(p.accel_max)
    d.alpha_lon.brake_max = physics.Acceleration(-p.brake_max)
    d.alpha_lon.brake_min = physics.Acceleration(-p.brake_min)
    d.alpha_lon.brake_min_correct = physics.Acceleration(-p.brake_min)
    d.alpha_lat.accel_max = physics.Acceleration(p.lateral_accel_max)
    d.alpha_lat.brake_min = physics.Acceleration(-p.lateral_brake_min)
    d.lateral_fluctuation_margin = physics.Distance(p.lateral_margin)
    d.min_longitudinal_safety_distance = physics.Distance(0.0)
    d.max_speed_on_acceleration = physics.Speed(100.0)
    d.response_time = physics.Duration(response)
    m.velocity.speed_lon_min = m.velocity.speed_lon_max = physics.Speed(v)
    m.velocity.speed_lat_min = m.velocity.speed_lat_max = physics.Speed(sideways)
    m.is_in_correct_lane, m.has_priority = True, False
    m.distance_to_enter_intersection = physics.Distance(0.0)
    m.distance_to_leave_intersection = physics.Distance(1000.0)
    return made


def safe(kind, *states):
    """The safe distance that the library gives [m]."""
    found = physics.Distance(0.0)
    assert getattr(structured, f"calculateSafe{kind}")(*states, found)
    return found.Distance if hasattr(found, "Distance") else float(str(found))


def two(rollout_of, x=0.0, y=0.0, h=0.0, v=0.0, ego=10.0):
    """Boxes are 4 m by 2 m; the ego drives along +x."""
    return rollout_of(x=[[[0.0], [x]]], y=[[[0.0], [y]]], h=[[[0.0], [h]]], v=[[[ego], [v]]])


SPEEDS = [(20.0, 12.0), (30.0, 30.0), (8.0, 0.0), (13.9, 20.0)]


@pytest.mark.parametrize(("ego", "v"), SPEEDS)
def test_following_another(rollout_of, ego, v):
    least = safe("LongitudinalDistanceSameDirection", state(v, 2.0), state(ego, 1.0))
    found = rss(two(rollout_of, x=4.0 + 0.5 * least, v=v, ego=ego))
    assert found == pytest.approx([0.5], abs=1e-5)


@pytest.mark.parametrize(("ego", "v"), SPEEDS)
def test_oncoming(rollout_of, ego, v):
    least = safe("LongitudinalDistanceOppositeDirection", state(ego, 1.0), state(v, 2.0))
    found = rss(two(rollout_of, x=4.0 + 0.5 * least, h=np.pi, v=v, ego=ego))
    assert found == pytest.approx([0.5], abs=1e-5)


def test_side_by_side(rollout_of):
    least = safe("LateralDistance", state(10.0, 1.0), state(10.0, 2.0))
    found = rss(two(rollout_of, y=2.0 + 0.25 * least, v=10.0))
    assert found == pytest.approx([0.75], abs=1e-5)


@pytest.mark.parametrize(("ego", "v", "inward"), [(20.0, 10.0, 1.0), (33.0, 20.0, 0.4)])
def test_the_model_of_unece_s_comparison_brakes_where_the_library_says_so(ego, v, inward):
    """computed:rss, whose distances are those of the Commission's code."""
    p = Parameters(
        accel_max=preventable.RSS_ACCELERATION, brake_min=preventable.RSS_BRAKING,
        brake_max=preventable.RSS_BRAKING, lateral_accel_max=preventable.RSS_LATERAL,
        lateral_brake_min=preventable.RSS_LATERAL, lateral_margin=preventable.RSS_MARGIN,
    )  # fmt: skip
    along = safe("LongitudinalDistanceSameDirection", state(v, 0.75, p=p), state(ego, 0.75, p=p))
    place = preventable._Place
    for gap, expected in ((along - 0.01, True), (along + 0.01, False)):
        other = place(np.array([gap]), np.array([0.5]), np.array([v]), np.array([inward]))
        risk = preventable._rss_risk(np.array([ego]), np.array([gap + 4.0]), np.array([gap]), other)
        assert risk[0] == expected
