"""What a file says of the weather is what sensors and tyres feel."""

import math

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import UnsupportedError
from bridgegen.drivers import _weather_columns as column
from bridgegen.engine.pipeline import Pipeline
from bridgegen.openx.openscenario.from_owl.signals import TIME
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.embedded.compiler.global_actions import sun_at

from .storyboards import after, crossroads, lane, scenario, simulator, start

EGO = start("ego", lane(1, 1, 90.0), 5.0)


def action(inner: str) -> str:
    return f"""<GlobalAction><EnvironmentAction><Environment name="e">{inner}</Environment>
</EnvironmentAction></GlobalAction>"""


def weather(inner: str) -> str:
    return action(f"<Weather>{inner}</Weather>")


def felt(environment: str, parameters: str = "", **values: list[float]) -> np.ndarray:
    """Return the weather of N rows at their start, ``(N, WEATHER)``."""
    made = simulator(scenario(("ego",), EGO, environment=environment, parameters=parameters))
    n = len(next(iter(values.values()))) if values else 1
    batch = made.batch(made.roads([crossroads()]), np.zeros(n, dtype=np.int64), values)
    batch.start()
    return batch.state.weather


def test_a_file_without_weather_has_a_clear_day():
    assert felt("")[0, : column.STATED].tolist() == list(column.CLEAR_DAY)


def test_the_standard_s_own_elements_are_read():
    found = felt(
        weather(
            """<Sun azimuth="1.5" elevation="0.5" illuminance="40000"/><Fog visualRange="300"/>
<Precipitation precipitationType="rain" precipitationIntensity="12"/>"""
        )
    )[0]
    stated = [found[i] for i in range(column.STATED)]
    assert stated == [300.0, 12.0, 0.0, 1.5, 0.5, 40_000.0, 0.0, 1.0]
    assert found[column.EXTINCTION] == pytest.approx(2.996 / 300 + 3.65e-4 * 12**0.63)


def test_snow_is_no_rain():
    text = '<Precipitation precipitationType="snow" precipitationIntensity="2"/>'
    found = felt(weather(text))[0]
    assert (found[column.RAIN], found[column.SNOW]) == (0.0, 2.0)


@pytest.mark.parametrize(("share", "rate"), [("0.0", 0.0), ("1.0", 50.0), ("0.5", 2.236068)])
def test_a_share_of_rain_is_a_rate(share, rate):
    text = f'<Precipitation precipitationType="rain" intensity="{share}"/>'
    assert felt(weather(text))[0, column.RAIN] == pytest.approx(rate)


def test_a_sun_s_intensity_of_unclear_unit_is_left_aside():
    text = '<Sun azimuth="0" elevation="0.5" intensity="0.85"/>'
    found = felt(weather(text))[0]
    assert found[column.ILLUMINANCE] < 0.0
    assert found[column.BACKGROUND] == pytest.approx(
        0.2 * (100_000 * math.sin(0.5) + 400) / math.pi
    )


@pytest.mark.parametrize(("okta", "share"), [("zero", 0.0), ("three", 0.375), ("nine", 1.0)])
def test_clouds_are_eighths(okta, share):
    found = felt(action(f'<Weather fractionalCloudCover="{okta}Oktas"/>'))
    assert found[0, column.CLOUD] == share


def test_our_files_say_clouds_in_percent():
    declared = '<ParameterDeclaration name="c" parameterType="double" value="37"/>'
    inner = """<Weather fractionalCloudCover="eightOktas"/><RoadCondition
frictionScaleFactor="0.7"><Properties><Property name="cloudiness" value="{}"/></Properties>
</RoadCondition>"""
    assert felt(action(inner.format("61")))[0, column.CLOUD] == 0.61
    assert felt(action(inner.format("much")))[0, column.CLOUD] == 1.0
    found = felt(action(inner.format("$c")), declared, c=[37.0, 80.0])
    assert found[:, column.CLOUD].tolist() == [0.37, 0.8]
    assert (found[:, column.FRICTION] == 0.85 * 9.81 * 0.7).all()


def test_the_last_environment_of_the_start_counts():
    said = """<RoadCondition frictionScaleFactor="0.7"><Properties>
<Property name="cloudiness" value="61"/></Properties></RoadCondition>"""
    classes = action('<Weather fractionalCloudCover="twoOktas"/>')
    first, last = (felt(text)[0] for text in (action(said) + classes, classes + action(said)))
    assert (first[column.CLOUD], last[column.CLOUD]) == (0.25, 0.61)
    assert first[column.FRICTION_SCALE] == last[column.FRICTION_SCALE] == 0.7


def test_rows_vary_the_weather():
    declared = '<ParameterDeclaration name="v" parameterType="double" value="100"/>'
    found = felt(weather('<Fog visualRange="${2*$v}"/>'), declared, v=[50.0, 500.0])
    assert found[:, column.VISUAL_RANGE].tolist() == [100.0, 1000.0]


def test_the_time_of_day_places_a_sun_of_which_nothing_is_said():
    text = '<TimeOfDay animation="false" dateTime="2025-03-20T{}:00"/>'
    night, noon = (felt(action(text.format(time)))[0] for time in ("00:00", "12:00"))
    assert math.degrees(night[column.SUN_ELEVATION]) == pytest.approx(-90.0)
    assert math.degrees(noon[column.SUN_ELEVATION]) == pytest.approx(50.0)
    assert noon[column.SUN_AZIMUTH] == pytest.approx(math.pi)
    sun = '<Weather><Sun azimuth="0" elevation="0.3" illuminance="9"/></Weather>'
    assert felt(action(text.format("00:00") + sun))[0, column.SUN_ELEVATION] == 0.3


@pytest.mark.parametrize("altitude", [-85.0, -20.0, 0.0, 30.0, 49.0])
def test_the_sun_stands_where_our_own_files_say_when_it_does(altitude):
    hours, minutes, seconds = map(int, TIME.text(altitude)[11:].split(":"))
    elevation, _ = sun_at(hours + minutes / 60 + seconds / 3600)
    assert math.degrees(elevation) == pytest.approx(altitude, abs=0.01)


def test_an_event_changes_what_it_states_and_nothing_else():
    fog = weather('<Fog visualRange="60"/>')
    later = f"""<ManeuverGroup name="w" maximumExecutionCount="1">
<Actors selectTriggeringEntities="false"/><Maneuver name="m"><Event name="fog"
priority="override" maximumExecutionCount="1"><Action name="a">{fog}</Action><StartTrigger>
<ConditionGroup>{after(2.0)}</ConditionGroup></StartTrigger></Event></Maneuver></ManeuverGroup>"""
    first = action(
        '<Weather><Fog visualRange="5000"/></Weather><RoadCondition frictionScaleFactor="0.5"/>'
    )
    made = simulator(scenario(("ego",), EGO, later, environment=first))
    batch = made.batch(made.roads([crossroads()]), np.zeros(1, dtype=np.int64), {})
    batch.start()
    ranges = []
    for k in range(60):
        batch.before_driver(k)
        ranges.append(batch.state.weather[0, column.VISUAL_RANGE])
        assert batch.state.weather[0, column.FRICTION] == 0.85 * 9.81 * 0.5
        batch.after_driver(k, np.zeros(1), np.zeros(1))
    assert ranges == [5000.0] * 40 + [60.0] * 20
    assert batch.state.weather[0, column.EXTINCTION] == pytest.approx(2.996 / 60)


def test_fog_in_a_box_is_refused():
    text = """<Fog visualRange="60"><BoundingBox><Center x="0" y="0" z="0"/>
<Dimensions width="1" length="1" height="1"/></BoundingBox></Fog>"""
    with refuses(UnsupportedError, "BoundingBox"):
        felt(weather(text))


def test_a_catalogue_scenario_s_own_numbers_arrive():
    logical = load("crossroads-s4")
    space = logical.space()
    pipeline = Pipeline(logical, space)
    given = {"fog_density": 60.0, "sun_altitude_angle": 12.0, "cloudiness": 45.0}
    given = {name: value for name, value in given.items() if name in space.variables}
    assert given
    x = space.row(given)
    made = pipeline.runner.simulator
    roads = made.roads([pipeline.runner.concrete(x).roads])
    columns = {name: x[i : i + 1] for i, name in enumerate(space.names)}
    batch = made.batch(roads, np.zeros(1, dtype=np.int64), columns)
    batch.start()
    found = batch.state.weather[0]
    values = space.values(x)
    assert found[column.VISUAL_RANGE] == pytest.approx(1e4 * 200 ** (-values["fog_density"] / 100))
    assert math.degrees(found[column.SUN_ELEVATION]) == pytest.approx(values["sun_altitude_angle"])
    assert found[column.CLOUD] == pytest.approx(values["cloudiness"] / 100)
