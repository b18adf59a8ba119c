"""An operational design domain that is left during the drive, and what the driver does then."""

from dataclasses import replace

import numpy as np
import pytest
from tests.approval import refuses
from tests.openodd.test_bounding import _odd, _rows

from bridgegen.base.errors import FileFormatError, InputError, ScenarioError
from bridgegen.drivers._odd_kernels import is_outside
from bridgegen.drivers._weather_columns import WEATHER
from bridgegen.drivers.kinds import HAZARD
from bridgegen.engine.options.search import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.simulate import simulate_file
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.scenario.language.reader import load, shipped_text
from bridgegen.scenario.odd.bounding import fit_of
from bridgegen.scenario.odd.exit import watched
from bridgegen.scenario.weather import column, read_limits

STOPS = "reference+stop-in-lane"
SHOULDER = "reference+stop-on-shoulder"


def _pipeline(name, ego):
    scenario = load(name)
    return Pipeline(scenario, scenario.space(), PipelineOptions(ego=ego))


def _usual(pipeline):
    values = pipeline.scenario.usual_values()
    return np.array([[values[name] for name in pipeline.space.names]])


@pytest.mark.parametrize(
    ("include", "exclude"),
    [
        ('visibility: ">= 400 m"\nrainfall_rate: "< 2 mm/h"', ""),
        ("rainfall_level: [none, moderate_rain]", 'visibility: "< 1 km"'),
        ("", 'cloudiness: "> 6 okta"\nsun_elevation: "[-10 .. 0] deg"'),
        ("", 'AND:\n  rainfall_rate: "> 1 mm/h"\n  visibility: "<= 2000 m"'),
        ('road_friction: "> 0.6"', ""),
    ],
)
def test_the_kernel_judges_a_weather_as_the_odd_judges_the_row_that_states_it(
    include, exclude, tmp_path
):
    exclude = exclude.replace("\n", "\n      ") if "AND" in exclude else exclude
    scenario, odd = load("cut-in"), _odd(tmp_path, include, exclude)
    fit = fit_of(scenario, odd)
    columns = _rows(scenario, 3000)
    # A third of the rows gets more of the weather than a search would draw.
    for name in ("precipitation", "fog_density"):
        columns[name][::3] = np.random.default_rng(2).uniform(0.0, 100.0, 1000)
    assert fit.gaps == {}
    limits = watched(replace(scenario, odd=fit)).limits
    rows = [
        (column(one.name), one.low, one.high, group)
        for group, several in enumerate(limits)
        for one in several
    ]
    weather = np.zeros((3000, WEATHER))
    rain = columns["precipitation"]
    weather[:, column("rain")] = np.where(rain > 0, 0.1 * 500 ** (rain / 100), 0.0)
    weather[:, column("visual_range")] = 10_000 / 200 ** (columns["fog_density"] / 100)
    weather[:, column("cloud")] = columns["cloudiness"] / 100
    weather[:, column("friction_scale")] = columns["friction"]
    weather[:, column("sun_elevation")] = np.radians(columns["sun_altitude_angle"])
    outside = np.array([is_outside(one, np.nan, np.nan, np.array(rows)) for one in weather])
    assert 0 < outside.sum() < 3000
    np.testing.assert_array_equal(~outside, fit.inside(columns))


def test_a_driver_stops_in_its_lane_when_fog_has_thickened(tmp_path):
    pipeline = _pipeline("fog-thickens", STOPS)
    X = _usual(pipeline)
    rollout = pipeline.rollout(X)
    row = dict(zip(pipeline.space.names, X[0], strict=True))
    begins = rollout.began[0, rollout.event_names.index("fog_thickens")]
    before = rollout.v[0, 0, :begins].sum() * rollout.time_step
    assert before == pytest.approx(row["fog_at"], abs=row["ego_speed"] * rollout.time_step)
    # five steps in ten seconds, evenly in the density, whose law the visibility follows
    density = row["fog_density"] + np.arange(1, 6) / 5 * (
        row["later_fog_density"] - row["fog_density"]
    )
    step = int(np.argmax(10_000 / 200 ** (density / 100) < 200.0))
    left, demands = rollout.transitions[0]
    assert left == begins + round(step * 2.5 / rollout.time_step)
    assert (demands - left) * rollout.time_step == pytest.approx(1.0)
    brakes = demands + round(10.0 / rollout.time_step)
    lit = rollout.lamps[0, 0] & HAZARD == HAZARD
    assert not lit[: brakes + 1].any()
    assert lit[brakes + 1 :].all()
    slows = np.flatnonzero(rollout.a[0, 0, brakes:] < -1.9)[0]  # 1 m/s³ until 2 m/s²
    assert 1.9 <= slows * rollout.time_step <= 2.1
    assert rollout.v[0, 0, -1] == 0.0
    assert abs(rollout.offset[0, 0, -1]) < 0.1
    margins = pipeline.monitor.results(rollout, 0)
    assert [one.unit for one in margins[:2]] == ["s", "s"]
    assert margins[0].margin == pytest.approx(3.0)
    stands = int(np.argmax(rollout.v[0, 0] < 0.5))
    last = (stands - 1 - left) * rollout.time_step
    assert margins[1].margin == pytest.approx(35.0 - last)
    assert all(one.verdict == "met" for one in margins)

    files = write_scenario(pipeline, X[0], tmp_path, "one")
    text = files[2].read_text("utf-8")
    assert text.count("<EnvironmentAction>") == 6
    result = simulate_file(files[2], criteria=pipeline.scenario.criteria)
    assert [one.margin for one in result.criteria] == [one.margin for one in margins]


def test_without_the_manoeuvre_the_domain_is_left_all_the_same_and_the_driver_drives_on():
    stops, drives_on = (_pipeline("rain-sets-in", ego) for ego in (STOPS, "reference"))
    X = _usual(stops)
    one, other = stops.rollout(X), drives_on.rollout(X)
    left, demands = one.transitions[0]
    assert other.transitions[0].tolist() == [left, -1]
    assert not other.lamps.size
    until = demands + round(10.0 / one.time_step)
    np.testing.assert_array_equal(one.v[0, :, :until], other.v[0, :, :until])
    violated = [r.criterion.id for r in drives_on.monitor.results(other, 0) if r.margin <= 0.0]
    assert violated == ["demand", "standstill"]


CHANGES = "changes: {at: 400.0, markings: none}"


@pytest.mark.parametrize(
    ("changes", "at"),
    [
        (CHANGES, 400.0),
        ("changes: {at: 310.0, road_type: rural}", 310.0),
    ],
)
def test_a_domain_is_left_where_the_vehicles_front_is_past_the_roads_change(changes, at, tmp_path):
    scenario = _changed(tmp_path, (CHANGES, changes), name="markings-end")
    pipeline = Pipeline(scenario, scenario.space(), PipelineOptions(ego=SHOULDER))
    X = _usual(pipeline)
    rollout = pipeline.rollout(X)
    left, demands = rollout.transitions[0]
    front = rollout.x[0, 0] + 3.7  # the road runs along x
    assert front[left - 1] < at <= front[left]
    assert (demands - left) * rollout.time_step == pytest.approx(1.0)

    # It stands in the middle of the shoulder, parallel to the road, and got there in comfort.
    width = dict(zip(pipeline.space.names, X[0], strict=True))["lane_width"]
    assert rollout.v[0, 0, -1] == 0.0
    assert rollout.offset[0, 0, -1] == pytest.approx(-0.5 * (width + 2.5), abs=0.05)
    assert abs(rollout.h[0, 0, -1]) < 0.01
    across = rollout.v[0, 0, :-1] * np.diff(rollout.h[0, 0]) / rollout.time_step
    assert np.abs(across).max() < 1.5
    begins = demands + round(10.0 / rollout.time_step)
    assert rollout.a[0, 0, begins:].min() >= -2.0 - 1e-9
    margins = pipeline.monitor.results(rollout, 0)
    assert all(one.verdict == "met" for one in margins)

    files = write_scenario(pipeline, X[0], tmp_path, "one")
    road = files[1].read_text("utf-8")
    assert road.count(f'<type s="{at}" type="rural"') + road.count(f'sOffset="{at}"') > 0
    result = simulate_file(files[2], criteria=pipeline.scenario.criteria)
    assert [one.margin for one in result.criteria] == [one.margin for one in margins]


def test_a_shoulder_that_is_narrower_than_the_car_is_not_used(tmp_path):
    narrow = ("shoulder_width: 2.5", "shoulder_width: 1.5")
    scenario = _changed(tmp_path, narrow, name="markings-end")
    pipelines = [
        Pipeline(scenario, scenario.space(), PipelineOptions(ego=ego)) for ego in (STOPS, SHOULDER)
    ]
    one, other = (pipeline.rollout(_usual(pipeline)) for pipeline in pipelines)
    np.testing.assert_array_equal(one.x, other.x)
    np.testing.assert_array_equal(one.y, other.y)


@pytest.mark.parametrize(
    ("asks", "left"),
    [
        ("lane_marking: no_lane_marking", "lane_marking = none"),
        ("lane_marking: [clear_lane_marking, no_lane_marking]\n    visibility: '> 9 m'", "visual"),
        ("drivable_area_edge: line_markers", "lane_marking = clear"),
    ],
)
def test_an_attribute_of_the_road_is_followed_where_its_change_matters(asks, left, tmp_path):
    old = ("lane_marking: clear_lane_marking", asks)
    (line,) = watched(_changed(tmp_path, old, name="markings-end")).to_lines()
    assert left in line
    assert ("the weather is" in line) == (left == "visual")


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        (CHANGES, "changes: {at: 400.0}", ("road_type or markings", "line")),
        (CHANGES, "changes: {at: 2500.0, markings: none}", ("2400", "2500", "line")),
        (CHANGES, "changes: {at: ego_speed, markings: none}", ("ego_speed", "static", "line")),
        (CHANGES, "changes: {at: 400.0, road_type: rural}\n", ("nothing", "road changes")),
    ],
)
def test_a_change_of_the_road_that_is_wrong_is_refused(old, new, named, tmp_path):
    changes = [(old, new)]
    if "nothing" in named:
        changes.append(("    drivable_area_type: motorway\n", ""))
    with refuses(ScenarioError, *named):
        watched(_changed(tmp_path, *changes, name="markings-end"))


def test_a_users_driver_sees_the_weather_and_demands_a_transition(tmp_path):
    own = tmp_path / "own.py"
    own.write_text(
        "import numpy as np\n"
        "from bridgegen.drivers.interface import Control\n"
        "class Foggy:\n"
        "    def reset(self, n, scene): pass\n"
        "    def act(self, seen):\n"
        "        zeros = np.zeros(len(seen.x))\n"
        "        return Control(zeros, zeros, seen.weather[:, 0] < 200.0)\n",
        encoding="utf-8",
    )
    pipeline = _pipeline("fog-thickens", f"{own}:Foggy")
    left, demands = pipeline.rollout(_usual(pipeline)).transitions[0]
    assert demands == left > 0


# -- bad input -------------------------------------------------------------------------------------


def _changed(folder, *changes, name="fog-thickens"):
    text = shipped_text(name).decode()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    (folder / f"{name}.yaml").write_text(text, encoding="utf-8")
    return load(folder / f"{name}.yaml")


@pytest.mark.parametrize(
    ("old", "new", "error", "named"),
    [
        ("INCLUDE_AND:", "INCLUDE_ALL:", ScenarioError, ("INCLUDE_ALL", "line 19")),
        ('">= 200 m"', '">= 200 lx"', FileFormatError, ("lx", "fog-thickens.yaml")),
        ("area_type: motorway", "area_type: town", ScenarioError, ("town", "motorway")),
        ("time: 10.0", "time: fog_at", ScenarioError, ("fog_at", "constant", "line")),
        ("time: 10.0", "time: 0.0", ScenarioError, ("time", "line")),
        ("weather: later_", "weather: sooner_", ScenarioError, ("sooner_fog_density", "line")),
        (
            "  ahead_slows:",
            "  clears:\n    weather: later_\n    when: [{kind: time, value: 9}]\n  ahead_slows:",
            ScenarioError,
            ("no other event",),
        ),
        ("visibility:", "downlink_latency:", ScenarioError, ("nothing", "weather")),
    ],
)
def test_a_domain_or_a_change_of_weather_that_is_wrong_is_refused(old, new, error, named, tmp_path):
    with refuses(error, *named):
        watched(_changed(tmp_path, (old, new)))


def test_a_criterion_on_the_domain_needs_one():
    for name, formula in (
        ("cut-in", "always(ego.outside_odd < 1 s)"),
        ("fog-thickens", "always(behind.demanding < 1 s)"),
    ):
        scenario = load(name)
        options = PipelineOptions(criteria=({"id": "R-1", "formula": formula},))
        with refuses(InputError, "R-1", "ODD"):
            Pipeline(scenario, scenario.space(), options)


@pytest.mark.parametrize("text", ["", "0 <= rain", "5.0 <= rain <= 1.0", "0 <= wind_speed <= 3"])
def test_limits_that_cannot_be_read_are_refused(text):
    with refuses(InputError, "wind_speed" if "wind" in text else "got"):
        read_limits(text)


@pytest.mark.parametrize(
    ("name", "said"),
    [("fog-thickens", "visual_range ≥ 200"), ("rain-sets-in", "rain ≤ 7.6")],
)
def test_limits_that_touch_are_said_as_one(name, said):
    assert watched(load(name)).to_lines() == (f"the weather is within the ODD where {said}",)
