"""The ontology's weather, and other files', as CARLA's."""

import carla
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.adapters.carla.weather import Weather, clamped, of_quantities
from bridgegen.drivers import get
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import walk
from bridgegen.openx.openscenario.read import read
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.weather import CARLA_FIELDS
from bridgegen.simulation.choice import SimulatorChoice

from ..embedded.storyboards import crossroads, lane, scenario, start
from ..embedded.test_weathers import raining, weather_event

FIELDS = [name for name in dir(carla.WeatherParameters()) if name in CARLA_FIELDS]
FROM_ONTOLOGY = (
    "cloudiness", "precipitation", "precipitation_deposits", "wind_intensity", "fog_density",
    "fog_distance", "fog_falloff", "wetness", "sun_altitude_angle", "sun_azimuth_angle",
)  # fmt: skip


@pytest.fixture(scope="module")
def pipeline():
    logical = load("crossroads-s4")
    return Pipeline(logical, logical.space(), PipelineOptions(ego="route-follower"))


def sky_of(pipeline, values, storyboard=None):
    joint = pipeline.runner.simulator.co_simulation(
        pipeline.runner.roads_of(row(pipeline))[0], 0, values
    )
    joint.decide(0)
    storyboard = storyboard or pipeline.runner.concrete(row(pipeline)[0]).storyboard
    weather = Weather(storyboard, pipeline.runner.simulator.program, values)
    return weather.at(0, joint.weather, joint.events)


def row(pipeline):
    return pipeline.space.row({})[np.newaxis]


def test_all_fourteen_fields_are_carlas():
    assert len(CARLA_FIELDS) == 14
    assert sorted(FIELDS) == sorted(CARLA_FIELDS)


@given(u=st.lists(st.floats(0.0, 1.0), min_size=30, max_size=30))
def test_every_field_is_in_its_range_and_what_the_ontology_says(pipeline, u):
    space = pipeline.space
    values = space.values(space.decode(np.array([u[: space.n_var]]))[0])
    sky = sky_of(pipeline, values)
    for name, field in CARLA_FIELDS.items():
        assert field.low <= sky.fields[name] <= field.high, name
    for name in FROM_ONTOLOGY:
        expected = values[name] % 360.0 if name == "sun_azimuth_angle" else values[name]
        assert sky.fields[name] == pytest.approx(expected, abs=1e-9), name
    assert sky.friction == pytest.approx(values["friction"])
    shown = sky.parameters()
    for name, value in sky.fields.items():
        assert getattr(shown, name) == pytest.approx(value, abs=1e-3)


@pytest.mark.parametrize("fog", [0, 35, 80])
@pytest.mark.parametrize("rain", [0, 20, 70])
def test_without_our_properties_the_physical_quantities_tell_the_same(pipeline, fog, rain):
    """What other tools' files say is turned back, and so what follows from it."""
    logical = load("crossroads-s4")
    space = logical.space()
    values = space.values(space.decode(np.full((1, space.n_var), 0.5))[0])
    said = {"fog_density": fog, "precipitation": rain, "cloudiness": 90, "wind_intensity": 5}
    values = space.values(space.row(said))
    storyboard = pipeline.runner.concrete(space.row(said)).storyboard
    bare = without_properties(storyboard)
    assert not [one for one in walk(bare) if isinstance(one, osc.RoadCondition) and one.properties]
    with_them, without = sky_of(pipeline, values), sky_of(pipeline, values, bare)
    for name in ("fog_density", "fog_distance", "fog_falloff", "precipitation", "wetness",
                 "precipitation_deposits", "sun_altitude_angle"):  # fmt: skip
        assert without.fields[name] == pytest.approx(with_them.fields[name], abs=1e-6), name
    assert without.friction == with_them.friction


def without_properties(storyboard):
    from dataclasses import replace

    from bridgegen.openx.openscenario.element import rewritten

    def bare(one):
        return replace(one, properties=None) if isinstance(one, osc.RoadCondition) else one

    return rewritten(storyboard, bare)


def test_what_is_out_of_range_is_brought_into_it():
    fields = of_quantities(np.array([1.0, 200.0, 0.0, -3.0, 2.0, -1.0, 1.5, 1.0]))
    for one in (clamped(fields), clamped(dict.fromkeys(CARLA_FIELDS, 1e6))):
        for name, field in CARLA_FIELDS.items():
            assert field.low <= one[name] <= field.high
    assert clamped(fields)["sun_azimuth_angle"] == pytest.approx(360 - np.degrees(3.0))


def test_a_weather_that_an_event_brings(machine, monkeypatch):
    """Fog of 60 m at 2 s, none again at 5 s: CARLA has them from those instants on."""
    declared = '<ParameterDeclaration name="sight" parameterType="double" value="10000"/>'
    text = scenario(
        ("ego",), start("ego", lane(1, 1, 90.0), 5.0),
        weather_event("fog", 2.0, raining("4", "60"))
        + weather_event("later", 5.0, raining("0", "$sight")),
        environment=raining("0", "$sight"), parameters=declared,
    )  # fmt: skip
    chosen = SimulatorChoice("carla", {"ego": "kinematic"}, {"--port": machine.port})
    simulator = chosen.simulator(read(text.encode(), "x.xosc"), "x.xosc", get("route-follower"))
    seen, tick = [], machine.tick

    def looking():
        seen.append((machine.weather.fog_density, machine.weather.precipitation))
        return tick()

    monkeypatch.setattr(machine, "tick", looking)
    rollout = simulator.run(simulator.roads([crossroads()]), np.array([0]), {})
    assert rollout.status[0] == 0
    fog = 100.0 * np.log(1e4 / 60.0) / np.log(200.0)
    rain = 100.0 * np.log(4.0 / 0.1) / np.log(500.0)
    for k, now in enumerate(seen):
        expected = (fog, rain) if 40 <= k < 100 else (0.0, 0.0)
        assert now == pytest.approx(expected, abs=1e-4), k
    assert len(seen) > 100
