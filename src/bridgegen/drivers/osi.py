"""The messages of ASAM OSI that are written and read, and what several of them are made of.

Roads are flat, and bodies as high as usual ones.

Source: ASAM OSI 3.7.0.
"""

import math
from collections.abc import Sequence
from itertools import zip_longest
from typing import TYPE_CHECKING, Any

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.protobuf import Parts, Schema, nested
from bridgegen.drivers import kinds
from bridgegen.openx.opendrive.model import DRIVABLE

if TYPE_CHECKING:
    from bridgegen.drivers.interface import Lane

VERSION = (3, 7, 0)
"""The version of OSI."""

MESSAGES = """
GroundTruth: version InterfaceVersion 1, timestamp Timestamp 2, host_vehicle_id Identifier 3,
    stationary_object Unused* 4, moving_object MovingObject* 5, traffic_sign Unused* 6,
    traffic_light TrafficLight* 7, road_marking Unused* 8, lane_boundary LaneBoundary* 9,
    lane Lane* 10, environmental_conditions EnvironmentalConditions 12, reference_line Unused* 17,
    logical_lane_boundary Unused* 18, logical_lane Unused* 19
SensorView: version InterfaceVersion 1, timestamp Timestamp 2, sensor_id Identifier 3,
    global_ground_truth GroundTruth 7, host_vehicle_id Identifier 8,
    generic_sensor_view Unused* 1000, radar_sensor_view Unused* 1001,
    lidar_sensor_view Unused* 1002, camera_sensor_view Unused* 1003,
    ultrasonic_sensor_view Unused* 1004
InterfaceVersion: version_major uint32 1, version_minor uint32 2, version_patch uint32 3
Timestamp: seconds int64 1, nanos uint32 2
Identifier: value uint64 1
Unused: id Identifier 1
ExternalReference: reference string 1, type string 2, identifier string* 3
Dimension3d: length double 1, width double 2, height double 3
Vector3d: x double 1, y double 2, z double 3
Orientation3d: roll double 1, pitch double 2, yaw double 3
BaseMoving: dimension Dimension3d 1, position Vector3d 2, orientation Orientation3d 3,
    velocity Vector3d 4, acceleration Vector3d 5, orientation_rate Orientation3d 6
BaseStationary: dimension Dimension3d 1, position Vector3d 2, orientation Orientation3d 3
MovingObject: id Identifier 1, base BaseMoving 2, type .Type 3,
    vehicle_attributes .VehicleAttributes 5, vehicle_classification .VehicleClassification 6,
    model_reference string 7, moving_object_classification .MovingObjectClassification 9,
    source_reference ExternalReference* 10
MovingObject.VehicleAttributes: bbcenter_to_rear Vector3d 4
MovingObject.VehicleClassification: type .Type 1, light_state .LightState 2, role .Role 5
MovingObject.VehicleClassification.LightState: indicator_state .IndicatorState 1,
    brake_light_state .BrakeLightState 7, emergency_vehicle_illumination .GenericLightState 9
MovingObject.MovingObjectClassification: assigned_lane_id Identifier* 1
TrafficLight: id Identifier 1, base BaseStationary 2, classification .Classification 3,
    model_reference string 4, source_reference ExternalReference* 5
TrafficLight.Classification: color .Color 1, icon .Icon 2, mode .Mode 3,
    assigned_lane_id Identifier* 5
LaneBoundary: id Identifier 1, boundary_line .BoundaryPoint* 2, classification .Classification 3
LaneBoundary.BoundaryPoint: position Vector3d 1, width double 2, height double 3
LaneBoundary.Classification: type .Type 1, color .Color 2
Lane: id Identifier 1, classification .Classification 2, source_reference ExternalReference* 3
Lane.Classification: type .Type 1, centerline Vector3d* 3, centerline_is_driving_direction bool 4,
    left_adjacent_lane_id Identifier* 5, right_adjacent_lane_id Identifier* 6,
    lane_pairing .LanePairing* 7, right_lane_boundary_id Identifier* 8,
    left_lane_boundary_id Identifier* 9, free_lane_boundary_id Identifier* 10, subtype .Subtype 12
Lane.Classification.LanePairing: antecessor_lane_id Identifier 1, successor_lane_id Identifier 2
EnvironmentalConditions: ambient_illumination .AmbientIllumination 1,
    precipitation .Precipitation 6, fog .Fog 7
"""
"""Lists of what is never written are declared, for viewers ask for them."""

ENUMS = """
MovingObject.Type TYPE: UNKNOWN OTHER VEHICLE PEDESTRIAN ANIMAL
MovingObject.VehicleClassification.Type TYPE: UNKNOWN OTHER SMALL_CAR COMPACT_CAR MEDIUM_CAR
    LUXURY_CAR DELIVERY_VAN HEAVY_TRUCK SEMITRAILER TRAILER MOTORBIKE BICYCLE BUS TRAM TRAIN
    WHEELCHAIR SEMITRACTOR STANDUP_SCOOTER
MovingObject.VehicleClassification.Role ROLE: UNKNOWN OTHER CIVIL
MovingObject.VehicleClassification.LightState.IndicatorState INDICATOR_STATE: UNKNOWN OTHER OFF
    LEFT RIGHT WARNING
MovingObject.VehicleClassification.LightState.BrakeLightState BRAKE_LIGHT_STATE: UNKNOWN OTHER OFF
    NORMAL STRONG
MovingObject.VehicleClassification.LightState.GenericLightState GENERIC_LIGHT_STATE: UNKNOWN OTHER
    OFF ON FLASHING_BLUE
TrafficLight.Classification.Color COLOR: UNKNOWN OTHER RED YELLOW GREEN
TrafficLight.Classification.Icon ICON: UNKNOWN OTHER NONE
TrafficLight.Classification.Mode MODE: UNKNOWN OTHER OFF CONSTANT FLASHING
LaneBoundary.Classification.Type TYPE: UNKNOWN OTHER NO_LINE SOLID_LINE DASHED_LINE BOTTS_DOTS
    ROAD_EDGE SNOW_EDGE GRASS_EDGE GRAVEL_EDGE SOIL_EDGE GUARD_RAIL CURB
LaneBoundary.Classification.Color COLOR: UNKNOWN OTHER NONE WHITE
Lane.Classification.Type TYPE: UNKNOWN OTHER DRIVING NONDRIVING
Lane.Classification.Subtype SUBTYPE: UNKNOWN OTHER NORMAL BIKING SIDEWALK PARKING STOP RESTRICTED
    BORDER SHOULDER EXIT ENTRY ONRAMP OFFRAMP CONNECTINGRAMP
EnvironmentalConditions.AmbientIllumination AMBIENT_ILLUMINATION: UNKNOWN OTHER LEVEL1 LEVEL2
    LEVEL3 LEVEL4 LEVEL5 LEVEL6 LEVEL7 LEVEL8 LEVEL9
EnvironmentalConditions.Precipitation PRECIPITATION: UNKNOWN OTHER NONE VERY_LIGHT LIGHT MODERATE
    HEAVY VERY_HEAVY EXTREME
EnvironmentalConditions.Fog FOG: UNKNOWN OTHER EXCELLENT_VISIBILITY GOOD_VISIBILITY
    MODERATE_VISIBILITY POOR_VISIBILITY MIST LIGHT THICK DENSE
"""
OSI = Schema("osi3", MESSAGES, ENUMS)
message, VALUES = OSI.message, OSI.values

REACH = 150.0
"""Largest distance of a lane from the rectangle that holds all places [m]."""
STRAIGHT = 0.02
"""Largest distance of a line from its points that are left out [m]."""

_VEHICLES = {
    "car": "MEDIUM_CAR", "truck": "HEAVY_TRUCK", "bus": "BUS", "motorcycle": "MOTORBIKE",
    "bicycle": "BICYCLE", "tram": "TRAM", "e-scooter": "STANDUP_SCOOTER", "": "OTHER",
}  # fmt: skip
_SUBTYPES = {"driving": "NORMAL", "walking": "SIDEWALK"}
"""Subtypes of lanes that have other words than OpenDRIVE's types."""
_MARKS = {
    "none": "NO_LINE", "broken": "DASHED_LINE", "broken broken": "DASHED_LINE",
    "botts dots": "BOTTS_DOTS", "curb": "CURB", "grass": "GRASS_EDGE", "edge": "ROAD_EDGE",
}  # fmt: skip
_MARK_WIDTH = 0.12  # m
_SOURCE = "net.asam.openscenario"
"""Where the names of participants are from."""


def stamped(time: int) -> dict[str, Any]:
    """Return the version and the time [ns] of a message."""
    names = ("version_major", "version_minor", "version_patch")
    return {
        "version": message("InterfaceVersion", **dict(zip(names, VERSION, strict=True))),
        "timestamp": message("Timestamp", seconds=time // 10**9, nanos=time % 10**9),
    }


def identifier(number: int) -> Parts:
    """Return an id."""
    return message("Identifier", value=number)


def vector(x: float | Float, y: float | Float, z: float | Float = 0.0) -> Parts:
    """Return a place, a velocity or an acceleration."""
    return message("Vector3d", x=x, y=y, z=z)


def turned(yaw: float | Float) -> Parts:
    """Return a heading [rad], or its rate."""
    return message("Orientation3d", roll=0.0, pitch=0.0, yaw=yaw)


def size(length: float, width: float, height: float) -> Parts:
    """Return the size of a box [m]."""
    return message("Dimension3d", length=length, width=width, height=height)


def codes(enum: str, where: Any, value: str) -> Any:
    """Return a value of an enumeration where a condition holds, "OFF" elsewhere."""
    on, off = (VALUES[enum].index(word) for word in (value, "OFF"))
    return np.where(where, on, off).astype(np.uint8)


def moving_object(
    number: int,
    kind: str,
    box: tuple[float, float, float],
    position: Parts,
    yaw: Any,
    velocity: Parts,
    lit: Any,
    *,
    acceleration: Parts | None = None,
    rate: Any = None,
    ahead: float | None = None,
    name: str = "",
) -> Parts:
    """Return a participant; ``(T,)`` float64 where a value is one for each instant.

    Args:
        number: its id.
        kind: its name in `kinds.NAMES`; "" where it is unknown.
        box: length, width, height [m].
        position: of the box's centre [m].
        yaw: its heading [rad].
        velocity: of the box's centre [m/s].
        lit: its lamps, see `kinds`.
        acceleration: of the box's centre [m/s²].
        rate: of its turn [rad/s].
        ahead: of the box's centre, from the rear axle's [m].
        name: in the scenario's file.
    """
    base = message(
        "BaseMoving",
        dimension=size(*box),
        position=position,
        orientation=turned(yaw - 2.0 * math.pi * np.rint(yaw / (2.0 * math.pi))),
        velocity=velocity,
        acceleration=acceleration,
        orientation_rate=None if rate is None else turned(rate),
    )
    vehicle: dict[str, Any] = {}
    element = "MiscObject" if kind == "other" else "Pedestrian"
    if kind in _VEHICLES:
        element, of = "Vehicle", "MovingObject.Vehicle"
        if ahead is not None:
            to_rear = vector(-ahead, 0.0, -0.5 * box[2])
            vehicle["vehicle_attributes"] = message(f"{of}Attributes", bbcenter_to_rear=to_rear)
        vehicle["vehicle_classification"] = message(
            f"{of}Classification", type=_VEHICLES[kind], light_state=_lights(lit), role="CIVIL"
        )
    source = message("ExternalReference", type=_SOURCE, identifier=[element, name])
    return message(
        "MovingObject",
        id=identifier(number),
        base=base,
        type="VEHICLE" if kind in _VEHICLES else kind.upper(),
        **vehicle,
        source_reference=[source] if name else [],
    )


def _lights(lit: Any) -> Parts:
    """Return the lights of a vehicle."""
    state = "MovingObject.VehicleClassification.LightState"
    return message(
        state,
        indicator_state=(2 + (lit & kinds.HAZARD)).astype(np.uint8),  # off, left, right, warning
        brake_light_state=codes(f"{state}.BrakeLightState", lit & kinds.BRAKE, "NORMAL"),
        emergency_vehicle_illumination=codes(
            f"{state}.GenericLightState", lit & kinds.BLUE, "FLASHING_BLUE"
        ),
    )


def lanes_near(
    lanes: Sequence["Lane"], places: Float, first: int
) -> tuple[Parts, dict[str, Parts], int]:
    """Return the lanes near places with their borders, the lanes' ids, and the next id.

    Args:
        lanes: all.
        places: ``(2, K)`` x and y [m].
        first: the first id that is free.
    """
    low, high = places.min(1) - REACH, places.max(1) + REACH
    near = [
        lane
        for lane in lanes
        for line in (lane.centre[:, :2],)
        if (line.max(0) >= low).all() and (line.min(0) <= high).all()
    ]
    parts: Parts = []
    borders: dict[bytes, Parts] = {}
    sides = [
        [_border(lane, side, borders, first, parts) for side in ("left", "right")] for lane in near
    ]
    first += len(borders)
    ids = {lane.id: identifier(first + number) for number, lane in enumerate(near)}
    for lane, (left, right) in zip(near, sides, strict=True):
        parts += nested(10, _lane(lane, ids, left, right))
    return parts, ids, first + len(ids)


def known(ids: dict[str, Parts], *names: str) -> list[Parts]:
    """Return the ids of those that have one."""
    return [ids[name] for name in names if name in ids]


def _border(lane: "Lane", side: str, known: dict[bytes, Parts], first: int, parts: Parts) -> Parts:
    """Return the id of a lane's border; one that is new is added to what is known, and to parts."""
    points, mark = getattr(lane, side), getattr(lane, f"{side}_marking")
    key = min(points.tobytes(), points[::-1].tobytes())  # neighbours may run opposite ways
    if key in known:
        return known[key]
    known[key] = identifier(first + len(known))
    kind, point = _MARKS.get(mark, "SOLID_LINE"), "LaneBoundary.BoundaryPoint"
    width, color = (0.0, "NONE") if kind == "NO_LINE" else (_MARK_WIDTH, "WHITE")
    # Viewers draw dashes and gaps from point to point: 6 m each.
    points = _thinned(points, 3 if kind == "DASHED_LINE" else len(points))
    border = message(
        "LaneBoundary",
        id=known[key],
        boundary_line=[
            message(point, position=vector(x, y), width=width, height=0.0)
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
            vector(x, y) for x, y in _thinned(lane.centre[:, :2], len(lane.centre)).tolist()
        ],
        centerline_is_driving_direction=True,
        left_adjacent_lane_id=known(ids, lane.left_lane),
        right_adjacent_lane_id=known(ids, lane.right_lane),
        lane_pairing=[
            message(f"{kind}.LanePairing", antecessor_lane_id=before, successor_lane_id=after)
            for before, after in zip_longest(known(ids, *lane.previous), known(ids, *lane.next))
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
        length = max(math.sqrt(along[0] * along[0] + along[1] * along[1]), STRAIGHT)
        off = np.abs(along[0] * away[:, 1] - along[1] * away[:, 0]) / length
        k = a + 1 + int(np.argmax(off))
        if off[k - a - 1] > STRAIGHT:
            keep.add(k)
            todo += [(a, k), (k, b)]
    return points[sorted(keep)]
