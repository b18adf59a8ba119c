"""CommonRoad scenarios (XML, versions 2020a and 2018b): dynamic and static obstacles.

An interval stands for its middle. An obstacle whose prediction is an occupancy set has no
trajectory, and is left out with a note. Lanelets come with the recording.

Source: CommonRoad, XML format documentation, both versions.
"""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from lxml import etree

from bridgegen.base.errors import FileFormatError
from bridgegen.drivers.kinds import BICYCLE, BUS, CAR, MOTORCYCLE, OTHER, PEDESTRIAN, TRUCK
from bridgegen.openx.xml import parse_xml
from bridgegen.recordings.readers.format import Format, Head
from bridgegen.recordings.readers.table import (
    FARTHEST,
    UNKNOWN_KIND,
    Facts,
    Lanelet,
    RecordedTraffic,
    build,
)

KINDS = {
    "car": CAR,
    "taxi": CAR,
    "parkedVehicle": CAR,
    "priorityVehicle": CAR,
    "truck": TRUCK,
    "bus": BUS,
    "motorcycle": MOTORCYCLE,
    "bicycle": BICYCLE,
    "pedestrian": PEDESTRIAN,
    "constructionZone": OTHER,
    "roadBoundary": OTHER,
    "pillar": OTHER,
    "building": OTHER,
    "median_strip": OTHER,
}
VERSIONS = ("2020a", "2018b")
MOST_STEPS = 1_000_000

State = tuple[float, float, float, float, float, float]
"""State: step, x, y, heading, speed, acceleration; NaN where the file does not say."""


def _recognises(head: Head) -> bool:
    return head.has_element("commonRoad")


def _read(path: Path) -> Iterator[RecordedTraffic]:
    root = parse_xml(path)
    if root.tag != "commonRoad" or root.get("commonRoadVersion") not in VERSIONS:
        raise FileFormatError(
            f"{path}, line {root.sourceline}: commonRoadVersion must be {' or '.join(VERSIONS)}, "
            f"got '{root.get('commonRoadVersion')}'"
        )
    step = _number(path, root, root.get("timeStepSize"), "timeStepSize [s]")
    if not 1e-4 <= step <= 10.0:
        raise FileFormatError(
            f"{path}, line {root.sourceline}: 0.0001 <= timeStepSize <= 10 [s] must hold, "
            f"got {step:g}"
        )
    found: list[tuple[etree._Element, list[tuple[int, State]]]] = []
    sets = 0
    for element in _obstacles(root, "dynamic"):
        # A set of places that might be taken is no motion.
        if element.find("trajectory") is None and element.find("occupancySet") is not None:
            sets += 1
            continue
        states = [*element.iterfind("initialState"), *element.iterfind("trajectory/state")]
        found.append((element, [(_line(item), _state(path, item)) for item in states]))
    # Static obstacles have one state, and stand as long as anybody moves.
    last = max((state[0] for _, states in found for _, state in states), default=1.0)
    for element in _obstacles(root, "static"):
        for item in element.iterfind("initialState"):
            state = _state(path, item)
            steps = range(int(state[0]), max(int(last), int(state[0]) + 1) + 1)
            rows = [(_line(item), (float(k), *state[1:4], 0.0, 0.0)) for k in steps]
            found.append((element, rows))
    found = [(element, rows) for element, rows in found if rows]
    if not found:
        raise FileFormatError(f"{path}: holds no obstacle with a trajectory")
    rows = [row for _, rows in found for row in rows]
    table = np.array([state for _, state in rows])
    boxes = [_box(path, element) for element, _ in found]
    ids = np.repeat(np.arange(len(found)), [len(rows) for _, rows in found])
    notes = [f"{sets} obstacles with an occupancy set only are left out"] if sets else []
    facts = Facts(
        name=root.get("benchmarkID") or path.stem,
        format=FORMAT.name,
        source=str(path),
        time_step=step,
        frame="the scenario's",
        map="lanelets of the file" if root.find("lanelet") is not None else "",
        notes=tuple(notes),
        lanelets=tuple(_lanelet(path, item) for item in root.iterfind("lanelet")),
    )
    heading, speed = table[:, 3], table[:, 4]
    yield build(
        facts,
        ids,
        {
            "time": table[:, 0] * step,
            "x": table[:, 1],
            "y": table[:, 2],
            "heading": heading,
            "vx": speed * np.cos(heading),
            "vy": speed * np.sin(heading),
            "acceleration": table[:, 5],
        },
        lambda i: f"{path}, line {rows[i][0]}",
        names=[element.get("id") or "" for element, _ in found],
        kind=[KINDS.get(element.findtext("type") or "", UNKNOWN_KIND) for element, _ in found],
        length=[length for length, _ in boxes],
        width=[width for _, width in boxes],
    )


def _lanelet(path: Path, element: etree._Element) -> Lanelet:
    left, right = (
        np.array(
            [
                [_number(path, point, point.findtext(axis), axis) for axis in ("x", "y")]
                for point in element.iterfind(f"{side}/point")
            ]
        ).reshape(-1, 2)
        for side in ("leftBound", "rightBound")
    )
    if min(len(left), len(right)) < 2:
        raise FileFormatError(
            f"{path}, line {_line(element)}: a lanelet must have two points at least on each bound"
        )
    if not max(np.abs(left).max(), np.abs(right).max()) <= FARTHEST:
        raise FileFormatError(
            f"{path}, line {_line(element)}: x and y [m] of a lanelet must be within ±{FARTHEST:g}"
        )
    beside = {
        f"{side}{item.get('drivingDir')}": item.get("ref") or ""
        for side in ("Left", "Right")
        for item in element.iterfind(f"adjacent{side}")
    }
    return Lanelet(
        name=element.get("id") or "",
        left=left,
        right=right,
        left_same=beside.get("Leftsame", ""),
        right_same=beside.get("Rightsame", ""),
        left_opposite=beside.get("Leftopposite", ""),
        successors=tuple(item.get("ref") or "" for item in element.iterfind("successor")),
        kinds=tuple((item.text or "").strip() for item in element.iterfind("laneletType")),
    )


def _obstacles(root: etree._Element, role: str) -> Iterator[etree._Element]:
    yield from root.iterfind(f"{role}Obstacle")
    for element in root.iterfind("obstacle"):  # 2018b
        if element.findtext("role") == role:
            yield element


def _line(element: etree._Element) -> int:
    return int(element.sourceline or 0)


def _state(path: Path, element: etree._Element) -> State:
    step = _value(path, element, "time")
    if not 0.0 <= step <= MOST_STEPS or step != int(step):
        raise FileFormatError(
            f"{path}, line {_line(element)}: time must be a number of steps, 0 to {MOST_STEPS}, "
            f"got {step:g}"
        )
    point = element.find("position/point")
    if point is not None:
        x, y = (_number(path, point, point.findtext(axis), axis) for axis in ("x", "y"))
    else:
        centre = element.find("position//center")
        if centre is None:
            raise FileFormatError(f"{path}, line {_line(element)}: a state must have a position")
        x, y = (_number(path, centre, centre.findtext(axis), axis) for axis in ("x", "y"))
    heading, speed, acceleration = (
        _value(path, element, name) if element.find(name) is not None else math.nan
        for name in ("orientation", "velocity", "acceleration")
    )
    return step, x, y, heading, speed, acceleration


def _value(path: Path, element: etree._Element, name: str) -> float:
    exact = element.findtext(f"{name}/exact")
    if exact is not None:
        return _number(path, element, exact, name)
    ends = [
        _number(path, element, element.findtext(f"{name}/{end}"), name)
        for end in ("intervalStart", "intervalEnd")
    ]
    # CommonRoad states uncertainty as an interval; one trajectory needs one value.
    return 0.5 * sum(ends)


def _number(path: Path, element: etree._Element, text: str | None, what: str) -> float:
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise FileFormatError(
            f"{path}, line {_line(element)}: {what} must be a number, got '{(text or '')[:40]}'"
        )
    return value


def _box(path: Path, element: etree._Element) -> tuple[float, float]:
    """Return length and width [m] of an obstacle's first shape; NaN if it has none."""
    for shape in element.iterfind("shape/*"):
        if shape.tag == "rectangle":
            length, width = (
                _number(path, shape, shape.findtext(name), name) for name in ("length", "width")
            )
            return length, width
        if shape.tag == "circle":
            radius = _number(path, shape, shape.findtext("radius"), "radius")
            return 2.0 * radius, 2.0 * radius
        if shape.tag == "polygon":
            points = [
                [_number(path, item, item.findtext(axis), axis) for axis in ("x", "y")]
                for item in shape.iterfind("point")
            ]
            if points:
                # The polygon stands in the obstacle's own frame, so its extents are length and
                # width.
                size = np.ptp(np.array(points), axis=0)
                return float(size[0]), float(size[1])
    return math.nan, math.nan


FORMAT = Format(
    name="CommonRoad",
    title="CommonRoad 2020a and 2018b (.xml)",
    recognises=_recognises,
    read=_read,
)
