import importlib.util
import math
import os
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from tests.approval import refuses
from tests.ego.planners.observed import (
    BODY_LENGTH,
    CENTRE,
    WIDTH,
    drive,
    lane,
    observation,
    road_map,
    scene,
    together,
    track,
)

from bridgegen.adapters.planners import _openpilot_checkout as checkout
from bridgegen.adapters.planners import openpilot_longitudinal as openpilot
from bridgegen.base.errors import InputError
from bridgegen.drivers.interface import ROUTE_POINTS, ROUTE_STEP

needs_planner = pytest.mark.skipif(
    checkout.VARIABLE not in os.environ or importlib.util.find_spec("acados") is None,
    reason=f"{checkout.VARIABLE} names no checkout of openpilot, or there is no acados",
)
FRONT = CENTRE + BODY_LENGTH / 2


def told(*tracks, **said):
    of = scene(m=len(tracks))
    found = openpilot.inputs(observation(tracks, **said), of, openpilot.roads_of(of))
    return found["points"][0], found["leads"][0].tolist()


# --- The lead -------------------------------------------------------------------------------------


def test_the_lead_is_the_nearest_ahead_in_the_way():
    points, leads = told(
        track(x=80.0), track(x=40.0, y=1.0), track(x=20.0, y=WIDTH), track(x=-20.0)
    )
    assert leads == [1, 1]
    assert points[1] == pytest.approx([1.0, 40.0 - 2.3 - FRONT, 1.0, 20.0])
    assert told(track(y=1.9 + 0.01))[1] == [-1, -1]
    assert told(track(y=1.9 - 0.01))[1] == [0, 0]


def test_a_long_body_that_turns_in_is_in_the_way_before_its_centre_is():
    bus = track(y=-4.0, h=0.4)
    bus[6:8] = 12.0, 2.5
    assert told(bus)[1][0] == 0
    assert told(track(y=-4.0, h=0.4))[1][0] == -1


def test_what_is_not_confirmed_is_no_lead_and_no_point():
    points, leads = told(track(state=1), track(state=0), track(x=100.0, state=3))
    assert points[:, 0].tolist() == [0.0, 0.0, 1.0]
    assert leads == [2, 2]
    assert told()[1] == [-1, -1]


@pytest.mark.parametrize(
    ("drift", "heading", "lead"), [(-1.0, 0.0, 0), (-0.7, 0.0, -1), (-1.0, math.pi, -1)]
)
def test_the_second_lead_is_who_will_be_in_the_way_in_two_seconds(drift, heading, lead):
    assert told(track(y=WIDTH, vy=drift, h=heading))[1] == [-1, lead]


def test_a_lead_across_the_road_is_as_long_as_it_is_wide():
    points, leads = told(track(x=30.0, h=math.pi / 2, vx=0.0, vy=5.0))
    assert leads[0] == 0
    assert points[0, 1] == pytest.approx(30.0 - 1.9 / 2 - FRONT)
    assert points[0, 3] == pytest.approx(0.0)


def on_a_circle(radius, ahead):
    seen = observation([track()])
    angle = ROUTE_STEP * np.arange(ROUTE_POINTS) / radius
    seen.route[0, :, 0] = radius * np.sin(angle)
    seen.route[0, :, 1] = radius * (1.0 - np.cos(angle))
    seen.route[0, :, 2], seen.route[0, :, 3] = angle, 1.0 / radius
    turned = ahead / radius
    seen.tracks[0, 0, 1] = radius * np.sin(turned)
    seen.tracks[0, 0, 2] = radius * (1.0 - np.cos(turned))
    seen.tracks[0, 0, 3] = turned
    seen.tracks[0, 0, 4:6] = 12.0 * np.cos(turned), 12.0 * np.sin(turned)
    return seen


def test_in_a_bend_distance_and_speed_are_those_along_the_road():
    found = openpilot.inputs(on_a_circle(60.0, 50.0), scene(), [None])
    assert found["leads"][0].tolist() == [0, 0]
    _, distance, left, speed = found["points"][0, 0]
    assert distance == pytest.approx(50.0 - 2.3 - FRONT, abs=0.01)
    assert speed == pytest.approx(12.0)
    assert left == pytest.approx(60.0 * (1.0 - np.cos(50.0 / 60.0)))


def test_in_a_bend_it_sees_farther_than_the_observations_route():
    # The circle's arc, 60 degrees of it, as a lane of the map; the route ends after 78 m.
    radius, angle = 150.0, np.linspace(0.0, np.pi / 3, 80)
    centre, left, right = (
        np.stack([r * np.sin(angle), radius - r * np.cos(angle), angle], axis=1)
        for r in (radius, radius - 1.75, radius + 1.75)
    )
    sides = {"left": left[:, :2], "right": right[:, :2], "speed_limit": np.full(80, np.inf)}
    bend = replace(lane("2:0:-1", 0.0), centre=centre, **sides)
    road = replace(road_map(), lanes=(bend,), route=("2:0:-1",))
    of = scene(road=road)
    for ahead in (70.0, 120.0, 150.0):
        found = openpilot.inputs(on_a_circle(radius, ahead), of, openpilot.roads_of(of))
        assert found["leads"][0].tolist() == [0, 0]
        assert found["points"][0, 0, 1] == pytest.approx(ahead - 2.3 - FRONT, abs=0.05)
        assert found["points"][0, 0, 3] == pytest.approx(12.0, rel=1e-3)


def test_it_steers_along_a_circle_by_its_curvature():
    # A chord of a circle, pursued from the circle, is the circle; the route has corners.
    found = openpilot.inputs(on_a_circle(60.0, 50.0), scene(), [None])
    assert found["curvature"][0] == pytest.approx(1.0 / 60.0, rel=0.01)


def test_where_north_is_does_not_matter():
    seen = on_a_circle(60.0, 50.0)
    c, s = math.cos(2.0), math.sin(2.0)
    turned = replace(seen, h=seen.h + 2.0, route=seen.route.copy(), tracks=seen.tracks.copy())
    for array, x in ((turned.route, 0), (turned.tracks, 1), (turned.tracks, 4)):
        vector = array[..., x : x + 2].copy()
        array[..., x] = c * vector[..., 0] - s * vector[..., 1]
        array[..., x + 1] = s * vector[..., 0] + c * vector[..., 1]
    turned.route[..., 2] += 2.0
    turned.tracks[..., 3] += 2.0
    before, after = (openpilot.inputs(one, scene(), [None]) for one in (seen, turned))
    for name, values in before.items():
        np.testing.assert_allclose(after[name], values, atol=1e-9, err_msg=name)


# --- The checkout ---------------------------------------------------------------------------------


def test_without_a_checkout_one_sentence_says_how_to_get_it(monkeypatch):
    monkeypatch.delenv(checkout.VARIABLE, raising=False)
    with refuses(InputError):
        openpilot.OpenpilotLongitudinal()


@pytest.mark.parametrize(
    ("header", "says"),
    [
        ('#define COMMA_VERSION "0.8.9"\n', "is version 0.8.9"),
        ("", "has no common/version.h that says so"),
        (None, "has no common/version.h that says so"),
    ],
)
def test_a_folder_of_something_else_is_refused(monkeypatch, tmp_path, header, says):
    (tmp_path / "common").mkdir()
    if header is not None:
        (tmp_path / "common" / "version.h").write_text(header)
    monkeypatch.setenv(checkout.VARIABLE, str(tmp_path))
    with refuses(InputError, "0.11", says):
        openpilot.OpenpilotLongitudinal()


def test_a_checkout_that_lacks_files_is_refused_and_nothing_of_it_stays(monkeypatch, tmp_path):
    (tmp_path / "common").mkdir()
    (tmp_path / "common" / "version.h").write_text('#define COMMA_VERSION "0.11.2"\n')
    (tmp_path / "openpilot").mkdir()
    (tmp_path / "openpilot" / "__init__.py").write_text("import cereal.log\n")
    monkeypatch.setenv(checkout.VARIABLE, str(tmp_path))
    before = set(sys.modules), list(sys.path), list(sys.meta_path)
    with refuses(InputError):
        openpilot.OpenpilotLongitudinal()
    assert (set(sys.modules), list(sys.path), list(sys.meta_path)) == before
    assert [one.name for one in (tmp_path / "openpilot").iterdir()] == ["__init__.py"]


def test_what_make_says_is_passed_on(monkeypatch, tmp_path):
    assert "ocp_cython" in checkout._compile(tmp_path)  # there is no such rule
    monkeypatch.setenv("PATH", str(tmp_path))
    assert checkout._compile(tmp_path) == "make cannot be run: No such file or directory"


# --- openpilot ------------------------------------------------------------------------------------


def braking_lead(time):
    """A car 60 m ahead at 25 m/s, that brakes by 4 m/s² from 2 s on."""
    t = min(max(time - 2.0, 0.0), 25.0 / 4.0)
    x = 60.0 + 25.0 * min(time, 2.0) + 25.0 * t - 2.0 * t * t
    return [track(x=x, vx=25.0 - 4.0 * t)]


@needs_planner
@pytest.mark.planners
def test_another_time_step_is_refused():
    with pytest.raises(InputError, match=r"must be 0\.05 for openpilot, .* got 0\.1"):
        openpilot.OpenpilotLongitudinal().reset(1, replace(scene(), time_step=0.1))


@needs_planner
@pytest.mark.planners
def test_it_reaches_its_set_speed_and_keeps_it():
    seen, commands = drive(openpilot.OpenpilotLongitudinal(), lambda _: [], 600, target=30.0)
    assert seen[-1].v[0] == pytest.approx(30.0, abs=0.1)
    assert commands[:, 0].max() <= 1.6  # its comfort limit


@needs_planner
@pytest.mark.planners
def test_it_brakes_for_a_lead_that_brakes_but_not_harder_than_its_limit():
    _, commands = drive(openpilot.OpenpilotLongitudinal(), braking_lead, 200)
    assert commands[:, 0].min() == pytest.approx(-3.5, abs=0.05)
    assert not commands[:, 1].any()


@needs_planner
@pytest.mark.planners
def test_its_demands_are_openpilots_own_called_alone(tmp_path):
    def others(time):
        cutting = track(x=30.0 + 24.0 * time, y=WIDTH - 0.6 * min(time, 5.0), vx=24.0, vy=-0.6)
        return [*braking_lead(time), cutting]

    seen, commands = drive(openpilot.OpenpilotLongitudinal(), others, 200)
    np.savez(tmp_path / "told.npz", **openpilot.export(seen, scene(m=2)))
    (tmp_path / "alone.py").write_text(openpilot.reproduction(str(tmp_path / "told.npz")))
    # Where openpilot is not installed, its modules that are not needed are names only.
    runs = (
        "import runpy, sys\n"
        "from pathlib import Path\n"
        "from bridgegen.adapters.planners import _openpilot_checkout as checkout\n"
        "with checkout.imported_from(checkout.checkout()):\n"
        "    import openpilot.selfdrive.controls.lib.longitudinal_mpc_lib.long_mpc as mpc\n"
        "    mpc.AcadosOcpSolverCython = checkout.solver(mpc)\n"
        "    runpy.run_path(sys.argv[1])\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", runs, str(tmp_path / "alone.py")],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    alone = np.array(done.stdout.split(), dtype=float)
    np.testing.assert_allclose(alone, commands[:, 0], rtol=0.0, atol=1e-9)


@needs_planner
@pytest.mark.planners
def test_a_row_depends_on_itself_alone_and_not_on_earlier_batches():
    rows = [observation([track(x=x, vx=10.0)], v=v) for x in (30.0, 60.0) for v in (10.0, 30.0)]
    driver = openpilot.OpenpilotLongitudinal()
    driver.reset(4, scene(4))
    batch = [np.array(driver.act(together(rows)).acceleration) for _ in range(20)]
    for i, row in enumerate(rows):
        driver.reset(1, scene(1))
        for found in batch:
            assert driver.act(row).acceleration[0] == found[i]
