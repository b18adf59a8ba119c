"""The weather says what ScenarioRunner's mapping makes CARLA's of."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import UnsupportedError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.scenario_runner.environment import (
    CLEAR,
    carla_fields,
    environment,
)

percent = st.floats(0.0, 100.0)


def road(**properties):
    held = tuple(osc.Property(name, str(value)) for name, value in properties.items())
    return osc.RoadCondition(0.7, osc.Wetness.MOIST, osc.Properties(held))


def rain(**intensity):
    return osc.Precipitation(osc.PrecipitationType.RAIN, **intensity)


@given(percent, percent, st.floats(-180.0, 180.0))
def test_our_originals_come_out_of_their_mapping(cloudiness, precipitation, azimuth):
    """Their mapping, as their parser has it: see the module's docstring."""
    new = osc.Environment(
        "e",
        osc.TimeOfDay(True, "2025-03-20T07:47:54.250+01:00"),
        osc.Weather(
            fractional_cloud_cover=osc.FractionalCloudCover.ONE,
            sun=osc.Sun(azimuth=1.0, elevation=0.5, illuminance=20000.0),
            fog=osc.Fog(300.0),
            precipitation=rain(precipitation_intensity=3.0),
            wind=osc.Wind(0.0, 3.0),
        ),
        road(cloudiness=cloudiness, precipitation=precipitation, sun_azimuth_angle=azimuth),
    )
    made = environment(new, CLEAR)
    assert 100.0 - made.weather.sun.intensity * 100.0 == pytest.approx(cloudiness)
    assert (made.weather.sun.azimuth, made.weather.sun.elevation) == (1.0, 0.5)
    falls = made.weather.precipitation
    assert falls.intensity * 100.0 == pytest.approx(precipitation)
    assert (falls.precipitation_type is osc.PrecipitationType.RAIN) == (falls.intensity > 0.0)
    assert falls.precipitation_intensity is None
    assert made.weather.fog == osc.Fog(300.0)
    assert made.time_of_day == osc.TimeOfDay(False, "2025-03-20T07:47:54")
    assert made.road_condition.friction_scale_factor == 0.7
    assert made.road_condition.wetness is None
    fields = carla_fields(made)
    assert (fields["cloudiness"], fields["precipitation"]) == (cloudiness, precipitation)
    assert 0.0 <= fields["sun_azimuth_angle"] <= 360.0
    assert math.isclose(
        math.remainder(fields["sun_azimuth_angle"] - azimuth, 360.0), 0.0, abs_tol=1e-9
    )


@pytest.mark.parametrize(
    ("weather", "cloudiness", "state"),
    [
        (osc.Weather(fractional_cloud_cover=osc.FractionalCloudCover.TWO), 25.0, "cloudy"),
        (osc.Weather(fractional_cloud_cover=osc.FractionalCloudCover.NINE), 100.0, "overcast"),
        (osc.Weather(cloud_state=osc.CloudState.CLOUDY), 50.0, "cloudy"),
        (osc.Weather(cloud_state=osc.CloudState.OVERCAST), 100.0, "overcast"),
        (osc.Weather(), 0.0, "free"),
    ],
)
def test_clouds_of_other_people_s_files(weather, cloudiness, state):
    made = environment(osc.Environment("e", weather=weather), CLEAR).weather
    assert 100.0 - made.sun.intensity * 100.0 == pytest.approx(cloudiness)
    assert made.cloud_state == state


def test_rain_of_other_people_s_files():
    def share(precipitation):
        weather = osc.Weather(precipitation=precipitation)
        return environment(osc.Environment("e", weather=weather), CLEAR).weather.precipitation

    assert share(rain(precipitation_intensity=50.0)).intensity == pytest.approx(1.0)
    assert share(rain(precipitation_intensity=0.1 * 500**0.25)).intensity == pytest.approx(0.25)
    assert share(rain(intensity=0.4)).intensity == 0.4  # 1.0's own
    dry = osc.Precipitation(osc.PrecipitationType.DRY, intensity=0.0)
    assert share(rain(precipitation_intensity=0.0)) == dry
    with refuses(UnsupportedError):
        share(osc.Precipitation(osc.PrecipitationType.SNOW, precipitation_intensity=2.0))


def test_a_change_leaves_the_rest_as_it_was_and_all_parts_there():
    fog = osc.Weather(fog=osc.Fog(80.0))
    foggy = environment(osc.Environment("fog", weather=fog), CLEAR)
    assert foggy.weather.fog == osc.Fog(80.0)
    assert foggy.weather.sun == CLEAR.weather.sun
    ice = osc.Environment("ice", road_condition=osc.RoadCondition(0.2))
    icy = environment(ice, foggy)
    assert icy.weather == foggy.weather
    assert icy.time_of_day == CLEAR.time_of_day
    assert icy.road_condition == osc.RoadCondition(0.2)


def test_somebody_else_s_properties_are_no_fields():
    made = environment(osc.Environment("e", road_condition=road(cloudiness="much", x=1)), CLEAR)
    assert carla_fields(made) == {}
