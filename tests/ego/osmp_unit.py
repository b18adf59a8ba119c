"""A traffic participant of OSMP, written from its specification; pythonfmu makes a unit of it."""

import ctypes
import math

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer
from tests.google_messages import classes

# ASAM OSI 3.7.0.
OSI = {
    "Version": "version_major uint32 1, version_minor uint32 2",
    "Timestamp": "seconds int64 1, nanos uint32 2",
    "Id": "value uint64 1",
    "Vector3d": "x double 1, y double 2, z double 3",
    "Dimension3d": "length double 1, width double 2, height double 3",
    "Orientation3d": "roll double 1, pitch double 2, yaw double 3",
    "Base": "dimension Dimension3d 1, position Vector3d 2, orientation Orientation3d 3, "
    "velocity Vector3d 4, acceleration Vector3d 5",
    "MovingObject": "id Id 1, base Base 2, type int32 3",
    "Lane": "id Id 1",
    "GroundTruth": "version Version 1, timestamp Timestamp 2, host_vehicle_id Id 3, "
    "moving_object MovingObject* 5, lane_boundary Lane* 9, lane Lane* 10",
    "SensorView": "version Version 1, timestamp Timestamp 2, sensor_id Id 3, "
    "global_ground_truth GroundTruth 7, host_vehicle_id Id 8",
    "Header": "action_id Id 1",
    "StatePoint": "timestamp Timestamp 1, position Vector3d 2, orientation Orientation3d 3",
    "Path": "action_header Header 1, path_point StatePoint* 2",
    "Speed": "action_header Header 1, absolute_target_speed double 2",
    "Action": "follow_path_action Path 2, speed_action Speed 5",
    "TrafficCommand": "version Version 1, timestamp Timestamp 2, traffic_participant_id Id 3, "
    "action Action* 4",
    "TrafficUpdate": "version Version 1, timestamp Timestamp 2, update MovingObject* 3",
}
M = classes(OSI)
SEEN = []
"""What all units have been given: a view, a command (None: none) and lanes at the start."""


class Unit(Fmi2Slave):
    """Drives on straight ahead, and gains 1 m/s² up to the commanded speed."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.values = {}
        self.target = self.lanes = 0
        for name, causality in (
            ("OSMPSensorViewIn", Fmi2Causality.input),
            ("OSMPTrafficCommandIn", Fmi2Causality.input),
            ("OSMPTrafficUpdateOut", Fmi2Causality.output),
            ("OSMPGroundTruthInit", Fmi2Causality.parameter),
        ):
            variability = Fmi2Variability.discrete
            if causality is Fmi2Causality.parameter:
                variability = Fmi2Variability.fixed
            for role in ("base.lo", "base.hi", "size"):
                self.register(f"{name}.{role}", causality, variability)

    def register(self, name, causality, variability):
        self.values[name] = 0
        self.register_variable(
            Integer(
                name, causality=causality, variability=variability, start=0,
                getter=lambda: self.values[name],
                setter=lambda value: self.values.__setitem__(name, value),
            )
        )  # fmt: skip

    def given(self, name, kind):
        low, high, size = (self.values[f"{name}.{role}"] for role in ("base.lo", "base.hi", "size"))
        address = (high & 0xFFFFFFFF) << 32 | (low & 0xFFFFFFFF)
        return kind.FromString(ctypes.string_at(address, size)) if address and size else None

    def give(self, name, data):
        self.buffer = ctypes.create_string_buffer(data, len(data) or 1)
        address = ctypes.addressof(self.buffer) if data else 0
        self.values[f"{name}.base.lo"] = ctypes.c_int32(address).value
        self.values[f"{name}.base.hi"] = ctypes.c_int32(address >> 32).value
        self.values[f"{name}.size"] = len(data)

    def exit_initialization_mode(self):
        truth = self.given("OSMPGroundTruthInit", M["GroundTruth"])
        self.lanes = len(truth.lane)

    def do_step(self, time, step):
        view = self.given("OSMPSensorViewIn", M["SensorView"])
        command = self.given("OSMPTrafficCommandIn", M["TrafficCommand"])
        SEEN.append((view, command, self.lanes))
        for action in command.action if command else []:
            if action.HasField("speed_action"):
                self.target = action.speed_action.absolute_target_speed
        me = view.global_ground_truth.host_vehicle_id.value
        for seen in view.global_ground_truth.moving_object:
            if seen.id.value == me:
                self.give("OSMPTrafficUpdateOut", self.update(seen, step).SerializeToString())
        return True

    def update(self, seen, step):
        found = M["TrafficUpdate"]()
        own = found.update.add()
        own.CopyFrom(seen)
        base, h = own.base, own.base.orientation.yaw
        before = math.hypot(base.velocity.x, base.velocity.y)
        v = max(min(before + step, self.target), before - 3.0 * step)
        base.velocity.x, base.velocity.y = v * math.cos(h), v * math.sin(h)
        base.position.x += 0.5 * (before + v) * step * math.cos(h)
        base.position.y += 0.5 * (before + v) * step * math.sin(h)
        return found
