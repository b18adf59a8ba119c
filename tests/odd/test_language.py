"""What a scenario file may say beyond the crossroads of the paper, and what it may not."""

import re
from importlib import resources

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.approval import approve, refuses

from bridgegen.base.errors import InputError, ScenarioError
from bridgegen.jobs.search.validate import validate_file
from bridgegen.scenario.language.reader import load, names
from bridgegen.scenario.language.starter import start_scenario
from bridgegen.scenario.participants import PARTICIPANTS


@pytest.fixture
def own(tmp_path):
    """Write the starter with some of its text replaced, and read it."""

    def write(*edits):
        path = tmp_path / "own.yaml"
        path.unlink(missing_ok=True)
        start_scenario("own", folder=tmp_path)
        text = path.read_text("utf-8")
        for old, new in edits:
            assert old in text, old
            text = text.replace(old, new, 1)
        path.write_text(text, "utf-8")
        return load(path)

    return write


def test_a_default_of_an_included_parameter(own):
    edit = ("# defaults: {fog_density: 60, sun_altitude_angle: 20}", "defaults: {fog_density: 60}")
    scenario = own(edit)
    assert scenario.parameters["fog_density"].default == 60.0
    assert scenario.space(["participants"]).row({}).shape == (len(scenario.space().names),)
    assert own().parameters["fog_density"].default == 0.0
    assert own().fingerprint != scenario.fingerprint


def test_bodies_in_one_lane_need_their_lengths(own):
    """A car ahead of a car: the rear of the one, the front of the other, and 0.4 m."""
    car = PARTICIPANTS["car"].body
    needed = car.rear + car.front + 0.4
    assert needed == pytest.approx(5.0)
    third = "  other: # car"
    at = "  third:\n    type: car\n    start: {lane: 2, distance: %s}\n  other: # car"
    own((third, at % 55.0))
    with refuses(ScenarioError, "4.9 m"):
        own((third, at % 54.9))


def test_bodies_beside_each_other_need_their_widths(own):
    bicycle = "  third:\n    type: bicycle\n    start: {lane: 2, distance: 50.0, offset: %s}\n"
    third = "  other: # car"
    own((third, bicycle % -1.5 + third))  # (1.9 + 0.6) / 2 and 0.25 m
    with refuses(ScenarioError, "0 m"):
        own((third, bicycle % -1.49 + third))


def test_a_jam_moves_as_one(own):
    jam = (
        "# jams: {queue: {tail: {lane: 2, distance: 400.0}, vehicles: [car, truck, car], "
        "gap: 3.0}}",
        "jams: {queue: {tail: {lane: 2, distance: tail}, vehicles: [car, truck, car], gap: room}}",
    )
    more = (
        "parameters:\n",
        "parameters:\n"
        + "".join(
            f"  {name}: {{axis: temporary, unit: m, low: {low}, high: {high}, default: {high}, "
            "description: d, source: s}\n"
            for name, low, high in (("tail", 300, 400), ("room", 2, 6))
        ),
    )
    scenario = own(jam, more)
    space = scenario.space(["temporary"])
    X = space.decode(np.random.default_rng(0).random((50, space.n_var)))
    tail, room, second, third = (
        X[:, space.index(name)] for name in ("tail", "room", "queue_2_at", "queue_3_at")
    )
    car, truck = PARTICIPANTS["car"].body, PARTICIPANTS["truck"].body
    np.testing.assert_allclose(second - truck.rear - (tail + car.front), room, atol=1e-9)
    np.testing.assert_allclose(third - car.rear - (second + truck.front), room, atol=1e-9)


@pytest.mark.parametrize(
    ("edits", "problem"),
    [
        (
            [("lanes: 2 #", "lanes: 1 #")],
            "leg main has 1 lanes out, got lane 2",
        ),
        (
            [("lane_change: {lanes: -1, time: 3.0}", "lane_change: {lanes: -1}")],
            "a lane change takes a time or a distance",
        ),
        (
            [("{kind: after, event: other_moves_over", "{kind: after, event: other_moves")],
            "unknown event 'other_moves'; did you mean 'other_moves_over'?",
        ),
        (
            [("{kind: distance, to: ego, value: near}", "{kind: distance, value: near}")],
            "a distance condition needs 'to', the other participant",
        ),
        (
            [("  # walker:\n  #   type: pedestrian", "  walker:\n    type: pedestrian"),
             ("  #   path: [{lane", "    path: [{lane")],
            "leg main has no sidewalk: sidewalk_width must be greater than 0 m",
        ),
        (
            [("start: {lane: 2, distance: 50.0}", "start: {lane: 2, distance: 50.0, offset: gap}")],
            "the ego's offset is a constant, its driver keeps to one path; got 'gap'",
        ),
        (
            [("    type: car\n    start: {lane: 1, distance: other_at}",
              "    type: pedestrian\n    start: {lane: 1, distance: other_at}")],
            "other must stand on a sidewalk: pedestrians are on roads to cross",
        ),
        ([("segments: [{", "x: [{"), ("# x:", "segments: [{length: 500, curvature: 0.5}] #")],
         "curvature [1/m] must be -0.1667 to 0.1667, got 0.5"),
        ([("speed_limit: 27.8", "speed_limit: 10.0")],
         "leaves no value to ego_speed [m/s], 10 to 25"),
    ],
)  # fmt: skip
def test_mistakes(own, edits, problem):
    with pytest.raises(ScenarioError) as caught:
        own(*edits)
    said = "\n".join(caught.value.problems)
    assert problem in said
    assert re.search(r"own\.yaml", said)


# -- anything else ---------------------------------------------------------------------------------


def places_in(data, path=()):
    """Yield the path of everything in nested mappings and lists."""
    items = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in items:
        yield (*path, key)
        if isinstance(value, dict | list):
            yield from places_in(value, (*path, key))


def changed(data, path, value):
    copy = dict(data) if isinstance(data, dict) else list(data)
    copy[path[0]] = changed(data[path[0]], path[1:], value) if len(path) > 1 else value
    return copy


JUNK = st.sampled_from(
    [None, True, -1, 0, 1e-9, 3.7, 1e12, float("nan"), float("inf"), "", "x", "ego", "P5", "main",
     "fog_density", "1/0", "ego_speed", [], {}, [1], {"x": 1}, "road", "crossroads", 10**400]
)  # fmt: skip


def test_a_route_on_a_leg_that_does_not_exist_is_reported_by_its_ends_alone(tmp_path):
    scenario = yaml.safe_load(
        resources.files("bridgegen.scenario.catalogue")
        .joinpath("pedestrian-at-night.yaml")
        .read_text("utf-8")
    )
    for end in ("start", "end"):
        scenario = changed(scenario, ("participants", "ego", end, "leg"), "x")
    file = tmp_path / "spoilt.yaml"
    file.write_text(yaml.safe_dump(scenario), "utf-8")
    with pytest.raises(InputError) as refused:
        load(file)
    assert len(refused.value.problems) == 2
    assert all("a place lies on one of the legs" in one for one in refused.value.problems)


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(name=st.sampled_from(names()), data=st.data())
def test_nonsense_anywhere_is_refused_or_taken_never_a_traceback(tmp_path, name, data):
    text = (
        resources.files("bridgegen.scenario.catalogue").joinpath(f"{name}.yaml").read_text("utf-8")
    )
    scenario = yaml.safe_load(text)
    for _ in range(data.draw(st.integers(1, 2))):
        path = data.draw(st.sampled_from(sorted(places_in(scenario), key=str)))
        scenario = changed(scenario, path, data.draw(JUNK))
    file = tmp_path / "spoilt.yaml"
    file.write_text(yaml.safe_dump(scenario), "utf-8")
    found, problems = None, ()
    try:
        found = load(file)
    except InputError as error:
        problems = error.problems
    assert all(".yaml" in problem for problem in problems)  # the file, or one that it includes
    if found is not None:
        space = found.space()
        assert space.violations(space.decode(np.full((1, space.n_var), 0.5))) == []


def test_what_only_the_roads_tell_is_told_by_validate(own, tmp_path):
    """The file alone does not say that there is no lane to the right of the right one."""
    own(("lane_change: {lanes: -1", "lane_change: {lanes: -2"))
    (problem,) = validate_file(tmp_path / "own.yaml")
    approve(problem, "other", "lane 2")
