"""The messages of ASAM OSI that are written: their declaration, their bytes, their schema.

A message is a list of parts. Bytes are the same at all instants; an array ``(T, …)`` has a value
for each. All instants of a message have the same length, so that `rows` writes them at once.

Source: ASAM OSI 3.7.0; Protocol Buffers, "Encoding" and descriptor.proto.
"""

import struct
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

VERSION = (3, 7, 0)
"""The version of OSI."""

Parts = list[bytes | npt.NDArray[Any]]

_MESSAGES = """
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
"""Each message's fields: name, type and number. A type has ``*`` where the field may come several
times; one that begins with a dot is the message's own. Lists of what is never written are declared,
for viewers ask for them."""

_ENUMS = """
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
"""Each enumeration with its prefix, and its values, which count from 0."""


class _Field(NamedTuple):
    type: str
    number: int
    repeated: bool


def _entries(text: str) -> list[tuple[str, str]]:
    """Return the head and the rest of each entry, which goes on where lines are indented."""
    lines = text.strip().replace("\n    ", " ").splitlines()
    return [(head, rest.strip()) for head, _, rest in (line.partition(":") for line in lines)]


def _fields(name: str, text: str) -> dict[str, _Field]:
    each = [field.split() for field in text.split(",")]
    return {
        field: _Field((name if kind[0] == "." else "") + kind.strip("*"), int(number), "*" in kind)
        for field, kind, number in each
    }


_FIELDS = {name: _fields(name, rest) for name, rest in _entries(_MESSAGES)}
VALUES = {head.split()[0]: rest.split() for head, rest in _entries(_ENUMS)}
"""The values of each enumeration, in order."""
_PREFIXES = dict(head.split() for head, _ in _entries(_ENUMS))
_SCALARS = {"double": 1, "int64": 3, "uint64": 4, "bool": 8, "string": 9, "uint32": 13}
"""Codes of types in descriptor.proto."""
_MESSAGE, _ENUM, _OPTIONAL, _REPEATED = 11, 14, 1, 3
_VARINT, _DOUBLE, _LENGTH = 0, 1, 2
"""Types on the wire."""


def message(kind: str, **values: Any) -> Parts:
    """Return a message.

    Args:
        kind: its name.
        values: by the names of its fields: a number, a text, a name of an enumeration, a message;
            a sequence of these where the field may come several times. ``(T,)`` float64 for a
            double, ``(T,)`` uint8 below 128 for an enumeration. None is left out.
    """
    found: Parts = []
    for name, value in values.items():
        field = _FIELDS[kind][name]
        if value is not None:
            for one in value if field.repeated else (value,):
                found += _of_field(field, one)
    return found


def _of_field(field: _Field, value: Any) -> Parts:
    number, kind = field.number, field.type
    if kind in _FIELDS:
        return nested(number, value)
    if kind == "double":
        data = value if isinstance(value, np.ndarray) else struct.pack("<d", value)
        return [_key(number, _DOUBLE), data]
    if kind == "string":
        return nested(number, [value.encode()])
    if kind in VALUES and isinstance(value, str):
        value = VALUES[kind].index(value)
    return [_key(number, _VARINT), value if isinstance(value, np.ndarray) else varint(value)]


def nested(number: int, parts: Parts) -> Parts:
    """Return a message, or a text, as a field of another message."""
    size = sum(part.itemsize if isinstance(part, np.ndarray) else len(part) for part in parts)
    return [_key(number, _LENGTH) + varint(size), *parts]


def _key(number: int, wire_type: int) -> bytes:
    return varint(number << 3 | wire_type)


def varint(value: int) -> bytes:
    """Return a whole number ≥ 0 as Protocol Buffers write it."""
    found = bytearray()
    while value > 127:
        found.append(value & 127 | 128)
        value >>= 7
    return bytes((*found, value))


def flat(parts: Parts) -> bytes:
    """Return a message that is the same at all instants."""
    return b"".join(part if isinstance(part, bytes) else part.tobytes() for part in parts)


def rows(parts: Parts, n: int) -> list[bytes]:
    """Return a message at each of n instants."""
    columns = [
        part.astype(part.dtype.newbyteorder("<")).view(np.uint8).reshape(n, -1)
        if isinstance(part, np.ndarray)
        else np.broadcast_to(np.frombuffer(part, np.uint8), (n, len(part)))
        for part in parts
    ]
    whole = np.concatenate(columns, axis=1)
    data, size = whole.tobytes(), whole.shape[1]
    return [data[k : k + size] for k in range(0, n * size, size)]


# --- The schema, as MCAP files carry it: a FileDescriptorSet ---


def schema() -> bytes:
    """Return the part of OSI's schema that is declared here, as a FileDescriptorSet."""
    parts = [*nested(1, [b"osi3.proto"]), *nested(2, [b"osi3"])]
    for name in _FIELDS:
        if "." not in name:
            parts += nested(4, _descriptor(name))
    return flat(nested(1, parts))


def _descriptor(name: str) -> Parts:
    """Return the DescriptorProto of a message."""
    found = nested(1, [_last(name)])
    for field, (kind, number, repeated) in _FIELDS[name].items():
        of = _SCALARS.get(kind) or (_MESSAGE if kind in _FIELDS else _ENUM)
        about = nested(1, [field.encode()])
        about.append(_numbers((3, number), (4, _REPEATED if repeated else _OPTIONAL), (5, of)))
        if kind not in _SCALARS:
            about += nested(6, [f".osi3.{kind}".encode()])
        found += nested(2, about)
    for inner in _FIELDS:
        if inner.rpartition(".")[0] == name:
            found += nested(3, _descriptor(inner))
    for inner, words in VALUES.items():
        if inner.rpartition(".")[0] == name:
            values = nested(1, [_last(inner)])
            for number, word in enumerate(words):
                label = nested(1, [f"{_PREFIXES[inner]}_{word}".encode()])
                values += nested(2, [*label, _numbers((2, number))])
            found += nested(4, values)
    return found


def _last(name: str) -> bytes:
    return name.rpartition(".")[2].encode()


def _numbers(*fields: tuple[int, int]) -> bytes:
    return b"".join(_key(number, _VARINT) + varint(value) for number, value in fields)
