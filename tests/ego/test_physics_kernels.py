"""The laws, worked by hand or by their sources."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.drivers import _weather_columns as column
from bridgegen.drivers._physics_kernels import recognised, snr, transmission, veil
from bridgegen.drivers._weather_kernels import skylight, sunbeam

from .scenes import NIGHT, weather


@pytest.mark.parametrize("sight", [50.0, 200.0, 1000.0])
def test_contrast_is_5_percent_at_the_meteorological_optical_range(sight):
    assert transmission(2.996 / sight, sight) == pytest.approx(0.05, rel=1e-3)


@pytest.mark.parametrize(
    ("attenuation", "reach"), [(0.0, 67.0), (2.996 / 200, 38.0), (2.996 / 50, 20.0)]
)
def test_a_dark_target_is_just_seen_by_lidar(attenuation, reach):
    """r_max 200 m at 90 %, target of 10 %: clear, MOR 200 m and MOR 50 m, to half a metre."""
    assert snr(0.1, attenuation, reach - 0.5) > 1.0 > snr(0.1, attenuation, reach + 0.5)


def test_the_rated_target_is_just_seen_at_the_rated_range():
    assert snr(0.9, 0.0, 200.0) == pytest.approx(1.0)


def test_stiles_holladay():
    """10·E/θ²: 1000 lx on the lens at 10° are 100 cd/m², at 2° 2500; within 1° as at 1°."""
    for angle, luminance in ((10.0, 100.0), (2.0, 2500.0), (30.0, 100.0 / 9.0)):
        cosine = math.cos(math.radians(angle))
        assert veil(1000.0 / cosine, cosine) == pytest.approx(luminance)
    assert veil(1000.0, -0.1) == 0.0
    assert veil(1000.0, 1.0) == pytest.approx(10_000.0)


def test_johnson_s_criteria():
    """Half at as many cycles as half need; twice as many are nearly always enough (0.95)."""
    assert recognised(1.0) == 0.5
    assert recognised(2.0) == pytest.approx(2**4.1 / (1 + 2**4.1))
    assert recognised(0.5) == pytest.approx(0.5**3.05 / (1 + 0.5**3.05))
    assert recognised(0.0) == 0.0


@given(st.floats(0.0, 20.0), st.floats(0.0, 20.0))
def test_more_pixels_are_never_worse(a, b):
    low, high = sorted((a, b))
    assert 0.0 <= recognised(low) <= recognised(high) <= 1.0


def test_extinction_of_fog_rain_and_snow():
    """MOR 200 m; 50 mm/h of rain: 3.65e-4·50^0.63 = 4.29e-3; 2 mm/h of dry snow: 14.4 dB/km."""
    assert weather(visual_range=200.0)[column.EXTINCTION] == pytest.approx(0.01498)
    clear = weather()[column.EXTINCTION]
    assert weather(rain=50.0)[column.EXTINCTION] - clear == pytest.approx(4.29e-3, rel=1e-3)
    decibels = 10.0 / math.log(10.0) * 1000.0 * (weather(snow=2.0)[column.EXTINCTION] - clear)
    assert decibels == pytest.approx(5.545 * 2**1.38, rel=1e-3)


def test_the_friction_limit_is_that_of_dry_asphalt_times_the_scale():
    assert weather(friction_scale=0.6)[column.FRICTION] == pytest.approx(0.85 * 9.81 * 0.6)


@pytest.mark.parametrize(("altitude", "lux"), [(90.0, 103_000), (30.0, 84_000), (5.0, 14_700)])
def test_the_sun_s_beam(altitude, lux):
    """127,500 lx · e^(−0.21·m) with air masses of 1, 1.99 and 10.3 (Kasten, Young, table)."""
    assert sunbeam(altitude) == pytest.approx(lux, rel=0.02)


@pytest.mark.parametrize(
    ("altitude", "lux"), [(0.0, 400), (-6.0, 3.4), (-12.0, 0.008), (-18.0, 0.001), (-60.0, 0.001)]
)
def test_twilight(altitude, lux):
    assert skylight(altitude) == pytest.approx(lux)


@given(st.floats(-90.0, 90.0), st.floats(-90.0, 90.0), st.floats(0.0, 1.0))
def test_it_grows_darker_as_the_sun_sinks(a, b, cloud):
    low, high = (
        weather(sun_elevation=math.radians(one), cloud=cloud)[column.BACKGROUND]
        for one in sorted((a, b))
    )
    assert 0.0 < low <= high * (1.0 + 1e-12)


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_clouds_take_light_and_glare(a, b):
    few, many = (weather(cloud=one) for one in sorted((a, b)))
    assert many[column.BACKGROUND] <= few[column.BACKGROUND]
    assert many[column.GLARE] <= few[column.GLARE]


def test_an_overcast_sky_does_not_dazzle_and_leaves_a_quarter_of_the_light():
    clear, overcast = weather(), weather(cloud=1.0)
    assert overcast[column.GLARE] == 0.0
    sky = 0.2 * 400 / math.pi
    assert overcast[column.BACKGROUND] - sky == pytest.approx(
        0.25 * (clear[column.BACKGROUND] - sky)
    )


def test_no_sun_dazzles_at_night():
    assert weather(**NIGHT)[column.GLARE] == 0.0
    assert weather(sun_elevation=math.radians(5.0), illuminance=0.0)[column.GLARE] == 0.0


@pytest.mark.parametrize(
    ("azimuth", "x", "y"), [(0.0, 0.0, 1.0), (90.0, 1.0, 0.0), (180.0, 0.0, -1.0)]
)
def test_azimuth_is_clockwise_from_north(azimuth, x, y):
    numbers = weather(sun_azimuth=math.radians(azimuth), sun_elevation=0.0)
    assert (numbers[column.SUN_X], numbers[column.SUN_Y]) == pytest.approx((x, y), abs=1e-12)
