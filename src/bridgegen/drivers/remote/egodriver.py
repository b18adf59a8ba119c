"""Drivers that serve AlpaSim's contract ``egodriver.EgodriverService``, over gRPC.

Needs the extra ``egodriver``. A scenario is a session; every 0.1 s, the driver is sent its pose and
motion and the route, 20 points 4 m apart, and asked for a plan, which is followed as other plans
are. The contract has cameras and nothing for objects, lights and speed limits; BridgeGen renders no
images. A server that declares carla-driver-interface's extension of it is sent those, too, as its
``renderer_data``: the confirmed tracks, the light on the route, the posted limit.

Source: NVlabs/alpasim 0.55, egodriver.proto, common.proto, CONTRIBUTING.md (coordinate systems);
carla-driver-interface 2.3, carla_driver.proto.
"""

import math
import time
import uuid
import weakref
from contextlib import suppress
from typing import Any

import numpy as np

from bridgegen.base.errors import InputError
from bridgegen.base.extras import require
from bridgegen.base.processes.isolated import CallError
from bridgegen.base.protobuf import Parts, Schema, WireError, flat
from bridgegen.drivers import kinds
from bridgegen.drivers.address import Grpc
from bridgegen.drivers.interface import Observation, Scene, Trajectory
from bridgegen.drivers.remote.messages import MAX_FRAME, NONSENSE, RAISED
from bridgegen.drivers.remote.wire import CONNECT_SECONDS, END_SECONDS, named, one_line
from bridgegen.scenario.participants import OBJECT_CLASSES

_SERVICE = "egodriver.EgodriverService"
_EXTENSION = "carla-driver-interface-contract"
"""The key of gRPC's metadata by which carla-driver-interface declares its revision."""

_CONTRACT = Schema(
    "egodriver",
    """
Empty:
Vec3: x float 1, y float 2, z float 3
Quat: w float 1, x float 2, y float 3, z float 4
Pose: vec Vec3 1, quat Quat 2
PoseAtTime: pose Pose 1, timestamp_us fixed64 2
Trajectory: poses PoseAtTime* 1
DynamicState: angular_velocity Vec3 1, linear_velocity Vec3 2, linear_acceleration Vec3 3
RolloutSpec: vehicle Empty 1
DriveSessionRequest: session_uuid string 1, random_seed fixed64 2, rollout_spec RolloutSpec 5
DriveSessionCloseRequest: session_uuid string 1
RolloutEgoTrajectory: session_uuid string 1, trajectory Trajectory 3,
    dynamic_states DynamicState* 5
Route: waypoints Vec3* 1, timestamp_us fixed64 2
RouteRequest: session_uuid string 1, route Route 3
DriveRequest: session_uuid string 1, time_now_us fixed64 3, time_query_us fixed64 4,
    renderer_data CarlaRendererData 5
DriveResponse: trajectory Trajectory 2, terminate_session bool 4
VersionId: version_id string 1
AABB: size_x float 1, size_y float 2, size_z float 3
CarlaActorState: track_id string 1, type_id string 2, pose_local_to_aabb Pose 3, aabb AABB 4,
    dynamic_state DynamicState 5
CarlaRendererData: snapshot_timestamp_us fixed64 1, ego_traffic_light uint32 5,
    ego_traffic_light_distance_m float 6, speed_limit_mps float 7, actors CarlaActorState* 8
""",
)
_message = _CONTRACT.message

_LIGHTS = (1, 2, 2, 3, 4)  # of the extension: none, red (and red with yellow), yellow, green
_UNIT = 0.01  # largest difference of a quaternion's length from 1, of float32's and rounded ones


class Calls:
    """A server's calls, over a channel of its own.

    Args:
        address: of the server.
        error: is raised if a call is not answered.

    Attributes:
        error: likewise.
        name: what the driver calls itself.
        extends: whether it declares carla-driver-interface's extension.

    Raises:
        InputError: the extra is missing, or no such service answers there.
    """

    def __init__(self, address: Grpc, error: type[CallError]) -> None:
        require("egodriver", "a driver behind egodriver://")
        import grpc

        host = f"[{address.host}]" if ":" in address.host else address.host
        self._channel = grpc.insecure_channel(
            f"dns:///{host}:{address.port}",
            [
                ("grpc.max_receive_message_length", MAX_FRAME),
                ("grpc.enable_http_proxy", 0),  # it connects to the named host, through no proxy
                ("grpc.use_local_subchannel_pool", 1),  # a new one connects at once
                ("grpc.enable_retries", 0),
            ],
        )
        self.error, self._open = error, list[str]()
        self._end = weakref.finalize(self, _close, self._channel, self._open)
        self._metadata: tuple[tuple[str, Any], ...] = ()
        try:
            answer, call = self._of("get_version").with_call(b"", timeout=CONNECT_SECONDS)
            told = _CONTRACT.read("VersionId", answer)["version_id"]
        except (grpc.RpcError, WireError) as problem:
            self._end()
            where = f"{named(address)} serves no {_SERVICE}"
            raise InputError(f"{where}: {_told(problem)}") from None
        self.name = one_line(told)[:80] or "the driver"
        self._metadata = tuple(item for item in call.initial_metadata() if item[0] == _EXTENSION)
        self.extends = bool(self._metadata)

    @property
    def is_open(self) -> bool:
        """Whether it has not been closed."""
        return self._end.alive

    def kill(self) -> None:
        """Close the channel from another thread: a waiting ``ask`` raises `CallError`."""
        self._channel.close()

    def close(self) -> None:
        """Close the session and the channel, as does this object's deletion."""
        self._end()

    def allow(self, seconds: float) -> None:
        """Set the time limit of all calls from now on [s]."""
        self._seconds, self._until = seconds, time.monotonic() + seconds

    def begin(self, seed: int) -> str:
        """Start a session, after what is open was closed; return its id; raise `CallError`."""
        for session in self._open[:]:
            self._open.remove(session)
            self.ask("close_session", _message("DriveSessionCloseRequest", session_uuid=session))
        session = str(uuid.uuid4())  # several workers may ask one server
        spec = _message("RolloutSpec", vehicle=[])
        about = {"session_uuid": session, "random_seed": seed}
        request = _message("DriveSessionRequest", **about, rollout_spec=spec)
        self.ask("start_session", request)
        self._open.append(session)
        return session

    def ask(self, method: str, message: Parts) -> bytes:
        """Return what a method answers to a message.

        Raises:
            CallError: nothing. The channel is closed, unless the driver reports an error.
        """
        import grpc

        seconds = max(self._until - time.monotonic(), 0.0)
        try:
            call = self._of(method)
            return bytes(call(flat(message), timeout=seconds, metadata=self._metadata))
        except grpc.RpcError as problem:
            code = problem.code()
            if code.name not in ("DEADLINE_EXCEEDED", "UNAVAILABLE", "CANCELLED"):
                raise self.error(RAISED, f"{self.name}, {method}: {_told(problem)}") from None
            self._open.clear()  # who does not answer is not asked to close
            self._end()
            if code.name == "DEADLINE_EXCEEDED":
                text = f"no answer to {method} within {self._seconds:g} s"
                raise self.error("timed out", text) from None
            raise self.error("died", f"{method}: {_told(problem)}") from None
        except ValueError as problem:  # closed from another thread before the call
            raise self.error("died", f"{method}: {problem}") from None

    def _of(self, method: str) -> Any:
        return self._channel.unary_unary(f"/{_SERVICE}/{method}")


def _close(channel: Any, sessions: list[str]) -> None:
    """Close sessions and their channel."""
    import grpc

    call = channel.unary_unary(f"/{_SERVICE}/close_session")
    for session in sessions:
        with suppress(grpc.RpcError, ValueError):
            request = _message("DriveSessionCloseRequest", session_uuid=session)
            call(flat(request), timeout=END_SECONDS)
    channel.close()


def _told(problem: Any) -> str:
    """Return what went wrong in a call, in a line."""
    is_ours = isinstance(problem, WireError)
    return one_line(str(problem) if is_ours else f"{problem.code().name}: {problem.details()}")


class Egodriver:
    """A driver behind the contract, one session for each scenario.

    Args:
        calls: of its server.
        seconds: time limit of each of its calls [s]; new ones hold from the next call on.

    Raises:
        CallError: it starts no session without cameras.
    """

    wants = ("lanes", "seed")
    period = 0.1
    """AlpaSim's ``control_timestep_us``, as its base configuration has it [s]."""
    max_rows = 1

    def __init__(self, calls: Calls, seconds: float) -> None:
        self.seconds, self._calls = seconds, calls
        calls.allow(seconds)
        try:
            calls.begin(0)
        except CallError as error:
            raise type(error)(
                error.kind, f"a session without cameras (none are rendered) must start: {error}"
            ) from None

    def reset(self, n: int, scene: Scene) -> None:
        """See `BatchDriver`; raise `CallError`."""
        self._calls.allow(self.seconds)
        self._session = self._calls.begin(int(scene.seed[0]))
        self._scene, self._before = scene, (math.nan, 0.0)

    def act(self, observation: Observation) -> Trajectory:
        """See `BatchDriver`; raise `CallError`, also where the answer is no plan."""
        calls, session = self._calls, self._session
        calls.allow(self.seconds)
        now = round(1e6 * observation.time)
        place = _pose(*(float(each[0]) for each in (observation.x, observation.y, observation.h)))
        pose = _message("PoseAtTime", pose=place, timestamp_us=now)
        egomotion = _message(
            "RolloutEgoTrajectory",
            session_uuid=session,
            trajectory=_message("Trajectory", poses=[pose]),
            dynamic_states=[self._motion(observation)],
        )
        route = _message("Route", waypoints=_waypoints(observation), timestamp_us=now)
        request = _message(
            "DriveRequest",
            session_uuid=session,
            time_now_us=now,
            time_query_us=now + round(1e6 * self.period),
            renderer_data=self._around(observation, now) if calls.extends else None,
        )
        calls.ask("submit_egomotion_observation", egomotion)
        calls.ask("submit_route", _message("RouteRequest", session_uuid=session, route=route))
        answer = calls.ask("drive", request)
        try:
            response = _CONTRACT.read("DriveResponse", answer)
            if response["terminate_session"]:
                raise calls.error(RAISED, f"{calls.name} ended the session")
            return _plan(response["trajectory"]["poses"], now)
        except WireError as error:
            raise calls.error(NONSENSE, f"{calls.name}, drive: {error}") from None

    def _motion(self, seen: Observation) -> Parts:
        """Return the motion in the frame of the vehicle; its turn is that since the last call."""
        v, h = float(seen.v[0]), float(seen.h[0])
        before, self._before = self._before, (seen.time, h)
        since, turned = seen.time - before[0], math.remainder(h - before[1], 2.0 * math.pi)
        rate = turned / since if since > 0.0 else 0.0
        return _message(
            "DynamicState",
            angular_velocity=_vector(0.0, 0.0, rate),
            linear_velocity=_vector(v),
            linear_acceleration=_vector(float(seen.a[0]), v * rate),
        )

    def _around(self, seen: Observation, now: int) -> Parts:
        """Return what the extension has: tracks, the light ahead, the speed limit."""
        assert seen.lanes is not None
        limit, light = float(seen.lanes.speed_limit[0, 0]), int(seen.light[0])
        ahead = float(seen.stop_distance[0]) + self._scene.centre + 0.5 * self._scene.length
        return _message(
            "CarlaRendererData",
            snapshot_timestamp_us=now,
            ego_traffic_light=_LIGHTS[light],
            ego_traffic_light_distance_m=ahead if light and math.isfinite(ahead) else -1.0,
            speed_limit_mps=limit if math.isfinite(limit) else 0.0,
            actors=[
                _actor(m + 1, track)
                for m, track in enumerate(seen.tracks[0].tolist())
                if track[0] >= 2
            ],
        )


def _actor(number: int, track: list[float]) -> Parts:
    """Return a track as an actor; its velocity is that in the world."""
    x, y, heading, vx, vy, length, width = track[1:8]
    height = kinds.HEIGHTS[int(track[8])]
    return _message(
        "CarlaActorState",
        track_id=str(number),
        type_id=OBJECT_CLASSES[int(track[8])].carla[0],
        pose_local_to_aabb=_pose(x, y, heading, 0.5 * height),
        aabb=_message("AABB", size_x=length, size_y=width, size_z=height),
        dynamic_state=_message("DynamicState", linear_velocity=_vector(vx, vy)),
    )


def _waypoints(seen: Observation) -> list[Parts]:
    """Return every second point of the route, in the frame of the vehicle."""
    cos, sin = math.cos(seen.h[0]), math.sin(seen.h[0])
    ahead = seen.route[0, ::2, :2] - (seen.x[0], seen.y[0])
    return [_vector(cos * x + sin * y, cos * y - sin * x) for x, y in ahead.tolist()]


def _plan(poses: list[dict[str, Any]], now: int) -> Trajectory:
    """Return the part of a plan from now on; its speeds are those along its path.

    Raises:
        WireError: it is too short, or has a pose without a direction.
    """
    ahead = [pose for pose in poses if pose["timestamp_us"] >= now]
    if len(ahead) < 3:
        raise WireError(
            f"a plan must have 3 poses from now on, got {len(ahead)} of {len(poses)}; a driver "
            "that waits for camera images plans nothing, and none are rendered"
        )
    when = np.array([1e-6 * (pose["timestamp_us"] - now) for pose in ahead])
    if not (np.diff(when) > 0.0).all():
        raise WireError("a plan's times must increase")
    x, y = (np.array([pose["pose"]["vec"][k] for pose in ahead]) for k in "xy")
    turn = np.array([[pose["pose"]["quat"][k] for k in "wxyz"] for pose in ahead])
    off = np.abs(np.hypot(np.hypot(turn[:, 0], turn[:, 1]), np.hypot(turn[:, 2], turn[:, 3])) - 1)
    if not np.isfinite(x + y).all():
        raise WireError("a pose's place must be finite")
    if not (off <= _UNIT).all():  # nor is it where something is not finite
        raise WireError(f"a pose's quaternion must have the length 1, got {turn[np.argmax(off)]}")
    w, i, j, k = turn.T
    h = np.unwrap(np.arctan2(2.0 * (w * k + i * j), 1.0 - 2.0 * (j * j + k * k)))
    middle = h[:-1] + 0.5 * np.diff(h)
    far = np.cumsum(np.diff(x) * np.cos(middle) + np.diff(y) * np.sin(middle))
    # Of the parabola through three states: exact where the plan's acceleration is constant.
    v = np.gradient(far, when[1:], edge_order=2) if len(far) > 2 else np.gradient(far, when[1:])
    # The first pose is the one that was sent. Others may lie on the route, beside it: that jump is
    # no path. So the path goes straight back from the second one; the controller steers towards it.
    before = when[1] - when[0]
    v = np.maximum(np.append(v[0] - before * (v[1] - v[0]) / (when[2] - when[1]), v), 0.0)
    back, h[0] = 0.5 * before * (v[0] + v[1]), h[1]
    x[0], y[0] = x[1] - back * np.cos(h[1]), y[1] - back * np.sin(h[1])
    return Trajectory(when, x[np.newaxis], y[np.newaxis], h[np.newaxis], v[np.newaxis])


def _vector(x: float, y: float = 0.0, z: float = 0.0) -> Parts:
    return _message("Vec3", x=x, y=y, z=z)


def _pose(x: float, y: float, heading: float, z: float = 0.0) -> Parts:
    turn = _message("Quat", w=math.cos(0.5 * heading), x=0.0, y=0.0, z=math.sin(0.5 * heading))
    return _message("Pose", vec=_vector(x, y, z), quat=turn)
