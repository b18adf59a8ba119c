"""As much of rclpy and of ROS 2's messages as docs/examples/ros2_bridge.py uses, and a stack.

Messages have the fields of ROS 2's definitions, and no others.
"""

import sys
from dataclasses import dataclass, field
from types import ModuleType

import numpy as np


def message(cls):
    return dataclass(slots=True)(cls)


def one(kind):
    return field(default_factory=kind)


@message
class Time:
    sec: int = 0
    nanosec: int = 0


@message
class Header:
    stamp: Time = one(Time)
    frame_id: str = ""


@message
class Vector3:
    x: float = 0.0
    y: float = 0.0
    z: float = 0.0


@message
class Quaternion(Vector3):
    w: float = 1.0


@message
class Pose:
    position: Vector3 = one(Vector3)
    orientation: Quaternion = one(Quaternion)


@message
class PoseStamped:
    header: Header = one(Header)
    pose: Pose = one(Pose)


@message
class PoseWithCovariance:
    pose: Pose = one(Pose)
    covariance: list = one(list)


@message
class Twist:
    linear: Vector3 = one(Vector3)
    angular: Vector3 = one(Vector3)


@message
class TwistWithCovariance:
    twist: Twist = one(Twist)
    covariance: list = one(list)


@message
class Odometry:
    header: Header = one(Header)
    child_frame_id: str = ""
    pose: PoseWithCovariance = one(PoseWithCovariance)
    twist: TwistWithCovariance = one(TwistWithCovariance)


@message
class Path:
    header: Header = one(Header)
    poses: list = one(list)


@message
class Clock:
    clock: Time = one(Time)


@message
class Empty:
    pass


@message
class Float64:
    data: float = 0.0


@message
class AckermannDrive:
    steering_angle: float = 0.0
    steering_angle_velocity: float = 0.0
    speed: float = 0.0
    acceleration: float = 0.0
    jerk: float = 0.0


@message
class AckermannDriveStamped:
    header: Header = one(Header)
    drive: AckermannDrive = one(AckermannDrive)


class Publisher:
    def __init__(self, kind, take):
        self.kind, self.take = kind, take

    def publish(self, message):
        assert type(message) is self.kind
        self.take(message)


class Stack:
    """A node beside the bridge: cruises. It answers when the clock has moved, not before."""

    def __init__(self):
        self.heard = []
        self.is_mute = False

    def create_publisher(self, kind, topic, queue):
        return Publisher(kind, lambda message: self.heard.append((topic, message)))

    def create_subscription(self, kind, topic, callback, queue):
        assert (kind, topic) == (AckermannDriveStamped, "/bridgegen/command")
        self.callback = callback

    def count_publishers(self, topic):
        return 1

    def last(self, topic):
        return next(message for name, message in reversed(self.heard) if name == topic)

    def spin_once(self, node, timeout_sec):
        if self.is_mute or self.heard[-1][0] != "/clock":
            return
        command = AckermannDriveStamped(Header(self.last("/clock").clock))
        wanted = self.last("/bridgegen/target_speed").data
        is_at = self.last("/bridgegen/ego").twist.twist.linear.x
        command.drive.acceleration = float(np.float32(np.clip(wanted - is_at, -3.0, 2.0)))
        self.heard.append(("/bridgegen/command", command))
        self.callback(command)


def install(monkeypatch):
    """Let the modules be imported; return the stack."""
    stack = Stack()
    modules = {
        "rclpy": {
            "init": lambda: None, "create_node": lambda name: stack, "spin_once": stack.spin_once,
        },
        "ackermann_msgs.msg": {"AckermannDriveStamped": AckermannDriveStamped},
        "builtin_interfaces.msg": {"Time": Time},
        "geometry_msgs.msg": {"PoseStamped": PoseStamped},
        "nav_msgs.msg": {"Odometry": Odometry, "Path": Path},
        "rosgraph_msgs.msg": {"Clock": Clock},
        "std_msgs.msg": {"Empty": Empty, "Float64": Float64},
    }  # fmt: skip
    for name, content in modules.items():
        module = ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)
        parent = name.partition(".")[0]
        if parent != name:
            monkeypatch.setitem(sys.modules, parent, ModuleType(parent))
    return stack
