"""What scenarios state of the taxonomy, and which evaluations cover it."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.jobs.dashboard.odd import TAXONOMY, coverage
from bridgegen.jobs.dashboard.scenery import BANDS, scenery_of
from bridgegen.jobs.search.scenarios import load
from bridgegen.scenario.language.reader import names
from bridgegen.scenario.weather import PARAMETERS

CUT_IN = scenery_of(load("cut-in"))


def seen(**columns):
    """Return the bands of evaluations of cut-in that differ in these parameters."""
    n = max(len(values) for values in columns.values())
    given_ = {name: np.array(values, dtype=float) for name, values in columns.items()}
    return CUT_IN.seen(given_, n).bands


def test_rain_by_hand():
    # 0.1·500^(p/100) mm/h: 0, 0.19, 2.4, 2.7, 7.4, 7.9 and 50
    assert seen(precipitation=[0, 10, 51, 53, 69, 70.5, 100])["rain"] == [1, 2, 2, 2, 0]


def test_fog_by_hand():
    # one sees 1 km at 43 %, 5 km at 13 %
    assert seen(fog_density=[100, 44, 42, 14, 12, 0])["visual_range"] == [2, 2, 2]


def test_light_by_hand():
    # 100,000 lx · sin: 1,745 lx at 1°, 3,490 lx at 2°
    assert seen(sun_altitude_angle=[-30, -0.1, 1, 2, 50])["illuminance"] == [2, 1, 2]


def test_clouds_in_oktas():
    assert seen(cloudiness=[0, 12.5, 25, 50, 80, 100])["cloud"] == [2, 1, 1, 1, 1]


def test_wind_by_beaufort():
    # 0.2 m/s for each per cent: 0, 2, 10 and 20 m/s
    found = seen(wind_intensity=[0, 10, 50, 100])["wind"]
    assert found == [1, 0, 1, 0, 0, 1, 0, 0, 1]


@pytest.mark.parametrize(
    ("quantity", "parameter", "values"),
    [("rain", "precipitation", (1.0, 30.0, 99.0)), ("visual_range", "fog_density", (5.0, 60.0))],
)
def test_the_laws_are_those_of_the_simulator(quantity, parameter, values):
    for value in values:
        x = CUT_IN.quantities[quantity].evaluate({parameter: np.array([value])})
        assert PARAMETERS[parameter].law.inverse(float(x[0])) == pytest.approx(value)


def test_fifty_kilometres_an_hour_are_fifty():
    found = scenery_of(load("crossroads-s4")).seen({}, 1).bands["speed_limit"]
    assert found == [0, 1, 0, 0, 0]  # 13.9 m/s


@pytest.mark.parametrize(
    ("scenario", "facts"),
    [
        ("pedestrian-at-night", {"participant:pedestrian", "crosswalk"}),
        ("red-light-runner", {"traffic lights", "crossroads"}),
        ("road-works", {"road works"}),
        ("motorway-merge", {"slip road", "motorway"}),
        ("emergency-vehicle-on-red", {"participant:emergency"}),
        ("jam-tail-in-fog", {"jam"}),
    ],
)
def test_scenarios_of_the_catalogue_have_what_they_are_called_by(scenario, facts):
    assert facts <= scenery_of(load(scenario)).facts


@pytest.mark.parametrize(
    ("radius", "band"), [(10.0, 0), (15.0, 1), (17.9, 2), (48.0, 3)]
)  # of the middle of a ring of 5 m: 25, 35, 40.8 and 101 m across
def test_a_roundabout_by_its_inscribed_circle(radius, band):
    scenario = load("roundabout-entry")
    roads = replace(scenario.roads, knobs={**scenario.roads.knobs, "radius": radius})
    scenery = scenery_of(replace(scenario, roads=roads))
    assert scenery.seen({}, 1).bands["roundabout_diameter"].index(1) == band
    assert "curve_radius" not in scenery.quantities


def test_a_file_and_its_map_are_read(tmp_path):
    from tests.campaign.braking import write_pair

    scenario, ranges = write_pair(tmp_path)
    found = scenery_of(load(scenario, ranges))
    assert "participant:car" in found.facts
    assert found.quantities == {}
    assert found.partly


# ---- the taxonomy ----


def test_the_top_level_is_that_of_iso_34503():
    assert list(dict.fromkeys(one.path[0] for one in TAXONOMY)) == [
        "Scenery", "Environmental conditions", "Dynamic elements",
    ]  # fmt: skip
    second = {one.path[1] for one in TAXONOMY if one.path[0] == "Scenery"}
    assert second == {
        "Zone", "Drivable area", "Junctions", "Special structures", "Fixed road structures",
        "Temporary structures",
    }  # fmt: skip


def test_every_band_of_a_quantity_is_an_attribute():
    named = {one.band for one in TAXONOMY if one.band}
    assert named == {(name, k) for name, of in BANDS.items() for k in range(len(of))} - {
        ("rain", 4)  # no scenario rains more than 50 mm/h
    }


def test_every_fact_is_of_a_scenario_and_known():
    facts = set().union(*(scenery_of(load(name)).facts for name in names()))
    named = {one.fact for one in TAXONOMY if one.fact}
    of_odds = {"no junction", "no sign", "roundabout"}  # values that an ODD may ask
    assert facts - of_odds <= named
    assert named - facts == {  # that a scenario of one's own may have
        "left-hand traffic", "participant:e-scooter", "participant:tram",
        "participant:motorcycle", "t-junction",
    }  # fmt: skip


def test_what_is_not_expressible_is_not_called_uncovered(result):
    found = coverage([result(seen=CUT_IN.seen({}, 5))], {"cut-in": CUT_IN})
    covered, open_, cannot = found.counts
    assert covered + open_ + cannot == len(TAXONOMY)
    assert cannot == sum(not one.expressible for one in TAXONOMY)
    tunnels = next(one for one in found.attributes if one.attribute.path[-1] == "tunnels")
    assert not tunnels.attribute.expressible
    assert not tunnels.scenarios


def test_what_is_not_read_may_be_covered(result):
    file = replace(CUT_IN, quantities={}, facts=frozenset(), partly="its weather")
    some = [result(seen=CUT_IN.seen({}, 5)), result("file", seen=file.seen({}, 5))]
    found = {
        one.attribute.path[-2:]: one
        for one in coverage(some, {"cut-in": CUT_IN, "file": file}).attributes
    }
    fog = found["Particulates", "fog, up to 1 km"]
    assert (fog.scenarios, fog.unread) == ({}, 1)
    assert found["Type", "bicycles"].unread == 0  # participants are always read
    assert found["Special structures", "tunnels"].unread == 0


def test_evaluations_of_several_results_are_added(result):
    some = [result(seen=CUT_IN.seen({"precipitation": np.array(x)}, len(x)), source=str(k))
            for k, x in enumerate(([0.0, 0.0], [0.0, 100.0, 100.0]))]  # fmt: skip
    found = {one.attribute.path[-2:]: one for one in coverage(some, {"cut-in": CUT_IN}).attributes}
    assert found["Rainfall", "none"].scenarios == {"cut-in": 3}
    assert found["Rainfall", "heavy, 7.6 to 50 mm/h"].evaluations == 2


@given(st.lists(st.floats(-200.0, 200.0), max_size=30))
def test_no_evaluation_is_lost_or_counted_twice(values):
    x = np.array(values, dtype=float)
    found = CUT_IN.seen({"precipitation": x, "fog_density": x, "ego_speed": x}, len(x))
    for name, counts in found.bins.items():
        assert sum(counts) + found.outside.get(name, 0) == len(x)
    for name, counts in found.bands.items():
        assert sum(counts) == len(x), name
