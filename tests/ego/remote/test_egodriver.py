"""Drivers behind AlpaSim's egodriver contract: what they are asked, and what may go wrong."""

import time
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

pytest.importorskip("google.protobuf")
grpc = pytest.importorskip("grpc")

from tests.ego.remote.asked import observation, scene  # noqa: E402
from tests.ego.remote.egodriver_server import M, Server, plan  # noqa: E402

from bridgegen.base.errors import InputError  # noqa: E402
from bridgegen.base.protobuf import Schema, WireError, flat  # noqa: E402
from bridgegen.drivers.address import address_of  # noqa: E402
from bridgegen.drivers.driver_process import DriverError, DriverProcess  # noqa: E402
from bridgegen.drivers.interface import Lanes  # noqa: E402
from bridgegen.drivers.remote import process as remote_process  # noqa: E402
from bridgegen.engine.options import PipelineOptions  # noqa: E402
from bridgegen.engine.pipeline import Pipeline  # noqa: E402
from bridgegen.scenario.language.reader import load  # noqa: E402


@pytest.fixture
def server():
    made = []

    def make(*args, **answers):
        made.append(Server(*args, **answers))
        return made[-1]

    yield make
    for one in made:
        one.close()


@pytest.fixture
def driver():
    made = []

    def make(spec, **kwargs):
        made.append(DriverProcess(spec, **kwargs))
        return made[-1]

    yield make
    for one in made:
        one.close()


def start(driver, seed=7):
    driver.reset(1, scene(seed=np.array([seed])))


def seen(h=np.pi / 2, time=0.0, **changed):
    """One scenario: at (10, 20), 3 m/s; the route goes straight on; one track, 8 m ahead."""
    one = np.ones(1)
    ahead = np.arange(40.0)[:, None] * 2.0 * np.array([np.cos(h), np.sin(h)]) + (10.0, 20.0)
    route = np.concatenate([ahead, np.full((40, 1), h), np.zeros((40, 1))], axis=1)[None]
    track = [2.0, 10.0, 28.0, h, 0.0, 1.5, 4.5, 1.8, 0.0, 1.0, 0.0, 1.0, 0.0]
    limits = np.full((1, 40), 13.5)
    none = np.zeros((1, 40), np.bool_)
    lanes = Lanes(limits, limits, none, np.zeros((1, 40, 2, 4)), one, np.zeros((1, 3)), one, one)
    return observation(
        running=(True,), time=time, x=10.0 * one, y=20.0 * one, h=h * one, v=3.0 * one, a=0.5 * one,
        target_speed=one, offset=0 * one, route=route, tracks=np.array([[track]]),
        stop_distance=6.0 * one, light=np.array([1], np.int8), lanes=lanes, **changed
    )  # fmt: skip


def asked(driver, **changed):
    """Ask as the simulator does: views go apart from what is observed."""
    found = seen(**changed)
    return driver._process._driver.act(found), found


def test_a_scenario_is_a_session(server, driver):
    there = server()
    one = driver(there.spec)
    for seed in (7, 8):
        start(one, seed)
    one.close()
    started, closed = there.named("start_session"), there.named("close_session")
    assert [request.random_seed for request in started[1:]] == [7, 8]  # the first only asks
    assert [request.session_uuid for request in closed] == [r.session_uuid for r in started]
    assert len({request.session_uuid for request in started}) == 3
    assert not started[0].rollout_spec.vehicle.available_cameras
    assert (one.traits.period, one.traits.max_rows) == (0.1, 1)


def test_what_a_driver_is_asked(server, driver):
    """Poses in the world, route and motion in the vehicle's frame: x ahead, y left."""
    there = server()
    one = driver(there.spec)
    start(one)
    asked(one)
    asked(one, h=np.pi / 2 + 0.02, time=0.1)
    names = ["submit_egomotion_observation", "submit_route", "drive"]
    assert [name for name, _ in there.calls[-6:]] == 2 * names
    first, second = there.named("submit_egomotion_observation")
    (pose,) = first.trajectory.poses
    assert (pose.timestamp_us, pose.pose.vec.x, pose.pose.vec.y) == (0, 10.0, 20.0)
    assert pose.pose.quat.w == pytest.approx(np.sqrt(0.5))
    assert pose.pose.quat.z == pytest.approx(np.sqrt(0.5))
    assert first.dynamic_states[0].linear_velocity.x == 3.0
    assert first.dynamic_states[0].angular_velocity.z == 0.0
    assert second.dynamic_states[0].angular_velocity.z == pytest.approx(0.2)
    assert second.dynamic_states[0].linear_acceleration.y == pytest.approx(0.6)  # v times the turn
    route = there.named("submit_route")[0].route
    assert [point.x for point in route.waypoints] == pytest.approx(np.arange(20) * 4.0)
    assert [point.y for point in route.waypoints] == pytest.approx(np.zeros(20), abs=1e-5)
    request = there.named("drive")[1]
    assert (request.time_now_us, request.time_query_us) == (100_000, 200_000)
    assert request.renderer_data == b""


def test_the_extension_has_tracks_light_and_limit(server, driver):
    there = server(True)
    one = driver(there.spec)
    start(one)
    asked(one)
    data = M["CarlaRendererData"].FromString(there.named("drive")[0].renderer_data)
    assert (data.ego_traffic_light, data.speed_limit_mps) == (2, 13.5)  # red
    assert data.ego_traffic_light_distance_m == pytest.approx(6.0 + 1.4 + 4.5 / 2)
    (actor,) = data.actors
    assert (actor.track_id, actor.type_id.split(".")[0]) == ("1", "vehicle")
    assert (actor.pose_local_to_aabb.vec.y, actor.aabb.size_x) == (28.0, 4.5)
    assert actor.dynamic_state.linear_velocity.y == 1.5


@pytest.mark.parametrize("h", [0.0, np.pi / 2, -2.5])
def test_a_plan_is_taken_with_its_speeds(server, driver, h):
    """Of a plan of 2 s at a constant acceleration, the speeds are known exactly."""

    def accelerates(request, context):
        answer = plan(request, there.egomotion)
        for k, one in enumerate(answer.trajectory.poses):
            far = 3.0 * 0.1 * k + 0.5 * 2.0 * (0.1 * k) ** 2
            one.pose.vec.x, one.pose.vec.y = 10.0 + far * np.cos(h), 20.0 + far * np.sin(h)
        return answer

    there = server(drive=accelerates)
    one = driver(there.spec)
    start(one)
    found, _ = asked(one, h=h)
    np.testing.assert_allclose(found.time, np.arange(21) * 0.1, atol=1e-9)
    np.testing.assert_allclose(found.v[0], 3.0 + 2.0 * found.time, atol=1e-4)
    np.testing.assert_allclose(found.h[0], h, atol=1e-6)


def test_a_plan_on_the_route_beside_the_vehicle_is_a_path_beside_it(server, driver):
    """The first pose is where the vehicle is: from there to the others it does not go."""

    def aside(request, context):
        answer = plan(request, there.egomotion)
        for one in answer.trajectory.poses[1:]:
            one.pose.vec.y += 0.6
        return answer

    there = server(drive=aside)
    one = driver(there.spec)
    start(one)
    found, _ = asked(one, h=0.0)
    np.testing.assert_allclose(found.v[0], 5.0, atol=1e-4)
    np.testing.assert_allclose(found.y[0], 20.6, atol=1e-5)
    np.testing.assert_allclose(found.x[0], 10.0 + 5.0 * found.time, atol=1e-4)


def aborts(code, text):
    return lambda request, context: context.abort(getattr(grpc.StatusCode, code), text)


def short(n):
    return lambda request, context: M["DriveResponse"](
        trajectory={"poses": [{"timestamp_us": request.time_now_us + k} for k in range(n)]}
    )


def nowhere(request, context):
    pose = {"vec": {"x": np.inf}, "quat": {"w": 1.0}}
    return M["DriveResponse"](
        trajectory={"poses": [{"timestamp_us": k, "pose": pose} for k in range(4)]}
    )


def ends(request, context):
    return M["DriveResponse"](terminate_session=True)


@pytest.mark.parametrize(
    ("answer", "kind", "message"),
    [
        (aborts("INTERNAL", "out of \x1b[31m\nmemory"), "raised", "INTERNAL: out of"),
        (ends, "raised", "ended the session"),
        (lambda request, context: time.sleep(1.0), "timed out", "0.4 s"),
        (b"\xff\xff", "answered nonsense", "byte 0"),
        (b"\x12\x05\x0a", "answered nonsense", "cut off"),
        (b"\x10\x01", "answered nonsense", "trajectory"),
        (M["Empty"](), "answered nonsense", "camera images"),
        (short(2), "answered nonsense", "3 poses"),
        (short(3), "answered nonsense", "quaternion"),
        (nowhere, "answered nonsense", "finite"),
    ],
)
def test_a_bad_answer_costs_one_clear_error(server, driver, answer, kind, message):
    one = driver(server(drive=answer).spec, time_limit=0.4)
    for _ in range(2):
        start(one)
        with refuses(DriverError, message) as error:
            asked(one)
        assert error.value.kind == kind
        assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("answers", "message"),
    [
        ({"get_version": aborts("UNIMPLEMENTED", "no such")}, "egodriver.EgodriverService"),
        ({"start_session": aborts("UNKNOWN", "cameras ['front'] are missing")}, "front"),
        ({"start_session": lambda *_: time.sleep(1.0)}, "start_session"),
    ],
)
def test_a_driver_that_starts_no_session_is_an_error_of_the_users(
    server, driver, answers, message, monkeypatch
):
    """So is a driver that demands cameras: it refuses a session that has none."""
    monkeypatch.setattr("bridgegen.drivers.driver_process.START_SECONDS", 0.5)
    spec = server(**answers).spec
    with refuses(InputError, spec, message) as error:
        driver(spec).start()
    assert len(error.value.problems) == 1


def test_nobody_listens(driver):
    with refuses(InputError, "egodriver://127.0.0.1:9", "port 9"):
        driver("egodriver://127.0.0.1:9").start()


@pytest.mark.parametrize("name", ["", "nowhere", "host:0", "host:99999", "::1:80", ":80"])
def test_an_address_that_is_none_is_refused(name):
    with refuses(InputError, "egodriver://HOST:PORT"):
        address_of(f"egodriver://{name}")


def made(spec, scenario="lead-brakes"):
    logical = load(scenario)
    return Pipeline(logical, logical.space(), PipelineOptions(ego=spec))


def test_a_plan_is_followed_to_the_same_bits_and_a_lost_server_ends_the_job(server, monkeypatch):
    """Five metres a second for twenty seconds are a hundred metres; a lead car stands farther."""
    monkeypatch.setattr(remote_process, "AGAIN_SECONDS", 0.3)
    there = server()
    pipeline = made(there.spec)
    X = np.tile(pipeline.space.row({}), (2, 1))
    first, again = pipeline.rollout(X), made(there.spec).rollout(X)
    assert (first.status == 0).all()
    n = int(first.n_steps[0])
    np.testing.assert_allclose(first.v[:, 0, n - 1], 5.0, atol=0.05)
    for name in ("x", "y", "h", "v", "a"):
        np.testing.assert_array_equal(getattr(again, name), getattr(first, name))
    there.close()
    with refuses(InputError, there.spec):
        pipeline.rollout(X)


NUMBERS = st.fixed_dictionaries({name: st.floats(width=32, allow_nan=False) for name in "wxyz"})


@given(NUMBERS, st.integers(0, 2**64 - 1), st.text(max_size=20), st.booleans())
def test_messages_are_googles(quat, number, text, flag):
    """Written here, read there; written there, read here."""
    schema = Schema(
        "c",
        "Quat: w float 1, x float 2, y float 3, z float 4\nPose: quat Quat 2\n"
        "PoseAtTime: pose Pose 1, timestamp_us fixed64 2\nVersionId: version_id string 1\n"
        "Trajectory: poses PoseAtTime* 1\n"
        "DriveResponse: trajectory Trajectory 2, terminate_session bool 4",
    )
    pose = schema.message("Pose", quat=schema.message("Quat", **quat))
    stamped = schema.message("PoseAtTime", pose=pose, timestamp_us=number)
    plan_ = schema.message("Trajectory", poses=[stamped, stamped])
    data = flat(schema.message("DriveResponse", trajectory=plan_, terminate_session=int(flag)))
    theirs = M["DriveResponse"].FromString(data)
    assert theirs.trajectory.poses[1].timestamp_us == number
    assert {name: getattr(theirs.trajectory.poses[1].pose.quat, name) for name in "wxyz"} == quat
    for ours in (data, theirs.SerializeToString()):
        found = schema.read("DriveResponse", ours)
        assert found["terminate_session"] == flag
        assert found["trajectory"]["poses"][1] == {"pose": {"quat": quat}, "timestamp_us": number}
    assert schema.read("VersionId", M["VersionId"](version_id=text).SerializeToString()) == {
        "version_id": text
    }


@given(st.binary(max_size=60))
def test_any_bytes_are_a_message_or_one_error(data):
    schema = Schema("c", "A: x float 1, n uint32 2, s string 3, b B* 4\nB: t fixed64 1, x double 2")
    with suppress(WireError):
        assert schema.read("A", data).keys() == {"x", "n", "s", "b"}


def test_a_list_has_an_end():
    schema = Schema("c", "A: b B* 1\nB:")
    with pytest.raises(WireError, match="10000"):
        schema.read("A", b"\x0a\x00" * 10_001)
