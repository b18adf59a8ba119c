"""Scenarios in CARLA's world, and what happens when the server fails."""

import subprocess
import sys

import carla
import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.adapters.carla import frame, server
from bridgegen.adapters.carla.server import turn_at
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.drivers import get
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.openx.on_map import on_map
from bridgegen.openx.opendrive.road_map import load_map
from bridgegen.openx.openscenario.read import read
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.choice import SimulatorChoice

from ..embedded.storyboards import crossroads, lane, scenario, start
from .stand_in import DEFAULT_MAP

pytestmark = pytest.mark.thorough

FIELDS = ("x", "y", "h", "v", "a", "offset", "n_steps", "status", "lights", "began", "detections")


def embedded(name, driver):
    logical = load(name)
    return Pipeline(logical, logical.space(), PipelineOptions(ego=driver))


def rows(pipeline, n, seed=4):
    return pipeline.space.decode(np.random.default_rng(seed).random((n, pipeline.space.n_var)))


def clean(machine):
    """Nobody of ours is left, and the server runs on as it did."""
    left = [one for one in machine.actors.values() if one.type_id != "traffic.traffic_light"]
    return not left and machine.settings == carla.WorldSettings()


def middle_of(actor):
    """Return the middle of an actor's box, as CARLA works it out (in the argument's place)."""
    at = actor.bounding_box.location
    return actor.transform.transform(carla.Location(x=at.x, y=at.y, z=at.z))


@pytest.mark.parametrize(
    ("name", "driver"),
    [
        ("crossroads-s4", "route-follower"),
        ("cut-in", "reference"),
        ("pedestrian-at-night", "careful"),
    ],
)
def test_an_ego_that_is_moved_is_the_embedded_one(made, machine, name, driver):
    pipeline, alone = made(name, driver, ego="kinematic"), embedded(name, driver)
    X = rows(pipeline, 2)
    here, there = pipeline.rollout(X), alone.rollout(X)
    assert (here.status == 0).all()
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(here, name), getattr(there, name), name)
    assert clean(machine)


def test_actors_are_where_the_scenario_says(made, machine, monkeypatch):
    """Each tick, the middle of each one's box, as CARLA works it out, on the ground."""
    pipeline = made("pedestrian-at-night", "route-follower", ego="kinematic")
    seen, tick = [], machine.tick

    def looking():
        found = {}
        for one in machine.actors.values():
            if role := one.attributes.get("role_name"):
                middle = middle_of(one)
                ground = middle.z - one.bounding_box.extent.z
                found[role] = (*frame.point(middle), frame.heading(one.transform.rotation), ground)
        seen.append(found)
        return tick()

    monkeypatch.setattr(machine, "tick", looking)
    rollout = pipeline.rollout(rows(pipeline, 1))
    for e, name in enumerate(rollout.names):
        role = "hero" if e == 0 else f"bridgegen.{name}"
        for k in range(1, int(rollout.n_steps[0])):
            x, y, h, ground = seen[k - 1][role]
            ahead = rollout.box[e, 2]
            there = rollout.h[0, e, k]
            assert x == pytest.approx(rollout.x[0, e, k] + ahead * np.cos(there), abs=1e-3)
            assert y == pytest.approx(rollout.y[0, e, k] + ahead * np.sin(there), abs=1e-3)
            assert np.cos(h - there) == pytest.approx(1.0, abs=1e-9)
            assert ground == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("name", ["crossroads-s3", "cyclist-right-turn"])
def test_carlas_physics_carries_out_what_our_driver_demands(made, machine, name):
    """Within half a metre a second of the demanded speed, a quarter of a metre beside the route."""
    pipeline, alone = made(name, "reference"), embedded(name, "reference")
    X = rows(pipeline, 2)
    here, there = pipeline.rollout(X), alone.rollout(X)
    assert (here.status == 0).all()
    assert clean(machine)
    for i in range(2):
        n = int(min(here.n_steps[i], there.n_steps[i]))
        assert not np.array_equal(here.x[i, 0, :n], there.x[i, 0, :n])
        assert np.abs(here.offset[i, 0, :n]).max() < np.abs(there.offset[i, 0, :n]).max() + 0.35
        assert np.abs(here.v[i, 0, :n] - there.v[i, 0, :n]).max() < 1.5
        np.testing.assert_allclose(
            np.hypot(np.diff(here.x[i, 0, :n]), np.diff(here.y[i, 0, :n])) / 0.05,
            0.5 * (here.v[i, 0, 1:n] + here.v[i, 0, : n - 1]), atol=0.35,
        )  # fmt: skip


def test_a_wet_road_has_less_grip(made, machine, monkeypatch):
    from .stand_in_actors import DRY, Vehicle

    pipeline = made("crossroads-s1", "route-follower")
    grips = []
    apply = Vehicle.apply_physics_control

    def noted(self, physics_control):
        apply(self, physics_control)
        grips.append(self.friction[0])

    monkeypatch.setattr(Vehicle, "apply_physics_control", noted)
    wet = pipeline.space.row({"precipitation": 60.0, "cloudiness": 90.0})
    friction = pipeline.space.values(wet)["friction"]
    assert friction < 0.7
    pipeline.rollout(np.array([wet]))
    assert grips == [pytest.approx(DRY * friction)]
    pipeline.runner.simulator.run(*pipeline.runner.roads_of(np.array([wet])), {}, dry=True)
    assert len(grips) == 1


def test_one_seed_one_result(made, machine):
    pipeline = made("crossroads-s4", "reference")
    X = rows(pipeline, 3)
    whole = pipeline.rollout(X)
    again = pipeline.rollout(X[::-1])
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(whole, name), getattr(again, name)[::-1], name)


def test_a_world_is_loaded_once_for_the_same_roads(made, machine):
    pipeline = made("crossroads-s1", "route-follower", ego="kinematic")
    loads = len(machine.loads)
    pipeline.rollout(rows(pipeline, 1))
    assert len(machine.loads) == loads + 1
    one = rows(pipeline, 1)
    pipeline.rollout(np.repeat(one, 2, axis=0))
    assert len(machine.loads) <= loads + 2
    assert machine.loads[-1] == "Carla/Maps/OpenDriveMap"


def test_who_is_not_there_is_not_seen(made, machine, monkeypatch):
    """Under the road, until it is added."""
    from bridgegen.adapters.carla.stage import BELOW

    assert BELOW < -10
    heights, tick = [], machine.tick

    def looking():
        heights.append(
            {one.attributes.get("role_name"): one.transform.location.z
             for one in machine.actors.values()}
        )  # fmt: skip
        return tick()

    monkeypatch.setattr(machine, "tick", looking)
    pipeline = made("crossroads-s1", "route-follower", ego="kinematic")
    joint = pipeline.runner.embedded.co_simulation(
        pipeline.runner.roads_of(rows(pipeline, 1))[0].network, 0, {}
    )
    kind = type(joint)
    monkeypatch.setattr(kind, "present", lambda self, k: np.array([True, k > 10]))
    pipeline.rollout(rows(pipeline, 1))
    role = f"bridgegen.{joint.names[1]}"
    assert all(one[role] < -10 for one in heights[:10])
    assert all(one[role] > -1 for one in heights[10:])


# --- Faults ---------------------------------------------------------------------------------------


def die(machine):
    machine.die()


def hang(machine):
    machine.hangs = True


def refuse(machine):
    machine.refuses = "the server is out of memory"


def lose(machine):
    machine.lose("bridgegen.bv")


def lose_ego(machine):
    machine.lose("hero")


@pytest.mark.parametrize(
    ("fault", "status", "text"),
    [
        (die, 41, "no server answers"),
        (hang, 42, "time-out of 20000ms"),
        (refuse, 40, "out of memory"),
    ],
)
def test_a_server_that_fails_for_good_fails_the_rows(made, machine, fault, status, text):
    pipeline = made("crossroads-s1", "route-follower", ego="kinematic")
    X = rows(pipeline, 3)
    machine.faults[machine.ticks + 40] = fault
    rollout = pipeline.rollout(X)
    assert rollout.status.tolist()[0] == status
    assert (rollout.status[1:] >= 40).all()
    assert text in rollout.messages[0]
    assert np.isfinite(rollout.x).all()


@pytest.mark.parametrize("fault", [lose, lose_ego])
def test_an_actor_that_is_lost_is_tried_again(made, machine, fault):
    pipeline, alone = made("crossroads-s1", "reference"), embedded("crossroads-s1", "reference")
    X = rows(pipeline, 2)
    undisturbed = pipeline.rollout(X)
    machine.faults[machine.ticks + 50] = fault
    disturbed = pipeline.rollout(X)
    assert (disturbed.status == 0).all()
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(disturbed, name), getattr(undisturbed, name), name)
    assert clean(machine)
    assert alone.rollout(X).status[0] == 0


def test_lost_twice_is_failed_with_its_name(made, machine):
    pipeline = made("crossroads-s1", "route-follower", ego="kinematic")
    machine.faults |= {machine.ticks + 30: lose, machine.ticks + 60: lose}
    rollout = pipeline.rollout(rows(pipeline, 2))
    assert rollout.status.tolist() == [40, 0]
    assert "'bv'" in rollout.messages[0]
    assert clean(machine)


def test_a_server_that_comes_back_is_gone_on_with(made, machine, monkeypatch):
    """It dies in the second row, and is there again while we wait: no row is lost."""
    pipeline = made("crossroads-s1", "reference")
    X = rows(pipeline, 2)
    undisturbed = pipeline.rollout(X)
    machine.faults[machine.ticks + 500] = die
    waited = []

    def sleep(seconds):
        waited.append(seconds)
        machine.start()

    monkeypatch.setattr(server.time, "sleep", sleep)
    disturbed = pipeline.rollout(X)
    assert waited
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(disturbed, name), getattr(undisturbed, name), name)
    assert clean(machine)


def test_a_server_that_is_gone_is_not_waited_for_at_every_row(made, machine, monkeypatch):
    pipeline = made("crossroads-s1", "route-follower", ego="kinematic")
    machine.die()
    waited = []
    monkeypatch.setattr(server.time, "sleep", waited.append)
    rollout = pipeline.rollout(rows(pipeline, 4))
    assert (rollout.status == 41).all()
    assert len(waited) == len(server.BACK_OFF)
    machine.start()
    assert (pipeline.rollout(rows(pipeline, 2)).status == 0).all()


def test_it_is_started_by_the_command(machine, monkeypatch, tmp_path):
    """At first, and again when it has died; what was started ends with us."""
    machine.die()
    started = []

    class Process:
        """What `subprocess.Popen` gives."""

        pid = -1

        def __init__(self, command, **options):
            started.append((command, options))
            machine.start()

        def poll(self):
            return 0 if started[-1:] == ["ended"] else None

    monkeypatch.setattr(server.subprocess, "Popen", Process)
    monkeypatch.setattr(server, "_end", lambda process: started.append("ended"))
    logical = load("crossroads-s1")
    access = {"--port": machine.port, "--carla-command": "./CarlaUE4.sh -RenderOffScreen"}
    choice = SimulatorChoice("carla", {"ego": "kinematic"}, access)
    pipeline = Pipeline(
        logical, logical.space(), PipelineOptions(ego="route-follower"), simulator=choice
    )
    assert [one[0] for one in started] == ["./CarlaUE4.sh -RenderOffScreen"]
    machine.faults[machine.ticks + 100] = die
    assert (pipeline.rollout(rows(pipeline, 2)).status == 0).all()
    assert [one[0] for one in started] == [started[0][0], "e", started[0][0]]
    pipeline.runner.simulator._server.close()
    assert started[-1] == "ended"


def test_nobody_is_left_after_twenty_rows_with_faults(machine):
    """Rows of 3 s: 30 m at 10 m/s to the end of the ego's way; every fourth is disturbed."""
    text = scenario(
        ("ego", "bv"),
        start("ego", lane(1, -1, 70.0), 10.0) + start("bv", lane(2, 1, 50.0), 0.0),
    )
    chosen = SimulatorChoice("carla", {}, {"--port": machine.port})
    simulator = chosen.simulator(read(text.encode(), "x.xosc"), "x.xosc", get("route-follower"))
    roads, begun = simulator.roads([crossroads()]), machine.ticks
    simulator.run(roads, np.array([0]), {})
    each = machine.ticks - begun
    for i, fault in enumerate((lose, lose_ego, refuse_once, lose, lose_ego)):
        machine.faults[machine.ticks + 40 + 4 * each * i] = fault
    rollout = simulator.run(roads, np.zeros(20, dtype=np.int64), {})
    assert not machine.faults
    assert (rollout.status == 0).all()
    assert clean(machine)
    np.testing.assert_array_equal(rollout.x, np.broadcast_to(rollout.x[:1], rollout.x.shape))


def refuse_once(machine):
    """Fail one call."""
    raise RuntimeError("rpc::rpc_error during call in function tick")


def test_what_a_killed_run_left_is_swept_away_and_nothing_else(made, machine):
    from .stand_in import Client

    world = Client(port=machine.port).get_world()
    library = world.get_blueprint_library()

    def put(model, role, x, parent=None):
        blueprint = library.find(model)
        blueprint.set_attribute("role_name", role)
        return world.spawn_actor(blueprint, carla.Transform(carla.Location(x=x)), attach_to=parent)

    theirs = put("vehicle.tesla.model3", "hero", 0.0)
    ours = put("vehicle.tesla.model3", "hero", 20.0)
    put("sensor.other.collision", "bridgegen.sensor.other.collision", 0.0, ours)
    put("vehicle.tesla.model3", "bridgegen.bv", 40.0)
    made("crossroads-s1", "route-follower")
    left = [one for one in machine.actors.values() if one.type_id != "traffic.traffic_light"]
    assert left == [theirs]


def test_settings_and_weather_are_put_back(made, machine):
    before = machine.weather
    pipeline = made("crossroads-s1", "route-follower", ego="kinematic")
    machine.settings.no_rendering_mode = True
    pipeline.rollout(rows(pipeline, 1))
    assert not machine.settings.synchronous_mode
    assert machine.weather == before


def test_ctrl_c_puts_them_back_too(made, machine):
    """It comes to the main thread, which stops the simulator; the row ends at the next tick."""
    pipeline = made("crossroads-s1", "route-follower", ego="kinematic")
    machine.faults[machine.ticks + 20] = lambda _: pipeline.runner.simulator.stop()
    ticks = machine.ticks
    rollout = pipeline.rollout(rows(pipeline, 3))
    assert (rollout.status == 40).all()
    assert machine.ticks == ticks + 20
    assert clean(machine)


# --- What is refused ------------------------------------------------------------------------------


def test_towns_are_loaded_by_their_name(machine, made):
    machine.maps["Carla/Maps/Town05"] = machine.maps[DEFAULT_MAP]
    pipeline = made("crossroads-s1", "route-follower", ego="kinematic", map="Town05")
    row = pipeline.space.row({})[np.newaxis]
    assert (pipeline.rollout(row).status == 0).all()
    assert machine.loads[-1] == "Carla/Maps/Town05"
    with refuses(UnknownNameError, "Town5"):
        made("crossroads-s1", "route-follower", map="Town5")


def test_a_run_on_a_town_s_map_is_in_that_town(machine, tmp_path):
    """What the file is called is what counts; another name is roads of ours."""
    machine.maps["Carla/Maps/Town05"] = machine.maps[DEFAULT_MAP]
    for name, loaded in (("Town05", "Carla/Maps/Town05"), ("Mine", "Carla/Maps/OpenDriveMap")):
        path = tmp_path / f"{name}.xodr"
        path.write_text(machine.maps[DEFAULT_MAP])
        logical = load("crossroads-s4")
        road_map = load_map(path, scenario=logical)
        logical = on_map(logical, road_map)
        choice = SimulatorChoice("carla", {"ego": "kinematic"}, {"--port": machine.port})
        pipeline = Pipeline(
            logical,
            logical.space(),
            PipelineOptions(ego="reference"),
            road_map=road_map,
            simulator=choice,
        )
        assert (pipeline.rollout(rows(pipeline, 1)).status == 0).all()
        assert machine.loads[-1] == loaded


def test_a_route_must_be_on_the_servers_map(machine, made):
    other = Pipeline(
        logical := load("cut-in"), logical.space(), PipelineOptions(ego="route-follower")
    )
    from bridgegen.openx.opendrive.write import to_xml

    text = to_xml(other.runner.concrete(other.space.row({})).roads).decode()
    machine.maps["Carla/Maps/Elsewhere"] = text
    pipeline = made("crossroads-s1", "route-follower", map="Elsewhere")
    with refuses(InputError, "route"):
        pipeline.rollout(pipeline.space.row({})[np.newaxis])
    assert clean(machine)


def test_a_model_that_is_not_there(made, machine):
    pipeline = made("crossroads-s1", "route-follower", ego_model="vehicle.tesla.model4")
    with refuses(UnknownNameError):
        pipeline.rollout(rows(pipeline, 1))
    assert clean(machine)


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"ego": "flying"}, "physics"),
        ({"seed": -1}, "0 <= seed"),
        ({"seed": 1.5}, "0 <= seed"),
        ({"agent": "wild"}, "aggressive"),
        ({"map": 5}, "setting"),
    ],
)
def test_settings_out_of_range(made, settings, text):
    with refuses(InputError, text):
        made("crossroads-s1", "route-follower", **settings)


def test_another_time_step_is_refused(machine):
    from dataclasses import replace

    from bridgegen.openx.openscenario import model as osc
    from bridgegen.openx.openscenario.declarations import TIME_STEP

    pipeline = embedded("crossroads-s1", "route-follower")
    storyboard = pipeline.runner.concrete(pipeline.space.row({})).storyboard
    old = storyboard.file_header.properties
    said = tuple(one for one in (old.properties if old else ()) if one.name != TIME_STEP)
    properties = osc.Properties((*said, osc.Property(TIME_STEP, "0.02")))
    other = replace(storyboard, file_header=replace(storyboard.file_header, properties=properties))
    with refuses(InputError, "time_step", "0.05 s"):
        SimulatorChoice("carla", {}, {"--port": machine.port}).simulator(other, "x.xosc")


def test_processes_take_turns_at_a_server(machine):
    """Another one waits for the row to end; in this one, turns nest."""
    code = (
        "from bridgegen.adapters.carla.server import turn_at\n"
        "print('waits', flush=True)\n"
        f"with turn_at('localhost:{machine.port}'): print('has it', flush=True)"
    )
    turn = turn_at(f"localhost:{machine.port}")
    with turn, turn:
        other = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
        assert other.stdout.readline() == "waits\n"
        with pytest.raises(subprocess.TimeoutExpired):
            other.wait(0.3)
    assert other.communicate(timeout=20)[0] == "has it\n"
    assert turn_at(f"localhost:{machine.port}") is turn


def test_a_driver_that_fails_as_it_begins_costs_its_row(made, machine, tmp_path):
    (tmp_path / "bad.py").write_text(
        "class Bad:\n    def reset(self, n, scene): raise OSError('no licence')\n"
        "    def act(self, observation): pass\n"
    )
    pipeline = made("crossroads-s1", f"{tmp_path / 'bad.py'}:Bad")
    rollout = pipeline.rollout(rows(pipeline, 1))
    assert rollout.status[0] == 20
    assert "no licence" in rollout.messages[0]
    assert clean(machine)


def test_a_server_of_another_version_is_refused(made, machine):
    machine.version = "0.10.0"
    with refuses(InputError, "0.10.0", "0.9"):
        made("crossroads-s1", "route-follower")
