"""ASAM OSI: traces of GroundTruth and SensorView (.osi), and MCAP files with them.

Objects' positions are those of their boxes' centres. Of a SensorView its global ground truth is
read. Topics of an MCAP file are recordings of their own.

Source: ASAM OSI 3.7, osi_groundtruth.proto and those that it names; trace file formats.
"""

import struct
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.base.errors import FileFormatError
from bridgegen.drivers.kinds import ANIMAL, BICYCLE, BUS, CAR, MOTORCYCLE, OTHER, PEDESTRIAN, TRUCK
from bridgegen.recordings.readers import mcap
from bridgegen.recordings.readers.centre_lines import lanelets_of_centre_lines
from bridgegen.recordings.readers.columns import MOST_BYTES
from bridgegen.recordings.readers.format import Format, Head
from bridgegen.recordings.readers.road_lines import CentreLine
from bridgegen.recordings.readers.table import (
    MOST_STATES,
    NO_LANE,
    UNKNOWN_KIND,
    Facts,
    Lanelet,
    RecordedLight,
    RecordedTraffic,
    build,
    median_step,
    numbered,
    per_participant,
)
from bridgegen.recordings.readers.wire import Message, Shape

# --- The lanes of an OSI GroundTruth: driving lanes with a centre line ---
# Source: ASAM OSI 3.7, osi_lane.proto.


LANE_BOUNDARY, LANE = 9, 10
_DRIVING = 2
_CENTRE_LINE, _PAIRING, _RIGHT_BORDERS, _LEFT_BORDERS = 3, 7, 8, 9

_LANE = Shape({1: {1: "id"}, 2: {1: "type", 4: "ascending", 12: "subtype"}})
_BOUNDARY = Shape({1: {1: "id"}})
_POINT = Shape({1: "x.", 2: "y."})
_BOUNDARY_POINT = Shape({1: {1: "x.", 2: "y."}})
_IDENTIFIER = Shape({1: "id"})
_PAIR = Shape({1: {1: "before"}, 2: {1: "after"}})
_SUBTYPES = {
    3: "bicycleLane",
    4: "sidewalk",
    5: "parking",
    7: "restricted",
    8: "border",
    9: "shoulder",
}


def lanelets_of(truth: Message) -> tuple[tuple[Lanelet, ...], tuple[str, ...]]:
    """Return the lanelets of a message, and what was assumed.

    Raises:
        FileFormatError: the message is malformed, or its map too large; with the byte.
    """
    spans = truth.find(LANE_BOUNDARY, LANE)
    names = _BOUNDARY.read(truth, spans[LANE_BOUNDARY])["id"]
    road: dict[str, list[Float]] = {}
    for name, (begin, end) in zip(names.tolist(), spans[LANE_BOUNDARY].tolist(), strict=True):
        message = truth.part(begin, end)
        points = _points(_BOUNDARY_POINT.read(message, message.find(2)[2]))
        road.setdefault(str(name), []).append(points)
    lines, without = [], 0
    about = _LANE.read(truth, spans[LANE])
    for k, (begin, end) in enumerate(spans[LANE].tolist()):
        if about["type"][k] != _DRIVING:
            continue
        for inner in truth.part(begin, end).parts(2):
            found = inner.find(_CENTRE_LINE, _PAIRING, _RIGHT_BORDERS, _LEFT_BORDERS)
            points = _points(_POINT.read(inner, found[_CENTRE_LINE]))
            if len(points) < 2:
                without += 1
                continue
            # OSI's centre line may run against the traffic; ours runs with it, and what follows is
            # then what OSI lists as before.
            ascending = about["ascending"][k] == 1
            pairs = _PAIR.read(inner, found[_PAIRING])["after" if ascending else "before"]
            borders = np.concatenate([found[_RIGHT_BORDERS], found[_LEFT_BORDERS]])
            subtype = _SUBTYPES.get(int(about["subtype"][k]))
            lines.append(
                CentreLine(
                    name=str(about["id"][k]),
                    points=points if ascending else points[::-1],
                    borders=_texts(_IDENTIFIER.read(inner, borders)["id"].tolist()),
                    successors=_texts(pairs.tolist()) if len(pairs) else None,
                    kinds=(subtype,) if subtype else (),
                )
            )
    joined = {name: np.concatenate(parts) for name, parts in road.items() if parts}
    lanelets, notes = lanelets_of_centre_lines(lines, joined, truth.place(truth.begin))
    if without:
        notes = (*notes, f"{without} driving lanes without a centre line are left out")
    return lanelets, notes


def _points(columns: dict[str, Float]) -> Float:
    return np.column_stack([columns["x"], columns["y"]])


def _texts(ids: Iterable[int]) -> tuple[str, ...]:
    return tuple(str(number) for number in ids if number >= 0)


MOST_MESSAGE = 256 * 2**20
"""Largest size of a message of a trace [bytes]."""
LONGEST_CLOCK = 10**8
"""Time from which on a clock is taken to count from 1970, and not from the recording's start
[s]."""
_TIMESTAMP, _MOVING_OBJECT, _TRAFFIC_LIGHT, _GROUND_TRUTH = 2, 5, 7, 7
_PROJECTION, _MAP = 14, 15

TIMESTAMP = Shape({1: "seconds", 2: "nanos"})
OBJECT = Shape(
    {
        1: {1: "id"},
        2: {
            1: {1: "length.", 2: "width."},
            2: {1: "x.", 2: "y."},
            3: {3: "heading."},
            4: {1: "vx.", 2: "vy."},
            5: {1: "ax.", 2: "ay."},
        },
        3: "type",
        4: {1: "lane"},
        6: {1: "vehicle"},
        9: {1: {1: "assigned"}},
    }
)
LIGHT = Shape({1: {1: "id"}, 3: {1: "color", 3: "mode"}})

TYPES = {3: PEDESTRIAN, 4: ANIMAL, 1: OTHER}
"""Kinds by OSI's type of moving objects that are no vehicles."""
VEHICLE_TYPES = {
    2: CAR, 3: CAR, 4: CAR, 5: CAR, 6: CAR, 7: TRUCK, 8: TRUCK, 9: TRUCK, 10: MOTORCYCLE,
    11: BICYCLE, 12: BUS, 13: OTHER, 14: OTHER, 15: PEDESTRIAN, 16: TRUCK, 17: BICYCLE, 18: OTHER,
    19: OTHER, 20: OTHER, 21: OTHER,
}  # fmt: skip
"""Kinds by OSI's type of vehicle; a trailer is an object of its own."""
COLORS = {2: "red", 3: "yellow", 4: "green", 5: "blue", 6: "white"}
MODES = {2: "off", 4: "flashing"}


def _recognises(head: Head) -> bool:
    return head.data.startswith(mcap.MAGIC) or _is_trace(head.data)


def _is_trace(data: bytes) -> bool:
    """Return whether a file begins with a message that has a version, or none, and a timestamp."""
    # A trace has no magic number. What is looked for is the beginning of a first message: a length,
    # perhaps a version (field 1), and a timestamp (field 2) of at most 17 bytes.
    if len(data) < 6 or not 2 <= struct.unpack_from("<I", data)[0] <= MOST_MESSAGE:
        return False
    at = 4
    if data[at] == 1 << 3 | 2 and data[at + 1] < 32:
        at += 2 + data[at + 1]
    if len(data) < at + 2 or data[at] != _TIMESTAMP << 3 | 2:
        return False
    content = data[at + 2 : at + 2 + data[at + 1]]
    return not content or (len(content) <= 17 and content[0] in (1 << 3, 2 << 3))


def _read(path: Path) -> Iterator[RecordedTraffic]:
    with path.open("rb") as file:
        is_mcap = file.read(len(mcap.MAGIC)) == mcap.MAGIC
    if not is_mcap:
        trace = _Trace(path, path.stem)
        # One message at a time: of each, only the wanted fields stay in memory.
        for message in _messages(path):
            trace.add(message)
        yield trace.traffic(trace.lanelets)
        return
    traces: dict[str, _Trace] = {}
    left_out: Counter[str] = Counter()
    for stored in mcap.read_messages(path):
        if stored.encoding == "protobuf" and stored.schema in (
            "osi3.GroundTruth",
            "osi3.SensorView",
        ):
            trace = traces.setdefault(stored.topic, _Trace(path, stored.topic))
            trace.add(Message.of(stored.data, stored.source, stored.offset), stored.time)
        else:
            left_out[f"{stored.topic} ({stored.schema})"] += 1
    with_states = [trace for trace in traces.values() if trace.count]
    if not with_states:
        raise FileFormatError(f"{path}: holds no osi3.GroundTruth or SensorView with objects")
    notes = [f"not read: {name[:80]}" for name in left_out]
    # One topic may have the map for all.
    lanelets = next((trace.lanelets for trace in traces.values() if trace.lanelets), ())
    for trace in with_states:
        yield trace.traffic(trace.lanelets or lanelets, notes)


def _messages(path: Path) -> Iterator[Message]:
    """Yield the messages of a trace, each of which follows its length."""
    if path.stat().st_size > MOST_BYTES:
        raise FileFormatError(f"{path}: may have at most {MOST_BYTES} bytes")
    offset = 0
    try:
        with path.open("rb") as file:
            while head := file.read(4):
                size = int.from_bytes(head, "little")
                # Before the read: the length is a stranger's, and `read` would allocate it.
                if size > MOST_MESSAGE:
                    raise FileFormatError(
                        f"{path}, byte {offset}: a message may have {MOST_MESSAGE:,} bytes, got "
                        f"{size:,}"
                    )
                data = file.read(size)
                if len(head) < 4 or len(data) < size:
                    raise FileFormatError(
                        f"{path}, byte {offset}: a message of {size:,} bytes is cut off"
                    )
                yield Message.of(data, str(path), offset + 4)
                offset += 4 + size
    except OSError as error:
        raise FileFormatError(f"{path}: cannot be read: {error.strerror}") from None


@dataclass
class _Trace:
    """The messages of one topic, as they are read."""

    path: Path
    name: str
    count: int = 0
    lanelets: tuple[Lanelet, ...] = ()
    frame: str = ""
    map: str = ""
    notes: list[str] = field(default_factory=list)
    order: list[int] = field(default_factory=list)
    objects: list[dict[str, Any]] = field(default_factory=list)
    lights: list[dict[str, Any]] = field(default_factory=list)
    places: list[tuple[str, int]] = field(default_factory=list)

    def add(self, message: Message, logged: int = 0) -> None:
        truth = _ground_truth(message)
        found = truth.find(_TIMESTAMP, _MOVING_OBJECT, _TRAFFIC_LIGHT, LANE, _PROJECTION, _MAP)
        spans = found[_MOVING_OBJECT]
        if len(found[_PROJECTION]) and not self.frame:
            self.frame = truth.text(_PROJECTION)[:200]
        if len(found[_MAP]) and not self.map:
            self.map = truth.text(_MAP)[:200]
        if len(found[LANE]) and not self.lanelets:
            self.lanelets, notes = lanelets_of(truth)
            self.notes += notes
        if not len(spans) and not len(found[_TRAFFIC_LIGHT]):
            return
        # The last one counts where a field comes more than once, as Protocol Buffers have it.
        stamp = TIMESTAMP.read(truth, found[_TIMESTAMP][-1:])
        if not len(found[_TIMESTAMP]) or not 0 <= stamp["seconds"][0] < 2**33:
            raise FileFormatError(
                f"{truth.place(truth.begin)}: the message must have a timestamp ≥ 0 s"
            )
        # Whole nanoseconds: seconds since 1970 as float64 are exact to 0.2 µs only, and steps would
        # differ.
        time = int(stamp["seconds"][0]) * 10**9 + int(stamp["nanos"][0])
        if len(found[_TRAFFIC_LIGHT]):
            self.lights.append({**LIGHT.read(truth, found[_TRAFFIC_LIGHT]), "time": time})
        if len(spans):
            self.count += len(spans)
            if self.count > MOST_STATES:
                raise FileFormatError(f"{self.path}: may hold {MOST_STATES:,} states, got more")
            self.objects.append({**OBJECT.read(truth, spans), "time": time, "at": spans[:, 0]})
            self.places.append((truth.source, truth.offset))
            self.order.append(logged)

    def traffic(self, lanelets: tuple[Lanelet, ...], notes: Iterable[str] = ()) -> RecordedTraffic:
        if not self.count:
            raise FileFormatError(f"{self.path}: holds no states")
        # The messages of an MCAP file need not stand in the order of time; `sorted` keeps equal
        # ones in the file's order.
        ordered = sorted(range(len(self.order)), key=self.order.__getitem__)
        each = [self.objects[k] for k in ordered]
        counts = [len(record["id"]) for record in each]
        message = np.repeat(ordered, counts)
        columns = {
            name: np.concatenate([record[name] for record in each])
            for name in each[0]
            if name != "time"
        }
        at, places = columns["at"], self.places

        def where(i: int) -> str:
            source, offset = places[int(message[i])]
            return f"{source}, byte {offset + int(at[i])}"

        nameless = np.flatnonzero(columns["id"] < 0)
        if len(nameless):
            raise FileFormatError(f"{where(int(nameless[0]))}: a moving object must have an id")
        begin = min(light["time"] for light in (*each, *self.lights))
        # A whole second, so that instants stay multiples of the time step.
        start = begin // 10**9 * 10**9 if begin >= LONGEST_CLOCK * 10**9 else 0
        notes = [*self.notes, *notes]
        if start:
            notes.append(f"times count from {start // 10**9} s of the recording's clock")
        time = np.repeat([(record["time"] - start) * 1e-9 for record in each], counts)
        identifiers, ids = numbered(columns["id"])
        heading = columns["heading"]
        first = np.searchsorted(np.sort(ids), np.arange(len(identifiers) + 1))
        facts = Facts(
            name=self.name[:200],
            format=FORMAT.name,
            source=str(self.path),
            time_step=median_step(time[np.argsort(ids, kind="stable")], first),
            frame=f"OSI's global frame ({self.frame})" if self.frame else "OSI's global frame",
            map=self.map,
            lights=MappingProxyType(self._lights(start)),
            notes=tuple(notes),
            lanelets=lanelets,
        )
        # OSI moved the lane into the classification; older writers give the one that is deprecated.
        lane = np.where(columns["assigned"] >= 0, columns["assigned"], columns["lane"])
        return build(
            facts,
            ids,
            {
                "time": time,
                "x": columns["x"],
                "y": columns["y"],
                "heading": heading,
                "vx": columns["vx"],
                "vy": columns["vy"],
                "acceleration": columns["ax"] * np.cos(heading) + columns["ay"] * np.sin(heading),
                "lane": np.where((lane >= 0) & (lane < 2**31), lane, NO_LANE),
            },
            where,
            names=[str(item) for item in identifiers.tolist()],
            kind=_kinds(ids, columns["type"], columns["vehicle"]),
            length=per_participant(ids, columns["length"]),
            width=per_participant(ids, columns["width"]),
        )

    def _lights(self, start: int) -> dict[str, RecordedLight]:
        """Return when each light changes [s], and to what; a light is one lamp."""
        changes: dict[int, list[tuple[float, str]]] = {}
        for light in sorted(self.lights, key=lambda each: int(each["time"])):
            time = (light["time"] - start) * 1e-9
            for name, color, mode in zip(
                light["id"].tolist(), light["color"].tolist(), light["mode"].tolist(), strict=True
            ):
                word = f"{MODES.get(mode, '')} {COLORS.get(color, 'unknown')}".strip()
                word = "off" if word.startswith("off") else word
                seen = changes.setdefault(name, [])
                if not seen or seen[-1][1] != word:
                    seen.append((time, word))
        return {str(name): RecordedLight(tuple(seen)) for name, seen in changes.items()}


def _ground_truth(message: Message) -> Message:
    """Return a message that is a GroundTruth, or the one within a SensorView.

    Field 7 of a SensorView is one, which has a timestamp; that of a GroundTruth is a traffic
    light, in which the field of that number is a box, of no whole numbers.
    """
    spans = message.find(_GROUND_TRUTH)[_GROUND_TRUTH]
    if len(spans) != 1:
        return message
    begin, end = spans[0].tolist()
    inner = message.part(begin, end)
    # The name of a file says which of both it holds, but people rename files; so the content
    # decides. An empty timestamp is one at 0 s.
    for first, last in inner.find(_TIMESTAMP)[_TIMESTAMP].tolist():
        if first == last or inner.data[first] & 7 == 0:
            return inner
    return message


def _kinds(ids: Int, types: Int, vehicles: Int) -> Int:
    """Return each participant's kind: that of most of its states."""
    code = np.full(len(ids), UNKNOWN_KIND)
    for number, kind in TYPES.items():
        code[types == number] = kind
    for number, kind in VEHICLE_TYPES.items():
        code[((types == 2) | (types <= 0)) & (vehicles == number)] = kind
    # By majority, for trackers change their mind about a participant from state to state.
    table = np.zeros((int(ids.max()) + 1, 2 + max(CAR, OTHER, code.max())), dtype=np.int64)
    np.add.at(table, (ids, code + 1), 1)
    table[:, 0] = 0  # an unknown kind counts only where there is no other
    return np.where(table.any(axis=1), table.argmax(axis=1) - 1, UNKNOWN_KIND)


FORMAT = Format(
    name="OSI",
    title="ASAM OSI GroundTruth or SensorView (.osi, .mcap)",
    recognises=_recognises,
    read=_read,
)
