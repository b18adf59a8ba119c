import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridgegen.drivers import _camera_kernels as camera
from bridgegen.drivers import _lidar_kernels as lidar
from bridgegen.drivers import _weather_columns as column
from bridgegen.drivers._physics_kernels import BEST, CULL, IDENTIFY, veil
from bridgegen.drivers._sight_kernels import LIGHT, REAR, WALKER, camera_sight, lidar_sight, sight
from bridgegen.drivers._weather_kernels import derive

from .scenes import NIGHT, weather

THINGS = st.sampled_from([LIGHT, REAR, WALKER])
SKIES = st.fixed_dictionaries(
    {
        "visual_range": st.floats(20.0, 10_000.0),
        "rain": st.floats(0.0, 50.0),
        "sun_elevation": st.floats(-1.0, 1.5),
        "cloud": st.floats(0.0, 1.0),
    }
)


def seen(numbers, thing: int, off: float = 0.0) -> float:
    """Return the sight at an angle [deg] off the sun's azimuth."""
    heading = math.atan2(numbers[column.SUN_Y], numbers[column.SUN_X]) + math.radians(off)
    return sight(numbers, thing, math.cos(heading), math.sin(heading))


@given(SKIES, st.floats(0.1, 3.0), st.floats(0.0, 10.0), st.floats(0.0, 1000.0))
def test_half_of_the_frames_show_a_target_at_the_limit_of_sight(sky, size, lamp, dazzle):
    numbers = weather(**sky)
    d = camera_sight(numbers, size, lamp, IDENTIFY, dazzle)
    clear = camera.clarity(numbers, d, dazzle, lamp, 1.0)
    p = camera.detection(camera.pixels(size, d, clear)) / BEST
    assert p == pytest.approx(0.5, abs=1e-4) or (d == 1.0 and p < 0.5) or (d > 249 and p > 0.5)
    d = lidar_sight(numbers, size * size, 0.3)
    p = lidar.detection(lidar.returns(size * size, 0.3, numbers[column.ATTENUATION], d)[0]) / BEST
    assert p == pytest.approx(0.5, abs=1e-4) or (d == 1.0 and p < 0.5) or (d > 249 and p > 0.5)


@pytest.mark.parametrize(
    ("thing", "least", "most"), [(LIGHT, 100.0, 180.0), (REAR, 110.0, 200.0), (WALKER, 60.0, 120.0)]
)
def test_on_a_clear_day_one_sees_as_far_as_cameras_of_today(thing, least, most):
    assert least < seen(weather(), thing, 180.0) < most


def test_dark_clothes_are_seen_in_the_low_beam_only():
    """Camera alone, by night: 40 to 60 m, where pedestrian assistants of today brake, too."""
    walker = math.sqrt(0.5 * 1.7)
    assert 40.0 < camera_sight(weather(**NIGHT), walker, 0.0, IDENTIFY, 0.0) < 60.0


@given(SKIES, THINGS, st.tuples(st.floats(20.0, 10_000.0), st.floats(20.0, 10_000.0)))
def test_thicker_fog_shortens_it(sky, thing, ranges):
    thick, thin = (seen(weather(**sky | {"visual_range": one}), thing) for one in sorted(ranges))
    assert thick <= thin <= CULL


@given(SKIES, THINGS, st.tuples(st.floats(0.0, 50.0), st.floats(0.0, 50.0)))
def test_more_rain_shortens_it(sky, thing, rates):
    less, more = (seen(weather(**sky | {"rain": one}), thing) for one in sorted(rates))
    assert more <= less


@given(SKIES, THINGS, st.tuples(st.floats(-1.5, 0.0), st.floats(-1.5, 0.0)))
def test_a_deeper_night_shortens_it(sky, thing, elevations):
    deep, light = (
        seen(weather(**sky | {"sun_elevation": one}), thing) for one in sorted(elevations)
    )
    assert deep <= light


@given(SKIES, THINGS, st.tuples(st.floats(0.0, 180.0), st.floats(0.0, 180.0)))
def test_looking_nearer_to_the_sun_shortens_it(sky, thing, offs):
    numbers = weather(**sky)
    near, far = (seen(numbers, thing, off) for off in sorted(offs))
    assert near <= far * (1.0 + 1e-9)


@settings(max_examples=30)
@given(st.floats(1.0, 64.0))
def test_the_table_is_close_to_what_it_tabulates(off):
    """Between its columns, which are an octave apart, within 8 % of the distance itself."""
    numbers = weather(sun_elevation=0.0, illuminance=9000.0)
    numbers[column.GLARE] = 8000.0
    numbers[column.SIGHT :] = 0.0
    dazzle = veil(8000.0, math.cos(math.radians(off)))
    walker = math.sqrt(0.5 * 1.7)
    exact = max(
        camera_sight(numbers, walker, 0.0, IDENTIFY, dazzle),
        lidar_sight(numbers, walker * walker, 0.1),
    )
    assert seen(numbers, WALKER, off) == pytest.approx(exact, rel=0.08)


def test_a_change_of_weather_is_noticed():
    numbers = weather()
    before = seen(numbers, WALKER)
    numbers[column.VISUAL_RANGE] = 50.0
    derive(numbers)
    assert seen(numbers, WALKER) < 0.5 * before
