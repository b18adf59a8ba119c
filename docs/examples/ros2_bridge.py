"""Autoware's planning as a driver, without ROS on this side: CDR over Zenoh.

zenoh-bridge-ros2dds            # beside Autoware; it listens on port 7447
pip install eclipse-zenoh       # beside BridgeGen
bridgegen search my.yaml --ego ros2_bridge.py:Autoware --workers 1 --time-limit 90

ZENOH_CONNECT is zenoh-bridge-ros2dds's address if it is not tcp/127.0.0.1:7447. Published at each
instant, every 0.1 s:

    /tf                                     tf2_msgs/TFMessage, map -> base_link (the rear axle)
    /localization/kinematic_state           nav_msgs/Odometry
    /localization/acceleration              geometry_msgs/AccelWithCovarianceStamped
    /perception/object_recognition/objects  autoware_perception_msgs/PredictedObjects
    /clock                                  rosgraph_msgs/Clock
    /planning/mission_planning/goal         geometry_msgs/PoseStamped, at the start only

Then a new /planning/trajectory (autoware_planning_msgs/Trajectory) is awaited, and followed. Until
the first one comes the first instant is repeated: the clock runs, the world stands. The clock is
the system's at the begin, and never goes back: a scenario begins a second after the last one.
"""

import json
import math
import os
import struct
import threading
import time

import numpy as np

from bridgegen.drivers.interface import Trajectory

START, ANSWER = 60.0, 5.0  # s, of real time: until the first trajectory, and each later one
LAG = 300_000_000  # ns that a trajectory's stamp may be behind the clock: nodes work in turn
STILL, NEAR = 0.05, 2.0  # m/s: slower, a plan stands; m: farther off, it is of another scenario
STEP, STEPS = 0.5, 21  # s, of the predicted paths of objects
HEIGHT = 1.5  # m, of an object: tracks have none
LABELS = (1, 2, 3, 5, 6, 7, 8, 0)  # ObjectClassification's, by BridgeGen's class
NONE, ZEROS = (0.0,) * 3, (0.0,) * 36

# --- Messages: their fields' types in the order of ROS 2's and autoware_msgs' definitions ---------

SCALARS = {"uint8": "B", "int32": "i", "uint32": "I", "float32": "f", "float64": "d"}
TYPES = {
    "Time": "int32 uint32",  # and a Duration
    "Header": "Time string",
    "Vector3": "float64 float64 float64",
    "Point32": "float32 float32 float32",
    "Quaternion": "float64 float64 float64 float64",
    "Pose": "Vector3 Quaternion",
    "PoseWithCovariance": "Pose float64*36",
    "TwistWithCovariance": "Vector3 Vector3 float64*36",  # and an AccelWithCovariance
    "TransformStamped": "Header string Vector3 Quaternion",
    "TFMessage": "TransformStamped[]",
    "Clock": "Time",
    "PoseStamped": "Header Pose",
    "Odometry": "Header string PoseWithCovariance TwistWithCovariance",
    "AccelWithCovarianceStamped": "Header TwistWithCovariance",
    "ObjectClassification": "uint8 float32",
    "PredictedPath": "Pose[] Time float32",
    "Kinematics": "PoseWithCovariance TwistWithCovariance TwistWithCovariance PredictedPath[]",
    "Shape": "uint8 Point32[] Vector3",
    "PredictedObject": "uint8*16 float32 ObjectClassification[] Kinematics Shape",
    "PredictedObjects": "Header PredictedObject[]",
    "TrajectoryPoint": "Time Pose float32 float32 float32 float32 float32 float32",
    "Trajectory": "Header TrajectoryPoint[]",
}
HEAD = b"\0\1\0\0"  # plain CDR, little-endian


def encode(kind, value) -> bytes:
    """Return a message, nested tuples of its fields, as CDR."""
    out = bytearray()
    put(kind, value, out)
    return HEAD + bytes(out)


def fields(kind):
    name, _, number = kind.partition("*")
    return [name] * int(number) if number else TYPES[kind].split()


def put(kind, value, out) -> None:
    if kind in SCALARS:
        code = SCALARS[kind]
        out += bytes(-len(out) % struct.calcsize(code)) + struct.pack("<" + code, value)
    elif kind == "string":
        put("uint32", len(value.encode()) + 1, out)
        out += value.encode() + b"\0"
    elif kind.endswith("[]"):
        put("uint32", len(value), out)
        for one in value:
            put(kind[:-2], one, out)
    else:
        for each, one in zip(fields(kind), value, strict=True):
            put(each, one, out)


def decode(kind, data):
    """Return the message as nested tuples; ValueError if it is not of this type."""
    if data[:2] != HEAD[:2]:
        raise ValueError(f"a {kind} must be plain CDR, little-endian, got {data[:4].hex()}")
    try:
        return get(kind, data[4:], 0)[0]
    except (struct.error, UnicodeDecodeError) as error:
        raise ValueError(f"{len(data)} bytes are no {kind}: {error}") from None


def get(kind, data, at):
    """Return what begins at a place, and the place after it."""
    if kind in SCALARS:
        size = struct.calcsize(SCALARS[kind])
        at += -at % size
        return struct.unpack_from("<" + SCALARS[kind], data, at)[0], at + size
    if kind == "string":
        n, at = get("uint32", data, at)
        return bytes(data[at : at + n]).decode().rstrip("\0"), at + n
    if kind.endswith("[]"):
        n, at = get("uint32", data, at)
    found = []
    for each in [kind[:-2]] * min(n, len(data)) if kind.endswith("[]") else fields(kind):
        one, at = get(each, data, at)
        found.append(one)
    return tuple(found), at


class Autoware:
    max_rows, period, wants = 1, 0.1, ("lanes",)  # a stack drives one car

    def __init__(self) -> None:
        import zenoh

        config, address = zenoh.Config(), os.environ.get("ZENOH_CONNECT", "tcp/127.0.0.1:7447")
        config.insert_json5("connect/endpoints", json.dumps([address]))
        config.insert_json5("mode", '"client"')  # which neither listens nor looks around
        self.session = zenoh.open(config)
        self.arrived, self.data = threading.Condition(), b""
        self.subscriber = self.session.declare_subscriber("planning/trajectory", self.take)
        self.clock = self.begin = time.time_ns()

    def take(self, sample) -> None:
        with self.arrived:
            self.data = sample.payload.to_bytes()
            self.arrived.notify()

    def reset(self, n, scene) -> None:
        self.begin, self.last = self.clock + 10**9, None

    def act(self, o):
        self.clock = self.begin + round(1e9 * o.time)
        self.tell(o)
        points = self.awaited(ANSWER) if self.last else self.first(o)
        if not points:
            wait = ANSWER if self.last else START
            raise TimeoutError(f"no new /planning/trajectory at the ego within {wait:g} s")
        self.last = o.time, float(o.h[0])
        return followed(points, *self.place)

    def first(self, o):
        """Return the points of the first trajectory: the clock runs, the world stands."""
        goal, points = pose(*o.lanes.goal[0].tolist()), None
        for k in range(round(START / self.period)):
            if k % 50 == 0:  # again: it may have come before Autoware knew where it is
                self.publish("planning/mission_planning/goal", "PoseStamped", self.at("map"), goal)
            if points := self.awaited(self.period):
                break
            self.begin = self.clock = self.clock + round(1e9 * self.period)
            self.tell(o)
        return points

    def awaited(self, seconds):
        """Return the points of a trajectory that comes after this instant; None if none does."""
        until = time.monotonic() + seconds
        with self.arrived:
            while self.data or self.arrived.wait(until - time.monotonic()):
                (stamp, _), points = decode("Trajectory", self.data)
                near = (math.dist(p[1][0][:2], self.place) < NEAR for p in points)
                if stamp[0] * 10**9 + stamp[1] >= self.clock - LAG and any(near):
                    return points
                self.data = b""
        return None

    def tell(self, o) -> None:
        """Publish an instant, its clock last."""
        x, y, h, v, a = (float(one[0]) for one in (o.x, o.y, o.h, o.v, o.a))
        self.data, self.place = b"", (x, y)
        place, turn = pose(x, y, h)
        since, before = self.last or (-math.inf, h)
        rate = math.remainder(h - before, math.tau) / (o.time - since)
        self.publish("tf", "TFMessage", [(self.at("map"), "base_link", place, turn)])
        motion = (v, 0.0, 0.0), (0.0, 0.0, rate), ZEROS
        state = (self.at("map"), "base_link", ((place, turn), ZEROS), motion)
        self.publish("localization/kinematic_state", "Odometry", *state)
        accel = self.at("base_link"), ((a, 0.0, 0.0), NONE, ZEROS)
        self.publish("localization/acceleration", "AccelWithCovarianceStamped", *accel)
        known = [(k, track) for k, track in enumerate(o.tracks[0].tolist()) if track[0] >= 2.0]
        objects = self.at("map"), [tracked(k, track) for k, track in known]
        self.publish("perception/object_recognition/objects", "PredictedObjects", *objects)
        self.publish("clock", "Clock", divmod(self.clock, 10**9))

    def at(self, frame):
        return divmod(self.clock, 10**9), frame

    def publish(self, key, kind, *fields) -> None:
        self.session.put(key, encode(kind, fields))


def pose(x, y, h):
    return (x, y, 0.0), (0.0, 0.0, math.sin(h / 2.0), math.cos(h / 2.0))


def tracked(number, track):
    """Return a track as a PredictedObject that goes straight on as it does now."""
    _, x, y, h, vx, vy, length, width, kind, confidence = track[:10]
    along, left = math.cos(h) * vx + math.sin(h) * vy, math.cos(h) * vy - math.sin(h) * vx
    path = [pose(x + vx * t, y + vy * t, h) for t in (STEP * k for k in range(STEPS))]
    paths = [(path, (0, round(1e9 * STEP)), 1.0)]
    motion = (path[0], ZEROS), ((along, left, 0.0), NONE, ZEROS), (NONE, NONE, ZEROS), paths
    label, box = (LABELS[int(kind)], confidence), (0, [], (length, width, HEIGHT))
    return number.to_bytes(16, "big"), confidence, [label], motion, box


def followed(points, x, y):
    """Return the plan from the place beside the ego on; time_from_start need not be filled."""
    path = np.array([(x, y, yaw(*turn), v) for _, ((x, y, _), turn), v, *_ in points])
    path[:, 2] = np.unwrap(path[:, 2])
    if path[:, 3].min() < 0.0:
        raise ValueError(f"a trajectory must go forward, got {path[:, 3].min():g} m/s")
    path = path[np.append(True, np.hypot(*np.diff(path[:, :2], axis=0).T) > 1e-3)]
    if len(path) < 2:
        raise ValueError(f"a trajectory must have two places, got {len(points)} points at one")
    step = np.diff(path, axis=0)
    ahead = ((x, y) - path[:-1, :2]) * step[:, :2]
    share = ahead.sum(axis=1) / (step[:, :2] ** 2).sum(axis=1)
    beside = path[:-1] + np.clip(share, 0.0, 1.0)[:, None] * step
    i = int(np.argmin(np.hypot(beside[:, 0] - x, beside[:, 1] - y)))
    path = np.vstack([beside[i], path[i + 1 : i + 900]])  # BridgeGen takes 1000
    far = np.hypot(*np.diff(path[:, :2], axis=0).T)
    path, far = path[np.append(True, far > 1e-3)], far[far > 1e-3]
    mean = 0.5 * (path[:-1, 3] + path[1:, 3])
    n = int(np.argmax(np.append(mean < STILL, True)))
    seconds = np.cumsum(np.concatenate([[0.0], far[:n] / mean[:n], [10.0]]))  # and there it stands
    found = np.vstack([path[: n + 1], path[n] * (1.0, 1.0, 1.0, 0.0)])
    return Trajectory(time=seconds, **dict(zip("xyhv", found.T[:, None], strict=True)))


def yaw(x, y, z, w):
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
