"""A ROS 2 stack as a driver: one scenario at a time, in lock-step by /clock.

source /opt/ros/jazzy/setup.bash    # and start your stack with use_sim_time:=true
bridgegen search cut-in --ego "exec:python3 server.py ros2_bridge.py:Ros2Driver"

Here, python3 is ROS's; server.py and messages.py are drivers/remote's, copied beside this
file where BridgeGen is not installed for it. Published at each instant, in this order:

    /bridgegen/reset          std_msgs/Empty       only when a scenario begins: forget the last one
    /bridgegen/target_speed   std_msgs/Float64     what the scenario asks for [m/s]
    /bridgegen/stop_distance  std_msgs/Float64     to the line of a light, unless it is green [m]
    /bridgegen/route          nav_msgs/Path        the route ahead, a pose every 2 m
    /bridgegen/tracks         nav_msgs/Odometry    one for each track; child_frame_id is its name
    /bridgegen/ego            nav_msgs/Odometry    rear axle's centre
    /clock                    rosgraph_msgs/Clock

Then the command of that instant is awaited: header.stamp is the clock's.

    /bridgegen/command        ackermann_msgs/AckermannDriveStamped    acceleration, steering_angle

The clock never goes back: the next scenario begins a second after the last one.
"""

import math
import time

import rclpy
from ackermann_msgs.msg import AckermannDriveStamped
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry, Path
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Empty, Float64

FRAME = "map"
WHEEL_BASE = 2.8  # m, of the stack's vehicle: what its steering angle stands for
START, ANSWER = 30.0, 5.0  # s, of real time: until the stack is there, and for a command
QUEUE = 100
RED_TO_YELLOW = (1, 2, 3)  # states of a light that has one stop


class Ros2Driver:
    max_rows = 1  # a stack drives one car

    def __init__(self) -> None:
        rclpy.init()
        self.node = node = rclpy.create_node("bridgegen")
        self.clock = node.create_publisher(Clock, "/clock", QUEUE)
        kinds = {
            "reset": Empty, "target_speed": Float64, "stop_distance": Float64, "route": Path,
            "tracks": Odometry, "ego": Odometry,
        }  # fmt: skip
        self.topics = {
            name: node.create_publisher(kind, f"/bridgegen/{name}", QUEUE)
            for name, kind in kinds.items()
        }
        node.create_subscription(AckermannDriveStamped, "/bridgegen/command", self.take, QUEUE)
        self.command, self.start, self.stamp = None, 0, Time()
        deadline = time.monotonic() + START
        while not node.count_publishers("/bridgegen/command"):
            if time.monotonic() > deadline:
                raise TimeoutError(f"nobody publishes /bridgegen/command within {START:g} s")
            rclpy.spin_once(node, timeout_sec=0.1)

    def take(self, command: AckermannDriveStamped) -> None:
        self.command = command

    def reset(self, n, scene) -> None:
        self.names = scene.names
        self.start = self.nanoseconds(self.stamp) + 1_000_000_000
        self.topics["reset"].publish(Empty())

    def act(self, observation):
        o = observation
        nanoseconds = self.start + round(1e9 * o.time)
        self.stamp = Time(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)
        self.topics["target_speed"].publish(Float64(data=float(o.target_speed[0])))
        stop = float(o.stop_distance[0]) if o.light[0] in RED_TO_YELLOW else math.inf
        self.topics["stop_distance"].publish(Float64(data=stop))
        route = Path()
        route.header.frame_id, route.header.stamp = FRAME, self.stamp
        for x, y, h, _ in o.route[0].tolist():
            pose = PoseStamped()
            pose.header = route.header
            place(pose.pose, x, y, h)
            route.poses.append(pose)
        self.topics["route"].publish(route)
        for name, track in zip(self.names, o.tracks[0].tolist(), strict=True):
            state, x, y, h, vx, vy = track[:6]
            if state >= 2.0:  # confirmed
                along = math.cos(h) * vx + math.sin(h) * vy
                left = math.cos(h) * vy - math.sin(h) * vx
                self.topics["tracks"].publish(self.odometry(name, x, y, h, along, left))
        x, y, h, v = (float(one[0]) for one in (o.x, o.y, o.h, o.v))
        self.topics["ego"].publish(self.odometry("ego", x, y, h, v, 0.0))
        self.clock.publish(Clock(clock=self.stamp))
        drive = self.awaited().drive
        return [drive.acceleration], [math.tan(drive.steering_angle) / WHEEL_BASE]

    def awaited(self) -> AckermannDriveStamped:
        """Return the command of this instant."""
        deadline = time.monotonic() + ANSWER
        while True:
            rclpy.spin_once(self.node, timeout_sec=0.1)
            if self.command is not None and self.command.header.stamp == self.stamp:
                return self.command
            if time.monotonic() > deadline:
                raise TimeoutError(f"no command of this instant within {ANSWER:g} s")

    def odometry(self, name: str, x: float, y: float, h: float, v: float, left: float) -> Odometry:
        found = Odometry()
        found.header.frame_id, found.header.stamp, found.child_frame_id = FRAME, self.stamp, name
        place(found.pose.pose, x, y, h)
        found.twist.twist.linear.x, found.twist.twist.linear.y = v, left
        return found

    @staticmethod
    def nanoseconds(stamp: Time) -> int:
        return stamp.sec * 10**9 + stamp.nanosec


def place(pose, x: float, y: float, h: float) -> None:
    pose.position.x, pose.position.y = x, y
    pose.orientation.z, pose.orientation.w = math.sin(h / 2.0), math.cos(h / 2.0)
