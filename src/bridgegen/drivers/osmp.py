"""A traffic participant packaged by ASAM OSI's Sensor Model Packaging (OSMP), as a driver.

Such a co-simulation unit of FMI 2.0 takes ``OSMPSensorViewIn`` and gives
``OSMPTrafficUpdateOut``: where it is after the step, which is followed as a plan is. It may take
``OSMPTrafficCommandIn`` (once a second the target speed, and the route ahead as a path) and
``OSMPGroundTruthInit`` (the lanes).

A SensorView's ground truth has the lanes near the ego's route with their borders, the ego, and the
confirmed tracks of BridgeGen's sensors: with ``--ideal perception``, all participants as they are.
Lights, signs and weather are left out, and ``OSMPSensorViewInConfig`` is not set.

Source: OSMP 1.6.0; ASAM OSI 3.7.0.
"""

import ctypes
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.base.errors import InputError
from bridgegen.base.protobuf import Parts, Schema, WireError, flat, nested
from bridgegen.drivers import kinds
from bridgegen.drivers.fmu import FmuDriver
from bridgegen.drivers.interface import Observation, Scene, Trajectory
from bridgegen.drivers.osi import (
    ENUMS,
    MESSAGES,
    identifier,
    lanes_near,
    moving_object,
    stamped,
    vector,
)

_VIEW, _COMMAND, _TRUTH = "OSMPSensorViewIn", "OSMPTrafficCommandIn", "OSMPGroundTruthInit"
UPDATE = "OSMPTrafficUpdateOut"
_ROLES = (".base.lo", ".base.hi", ".size")
_MOST_BYTES = 2**26  # of an update
_EVERY = 1_000_000_000  # ns, between two commands
_EGO = 1  # its id; those of tracks, borders and lanes follow

_OSI = Schema(
    "osi3",
    MESSAGES
    + """TrafficUpdate: update MovingObject* 3
TrafficCommand: version InterfaceVersion 1, timestamp Timestamp 2,
    traffic_participant_id Identifier 3, action TrafficAction* 4
TrafficAction: follow_path_action Path 2, speed_action Speed 5
Header: action_id Identifier 1
Path: action_header Header 1, path_point StatePoint* 2
Speed: action_header Header 1, absolute_target_speed double 2
StatePoint: timestamp Timestamp 1, position Vector3d 2, orientation Orientation3d 3
""",
    ENUMS,
)
_message = _OSI.message


class OsmpDriver(FmuDriver):
    """Drives by a traffic participant of OSMP, one instance per scenario.

    Args:
        path: of the ``.fmu`` file. It holds compiled code, which runs with your rights.

    Raises:
        InputError: the extra is missing, or an input or output that it must have.
        FileFormatError: not a co-simulation unit.
    """

    wants = ("map",)

    def _bind(self, path: Path | str) -> None:
        named = {each.name: each.valueReference for each in self._description.modelVariables}
        self._variables = {}
        for name in (_VIEW, _COMMAND, _TRUTH, UPDATE):
            parts = [named[part] for role in _ROLES if (part := name + role) in named]
            if len(parts) == len(_ROLES):
                self._variables[name] = parts
        if lacking := [name for name in (_VIEW, UPDATE) if name not in self._variables]:
            raise InputError(
                f"{path}: a traffic participant of OSMP must have {_VIEW} and {UPDATE}, each as "
                f"FMI 2.0's integers {', '.join(_ROLES)}; it lacks {', '.join(lacking)}"
            )

    def reset(self, n: int, scene: Scene) -> None:
        """See `BatchDriver`."""
        self._scene, self._others = scene, len(scene.names)
        self._kept: dict[tuple[int, str], Any] = {}
        lanes = []
        for road_map in scene.maps:
            ways = [lane.centre[:, :2] for lane in road_map.lanes if lane.id in road_map.route]
            places = np.concatenate(ways or [lane.centre[:, :2] for lane in road_map.lanes]).T
            lanes.append(flat(lanes_near(road_map.lanes, places, _EGO + self._others + 1)[0]))
        self._lanes = [lanes[number] for number in scene.map_of.tolist()]
        super().reset(n, scene)

    def act(self, observation: Observation) -> Trajectory:
        """See `BatchDriver`; raise `InputError` where a unit gives no update of the ego."""
        n, time = len(observation.x), round(observation.time * 1e9)
        ends = np.zeros((4, n))
        for i in np.flatnonzero(observation.running).tolist():
            unit = self._units[i]
            self._set(unit, i, _VIEW, self._view(observation, i, time))
            if _COMMAND in self._variables:
                is_due = time % _EVERY < round(self._step * 1e9)
                self._set(unit, i, _COMMAND, self._command(observation, i, time) if is_due else b"")
            unit.doStep(observation.time, self._step)
            ends[:, i] = self._end(self._get(unit, UPDATE))
        x, y, h, v = ends[:, :, np.newaxis]
        return Trajectory(np.array([self._step]), x, y, h, v)

    def _initialise(self, unit: Any, number: int) -> None:
        if _TRUTH in self._variables:
            head = flat(_message("GroundTruth", **stamped(0), host_vehicle_id=identifier(_EGO)))
            self._set(unit, number, _TRUTH, head + self._lanes[number])

    def _view(self, seen: Observation, i: int, time: int) -> bytes:
        """Return a SensorView."""
        x, y, h, v, a = (float(getattr(seen, name)[i]) for name in ("x", "y", "h", "v", "a"))
        scene, cos, sin = self._scene, np.cos(h), np.sin(h)
        ahead, height = scene.centre, kinds.HEIGHTS[kinds.CAR]
        ego = moving_object(
            _EGO,
            "car",
            (scene.length, scene.width, height),
            vector(x + ahead * cos, y + ahead * sin, 0.5 * height),
            h,
            vector(v * cos, v * sin),
            np.int64(kinds.BRAKE * (a < -kinds.BRAKE_LIGHTS_FROM)),
            acceleration=vector(a * cos, a * sin),
            ahead=ahead,
        )
        objects = [
            ego,
            *(_tracked(m, t) for m, t in enumerate(seen.tracks[i].tolist()) if t[0] >= 2),
        ]
        head, me = stamped(time), identifier(_EGO)
        truth = flat(_message("GroundTruth", **head, host_vehicle_id=me, moving_object=objects))
        view = _message("SensorView", **head, sensor_id=me, host_vehicle_id=me)
        return flat([*view, *nested(7, [truth + self._lanes[i]])])

    def _command(self, seen: Observation, i: int, time: int) -> bytes:
        """Return a TrafficCommand: the target speed, and the route as a path."""
        number = 2 * (time // _EVERY)
        places = (vector(x, y) for x, y in seen.route[i, :, :2].tolist())
        points = [_message("StatePoint", position=place) for place in places]
        first, second = (_message("Header", action_id=identifier(number + k)) for k in (1, 2))
        target = float(seen.target_speed[i])
        speed = _message("Speed", action_header=first, absolute_target_speed=target)
        path = _message("Path", action_header=second, path_point=points)
        both = ({"speed_action": speed}, {"follow_path_action": path})
        head = {**stamped(time), "traffic_participant_id": identifier(_EGO)}
        actions = [_message("TrafficAction", **each) for each in both]
        return flat(_message("TrafficCommand", **head, action=actions))

    def _end(self, data: bytes) -> tuple[float, ...]:
        """Return x, y, heading and speed of the rear axle's centre in a TrafficUpdate."""
        try:
            updates = _OSI.read("TrafficUpdate", data)["update"]
        except WireError as error:
            raise InputError(f"{UPDATE} must be a TrafficUpdate: {error}") from None
        own = [update["base"] for update in updates if update["id"]["value"] == _EGO]
        if not own:
            raise InputError(
                f"{UPDATE} must have the host vehicle, with the id {_EGO}; got {len(updates)} "
                f"others in {len(data)} bytes"
            )
        place, speed, h = own[-1]["position"], own[-1]["velocity"], own[-1]["orientation"]["yaw"]
        cos, sin, ahead = np.cos(h), np.sin(h), self._scene.centre
        along = speed["x"] * cos + speed["y"] * sin
        return place["x"] - ahead * cos, place["y"] - ahead * sin, h, along

    def _set(self, unit: Any, number: int, name: str, data: bytes) -> None:
        """Give a unit a message; it stays where it is until the next one."""
        buffer = self._kept[number, name] = ctypes.create_string_buffer(data, max(len(data), 1))
        address = ctypes.addressof(buffer) if data else 0
        halves = [ctypes.c_int32(address >> shift).value for shift in (0, 32)]
        unit.setInteger(self._variables[name], [*halves, len(data)])

    def _get(self, unit: Any, name: str) -> bytes:
        """Return a message that a unit gives; b"" if it gives none."""
        low, high, size = unit.getInteger(self._variables[name])
        address = (high & 0xFFFFFFFF) << 32 | (low & 0xFFFFFFFF)
        if not address or not 0 < size <= _MOST_BYTES:
            return b""
        return ctypes.string_at(address, size)


def _tracked(number: int, track: list[float]) -> Parts:
    """Return a track as an object."""
    x, y, h, vx, vy, length, width = track[1:8]
    kind, height = kinds.NAMES[int(track[8])], kinds.HEIGHTS[int(track[8])]
    place = vector(x, y, 0.5 * height)
    box, lit = (length, width, height), np.int64(track[12])
    return moving_object(_EGO + 1 + number, kind, box, place, h, vector(vx, vy), lit)
