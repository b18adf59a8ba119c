"""A rollout as a trace of ASAM OSI: one GroundTruth or SensorView an instant, in an MCAP file.

Each message has the lanes near the participants, as viewers expect it. Roads are flat, and bodies
as high as usual ones; brake lights follow from the deceleration where the rollout has no lights.

Source: ASAM OSI 3.7.0, and its naming of trace files.
"""

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from math import pi
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.base.disk import write_whole
from bridgegen.drivers import kinds
from bridgegen.drivers._weather_columns import BACKGROUND, RAIN, SNOW, VISUAL_RANGE
from bridgegen.openx.opendrive.mirror import as_written
from bridgegen.openx.opendrive.model import DRIVABLE, OpenDrive
from bridgegen.openx.opendrive.outline import lights
from bridgegen.scenario.participants import PARTICIPANTS
from bridgegen.simulation.osi.mcap import mcap
from bridgegen.simulation.osi.messages import (
    VALUES,
    VERSION,
    Parts,
    flat,
    message,
    nested,
    rows,
    schema,
)
from bridgegen.simulation.rollout import Rollout

if TYPE_CHECKING:
    from bridgegen.drivers.interface import Lane

GROUND_TRUTH, SENSOR_VIEW = "GroundTruth", "SensorView"
ENDINGS = {GROUND_TRUTH: "_gt.mcap", SENSOR_VIEW: "_sv.mcap"}
"""How names of files end, by what their messages are."""

REACH = 150.0
"""Largest distance of a lane from the rectangle that holds all participants [m]."""
STRAIGHT = 0.02
"""Largest distance of a line from its points that are left out [m]."""

_VEHICLES = {
    "car": "MEDIUM_CAR", "truck": "HEAVY_TRUCK", "bus": "BUS", "motorcycle": "MOTORBIKE",
    "bicycle": "BICYCLE", "tram": "TRAM", "e-scooter": "STANDUP_SCOOTER", "": "OTHER",
}  # fmt: skip
_HEIGHTS = {kind.seen_as.name: kind.body.height for kind in reversed([*PARTICIPANTS.values()])}
_HEIGHT = 1.5  # m, where the kind is unknown
_SUBTYPES = {"driving": "NORMAL", "walking": "SIDEWALK"}
"""Subtypes of lanes that have other words than OpenDRIVE's types."""
_MARKS = {
    "none": "NO_LINE", "broken": "DASHED_LINE", "broken broken": "DASHED_LINE",
    "botts dots": "BOTTS_DOTS", "curb": "CURB", "grass": "GRASS_EDGE", "edge": "ROAD_EDGE",
}  # fmt: skip
_MARK_WIDTH = 0.12  # m
_LAMPS = {"RED": ((1, 2), 3.6), "YELLOW": ((2, 3), 3.3), "GREEN": ((4,), 3.0)}
"""Of each lamp of a traffic light the states in which it is lit, and its height [m]."""
_RAIN = (0.1, 0.5, 1.9, 8.1, 34.0, 149.0)  # mm/h
_RAINS = VALUES["EnvironmentalConditions.Precipitation"][2:]
_SIGHT = (50.0, 200.0, 1000.0, 2000.0, 4000.0, 10_000.0, 40_000.0)  # m
_FOGS = VALUES["EnvironmentalConditions.Fog"][:1:-1]
_LIT = (0.01, 1.0, 3.0, 10.0, 20.0, 400.0, 1000.0, 10_000.0)  # lx
_ALBEDO = 0.2  # of what ``BACKGROUND`` is the luminance of, see ``drivers._physics_kernels``

_SOURCE = "net.asam.openscenario"
"""Where the names of participants are from."""
_EGO = 1
"""The ego's id; those of the others, of borders, lanes and lamps follow."""


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What is around a scenario's participants.

    Attributes:
        roads: the map; None, or one without roads, where there is none.
        weather: from which instant on, and ``(WEATHER,)`` float64; empty where it is unknown.
    """

    roads: OpenDrive | None = None
    weather: Sequence[tuple[int, Float]] = ()


def write_osi(paths: Sequence[Path], rollout: Rollout, around: Surroundings, row: int = 0) -> None:
    """Write one scenario of a rollout as MCAP files, each whole or not at all.

    Args:
        paths: the files; one whose name ends in _sv.mcap has SensorViews, another GroundTruths.
        rollout: N scenarios.
        around: the map and the weather of that scenario.
        row: which of them.

    Raises:
        StorageError: one cannot be written.
    """
    truths = [*ground_truths(rollout, around, row)]
    version, library = ".".join(map(str, VERSION)), "3.0.0"  # any that reads these bytes
    about = dict.fromkeys(("version", "min_osi_version", "max_osi_version"), version)
    about |= dict.fromkeys(("min_protobuf_version", "max_protobuf_version"), library)
    versions = {"osi_version": version, "protobuf_version": library}
    channel = {f"net.asam.osi.trace.channel.{key}": text for key, text in versions.items()}
    for path in paths:
        is_view = path.name.lower().endswith(ENDINGS[SENSOR_VIEW])
        kind = SENSOR_VIEW if is_view else GROUND_TRUTH
        messages = map(_sensor_view, truths) if is_view else truths
        metadata = ("net.asam.osi.trace", about)
        write_whole(path, mcap(kind, f"osi3.{kind}", schema(), messages, metadata, channel))


def _sensor_view(truth: tuple[int, bytes]) -> tuple[int, bytes]:
    time, data = truth
    head = message(SENSOR_VIEW, **_head(time), sensor_id=_id(_EGO), host_vehicle_id=_id(_EGO))
    return time, flat([*head, *nested(7, [data])])


def ground_truths(
    rollout: Rollout, around: Surroundings, row: int = 0
) -> Iterator[tuple[int, bytes]]:
    """Yield time [ns] and bytes of a GroundTruth for each instant of one scenario."""
    rollout, n = rollout.as_driven(), int(rollout.n_steps[row])
    road, changing = b"", [nested(5, _object(rollout, row, e, n)) for e in range(rollout.shape[1])]
    if around.roads is not None and around.roads.roads:
        road, lamps = _road(as_written(around.roads), rollout, row, n)
        changing += lamps
    states = [rows(parts, n) for parts in changing]
    present = np.ones((len(states), n), np.bool_)
    if rollout.present.size:
        present[: rollout.shape[1]] = rollout.present[row, :, :n]
    begins = [k for k, _ in around.weather]
    static = [flat(_environment(weather)) + road for _, weather in around.weather] or [road]
    for k in range(n):
        time = round(k * rollout.time_step * 1e9)
        head = flat(message(GROUND_TRUTH, **_head(time), host_vehicle_id=_id(_EGO)))
        there = [states[i][k] for i in np.flatnonzero(present[:, k]).tolist()]
        yield time, b"".join((head, *there, static[max(bisect_right(begins, k) - 1, 0)]))


def _head(time: int) -> dict[str, Any]:
    """Return the version and the time [ns] of a message."""
    names = ("version_major", "version_minor", "version_patch")
    return {
        "version": message("InterfaceVersion", **dict(zip(names, VERSION, strict=True))),
        "timestamp": message("Timestamp", seconds=time // 10**9, nanos=time % 10**9),
    }


def _id(number: int) -> Parts:
    return message("Identifier", value=number)


def _vector(x: float | Float, y: float | Float, z: float | Float = 0.0) -> Parts:
    return message("Vector3d", x=x, y=y, z=z)


def _turned(yaw: float | Float) -> Parts:
    return message("Orientation3d", roll=0.0, pitch=0.0, yaw=yaw)


def _size(length: float, width: float, height: float) -> Parts:
    return message("Dimension3d", length=length, width=width, height=height)


def _codes(enum: str, where: Any, value: str) -> Any:
    """Return a value of an enumeration where a condition holds, "OFF" elsewhere."""
    on, off = (VALUES[enum].index(word) for word in (value, "OFF"))
    return np.where(where, on, off).astype(np.uint8)


def _object(rollout: Rollout, row: int, e: int, n: int) -> Parts:
    """Return a participant at its n instants."""
    kind, height = _kind_of(rollout, e), height_of(rollout, e)
    length, width, ahead = rollout.box[e].tolist()
    x, y, h, v, a = (getattr(rollout, name)[row, e, :n] for name in ("x", "y", "h", "v", "a"))
    cos, sin = elementary.cos(h), elementary.sin(h)
    rate = np.gradient(h, rollout.time_step) if n > 1 else np.zeros(n)
    base = message(
        "BaseMoving",
        dimension=_size(length, width, height),
        position=_vector(x + ahead * cos, y + ahead * sin, 0.5 * height),
        orientation=_turned(h - 2.0 * pi * np.rint(h / (2.0 * pi))),
        # The box's centre moves across, too, where the reference point moves ahead.
        velocity=_vector(v * cos - rate * ahead * sin, v * sin + rate * ahead * cos),
        acceleration=_vector(a * cos - v * rate * sin, a * sin + v * rate * cos),
        orientation_rate=_turned(rate),
    )
    vehicle: dict[str, Parts] = {}
    element = "MiscObject" if kind == "other" else "Pedestrian"
    if kind in _VEHICLES:
        element, name = "Vehicle", "MovingObject.Vehicle"
        state = _lights(rollout, row, e, n)
        to_rear = _vector(-ahead, 0.0, -0.5 * height)
        vehicle = {
            "vehicle_attributes": message(f"{name}Attributes", bbcenter_to_rear=to_rear),
            "vehicle_classification": message(
                f"{name}Classification", type=_VEHICLES[kind], light_state=state, role="CIVIL"
            ),
        }
    identifier = [element, rollout.names[e]]
    return message(
        "MovingObject",
        id=_id(_EGO + e),
        base=base,
        type="VEHICLE" if vehicle else kind.upper(),
        **vehicle,
        source_reference=[message("ExternalReference", type=_SOURCE, identifier=identifier)],
    )


def _kind_of(rollout: Rollout, e: int) -> str:
    known = len(rollout.kinds) and rollout.kinds[e] >= 0
    return kinds.NAMES[rollout.kinds[e]] if known else ""


def height_of(rollout: Rollout, e: int) -> float:
    """Return the usual height of a participant's kind [m]."""
    return _HEIGHTS.get(_kind_of(rollout, e), _HEIGHT)


def _lights(rollout: Rollout, row: int, e: int, n: int) -> Parts:
    """Return the lights of a vehicle."""
    if rollout.lamps.size:
        lit = rollout.lamps[row, e, :n].astype(np.int64)
    else:
        lit = kinds.BRAKE * (rollout.a[row, e, :n] < -kinds.BRAKE_LIGHTS_FROM)
    state = "MovingObject.VehicleClassification.LightState"
    return message(
        state,
        indicator_state=(2 + (lit & kinds.HAZARD)).astype(np.uint8),  # off, left, right, warning
        brake_light_state=_codes(f"{state}.BrakeLightState", lit & kinds.BRAKE, "NORMAL"),
        emergency_vehicle_illumination=_codes(
            f"{state}.GenericLightState", lit & kinds.BLUE, "FLASHING_BLUE"
        ),
    )


def _environment(weather: Float) -> Parts:
    lit = 1 + bisect_right(_LIT, float(weather[BACKGROUND]) * pi / _ALBEDO)
    conditions = message(
        "EnvironmentalConditions",
        ambient_illumination=f"LEVEL{lit}",
        precipitation=_RAINS[bisect_right(_RAIN, float(weather[RAIN] + weather[SNOW]))],
        fog=_FOGS[bisect_right(_SIGHT, float(weather[VISUAL_RANGE]))],
    )
    return message(GROUND_TRUTH, environmental_conditions=conditions)


# --- The road network ---


def _road(model: OpenDrive, rollout: Rollout, row: int, n: int) -> tuple[bytes, list[Parts]]:
    """Return the lanes near the participants with their borders; and the lamps, which change."""
    from bridgegen.drivers.road_map import road_map

    found = road_map(model, None, rollout.light_names)
    there = rollout.present[row, :, :n] if rollout.present.size else np.s_[:]
    places = np.array([rollout.x[row, :, :n][there].ravel(), rollout.y[row, :, :n][there].ravel()])
    low, high = places.min(1) - REACH, places.max(1) + REACH
    near = [
        lane
        for lane in found.lanes
        for line in (lane.centre[:, :2],)
        if (line.max(0) >= low).all() and (line.min(0) <= high).all()
    ]
    parts: Parts = []
    borders: dict[bytes, Parts] = {}
    first = _EGO + rollout.shape[1]
    sides = [
        [_border(lane, side, borders, first, parts) for side in ("left", "right")] for lane in near
    ]
    first += len(borders)
    ids = {lane.id: _id(first + number) for number, lane in enumerate(near)}
    for lane, (left, right) in zip(near, sides, strict=True):
        parts += nested(10, _lane(lane, ids, left, right))
    first += len(near)
    governed = {light.id: light.lanes for light in found.lights}
    lamps = list[Parts]()
    for pole in (each for each in lights(model) if each.id in governed):
        states = rollout.lights[row, rollout.light_names.index(pole.id), :n]
        yaw = pole.h - pi if pole.h > 0.0 else pole.h + pi  # it faces the traffic
        for color, (lit, z) in _LAMPS.items():
            kind = "TrafficLight.Classification"
            lamp = message(
                "TrafficLight",
                id=_id(first + len(lamps)),
                base=message(
                    "BaseStationary",
                    dimension=_size(0.1, 0.3, 0.3),
                    position=_vector(pole.x, pole.y, z),
                    orientation=_turned(yaw),
                ),
                classification=message(
                    kind,
                    color=color,
                    icon="NONE",
                    mode=_codes(f"{kind}.Mode", np.isin(states, lit), "CONSTANT"),
                    assigned_lane_id=_known(ids, *governed[pole.id]),
                ),
            )
            lamps.append(nested(7, lamp))
    return flat(parts), lamps


def _known(ids: dict[str, Parts], *names: str) -> list[Parts]:
    return [ids[name] for name in names if name in ids]


def _border(lane: "Lane", side: str, known: dict[bytes, Parts], first: int, parts: Parts) -> Parts:
    """Return the id of a lane's border; one that is new is added to what is known, and to parts."""
    points, mark = getattr(lane, side), getattr(lane, f"{side}_marking")
    key = min(points.tobytes(), points[::-1].tobytes())  # neighbours may run opposite ways
    if key in known:
        return known[key]
    known[key] = _id(first + len(known))
    kind, point = _MARKS.get(mark, "SOLID_LINE"), "LaneBoundary.BoundaryPoint"
    width, color = (0.0, "NONE") if kind == "NO_LINE" else (_MARK_WIDTH, "WHITE")
    # Viewers draw dashes and gaps from point to point: 6 m each.
    points = _thinned(points, 3 if kind == "DASHED_LINE" else len(points))
    border = message(
        "LaneBoundary",
        id=known[key],
        boundary_line=[
            message(point, position=_vector(x, y), width=width, height=0.0)
            for x, y in points.tolist()
        ],
        classification=message("LaneBoundary.Classification", type=kind, color=color),
    )
    parts += nested(9, border)
    return known[key]


def _lane(lane: "Lane", ids: dict[str, Parts], left: Parts, right: Parts) -> Parts:
    kind, subtype = "Lane.Classification", _SUBTYPES.get(lane.kind, lane.kind.upper())
    classification = message(
        kind,
        type="DRIVING" if lane.kind in DRIVABLE else "NONDRIVING",
        centerline=[
            _vector(x, y) for x, y in _thinned(lane.centre[:, :2], len(lane.centre)).tolist()
        ],
        centerline_is_driving_direction=True,
        left_adjacent_lane_id=_known(ids, lane.left_lane),
        right_adjacent_lane_id=_known(ids, lane.right_lane),
        lane_pairing=[
            message(f"{kind}.LanePairing", antecessor_lane_id=before, successor_lane_id=after)
            for before, after in zip_longest(_known(ids, *lane.previous), _known(ids, *lane.next))
        ],
        right_lane_boundary_id=[right],
        left_lane_boundary_id=[left],
        subtype=subtype if subtype in VALUES[f"{kind}.Subtype"] else "OTHER",
    )
    return message("Lane", id=ids[lane.id], classification=classification)


def _thinned(points: Float, every: int) -> Float:
    """Return a line without points that lie on it, by Ramer's, Douglas' and Peucker's algorithm.

    Points of which the number is a multiple of ``every`` stay.
    """
    keep, todo = {*range(0, len(points), every), len(points) - 1}, [(0, len(points) - 1)]
    while todo:
        a, b = todo.pop()
        if b - a < 2:
            continue
        along, away = points[b] - points[a], points[a + 1 : b] - points[a]
        length = max(float(elementary.hypot(along[0], along[1])), STRAIGHT)
        off = np.abs(along[0] * away[:, 1] - along[1] * away[:, 0]) / length
        k = a + 1 + int(np.argmax(off))
        if off[k - a - 1] > STRAIGHT:
            keep.add(k)
            todo += [(a, k), (k, b)]
    return points[sorted(keep)]
