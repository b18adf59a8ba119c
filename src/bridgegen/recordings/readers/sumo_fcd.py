"""SUMO's floating-car data (--fcd-output, XML), read as a stream.

A position is that of the front bumper's centre, an angle is clockwise from north in degrees. The
file does not say how long a vehicle is: that is taken from its kind, and its kind from the name of
its type, so the centre is as exact as they are.

Source: SUMO user documentation, FCDOutput.
"""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import numpy as np
from lxml import etree

from bridgegen.base.errors import FileFormatError
from bridgegen.drivers.kinds import BICYCLE, BUS, CAR, MOTORCYCLE, PEDESTRIAN, TRUCK
from bridgegen.recordings.readers.format import Format, Head
from bridgegen.recordings.readers.states import usual_box
from bridgegen.recordings.readers.table import (
    MOST_STATES,
    NO_LANE,
    Facts,
    RecordedTraffic,
    build,
    median_step,
)

WORDS = {
    "truck": TRUCK,
    "trailer": TRUCK,
    "bus": BUS,
    "coach": BUS,
    "motorcycle": MOTORCYCLE,
    "moped": MOTORCYCLE,
    "bicycle": BICYCLE,
    "bike": BICYCLE,
    "pedestrian": PEDESTRIAN,
    "ped": PEDESTRIAN,
}
"""Kinds by words in names of types; a vehicle with none of them is a car."""
MOST_BYTES = 8 * 2**30


def _recognises(head: Head) -> bool:
    return head.has_element("fcd-export")


class _Found:
    """The states read so far."""

    def __init__(self) -> None:
        self.ids: list[int] = []
        self.states: list[tuple[float, ...]] = []
        self.lines: list[int] = []
        self.lanes: dict[str, int] = {}
        self.participants: dict[str, int] = {}
        self.kinds: list[int] = []


def _read(path: Path) -> Iterator[RecordedTraffic]:
    found = _Found()
    try:
        if path.stat().st_size > MOST_BYTES:
            raise FileFormatError(f"{path}: may have at most {MOST_BYTES} bytes")
        with path.open("rb") as file:
            _stream(path, file, found)
    except OSError as error:
        raise FileFormatError(f"{path}: cannot be read: {error.strerror}") from None
    except etree.XMLSyntaxError as error:
        raise FileFormatError(f"{path}: not well-formed XML: {error}") from None
    if not found.ids:
        raise FileFormatError(f"{path}: holds no states")
    table, ids = np.array(found.states), np.array(found.ids)
    heading = math.pi / 2 - np.radians(table[:, 3])
    boxes = np.array([usual_box(kind) for kind in found.kinds])
    walking = np.array(found.kinds) == PEDESTRIAN
    behind = np.where(walking, 0.0, 0.5 * boxes[:, 0])[ids]
    order = np.argsort(ids, kind="stable")
    first = np.searchsorted(ids[order], np.arange(len(boxes) + 1))
    facts = Facts(
        name=path.stem,
        format=FORMAT.name,
        source=str(path),
        time_step=median_step(table[order, 0], first),
        frame="the network's",
        notes=("lengths, and by them centres, are the usual ones of each kind",),
    )
    yield build(
        facts,
        ids,
        {
            "time": table[:, 0],
            "x": table[:, 1] - behind * np.cos(heading),
            "y": table[:, 2] - behind * np.sin(heading),
            "heading": heading,
            "vx": table[:, 4] * np.cos(heading),
            "vy": table[:, 4] * np.sin(heading),
            "acceleration": table[:, 5],
            "lane": table[:, 6],
        },
        lambda i: f"{path}, line {found.lines[i]}",
        names=list(found.participants),
        kind=found.kinds,
    )


def _stream(path: Path, file: BinaryIO, found: _Found) -> None:
    """Read all states; each time step's elements are freed once it is read."""
    time = math.nan
    events = etree.iterparse(
        file,
        events=("start", "end"),
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        huge_tree=False,
        remove_comments=True,
        remove_pis=True,
    )
    for event, element in events:
        if event == "start":
            parent = element.getparent()
            if parent is None and element.getroottree().docinfo.doctype:
                raise FileFormatError(f"{path}: a DOCTYPE is refused")
            if element.tag == "timestep":
                time = _number(path, element, "time")
            continue
        if element.tag in ("vehicle", "person"):
            _add(path, found, element, time)
        if element.tag == "timestep":
            element.clear()
            parent = element.getparent()
            while parent is not None and element.getprevious() is not None:
                del parent[0]


def _add(path: Path, found: _Found, element: etree._Element, time: float) -> None:
    name = element.get("id") or ""
    number = found.participants.setdefault(name, len(found.participants))
    if number == len(found.kinds):
        words = (element.get("type") or "").lower()
        usual = PEDESTRIAN if element.tag == "person" else CAR
        found.kinds.append(next((kind for word, kind in WORDS.items() if word in words), usual))
    lane = element.get("lane")
    code = NO_LANE if lane is None else found.lanes.setdefault(lane, len(found.lanes))
    values = [_number(path, element, key) for key in ("x", "y", "angle", "speed")]
    more = "acceleration"
    given = math.nan if element.get(more) is None else _number(path, element, more)
    found.ids.append(number)
    found.states.append((time, *values, given, float(code)))
    found.lines.append(int(element.sourceline or 0))
    if len(found.ids) > MOST_STATES:
        raise FileFormatError(f"{path}: may hold {MOST_STATES:,} states, got more")


def _number(path: Path, element: etree._Element, name: str) -> float:
    text = element.get(name)
    try:
        value = float(text or "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise FileFormatError(
            f"{path}, line {element.sourceline}: {name} must be a number, got '{(text or '')[:40]}'"
        )
    return value


FORMAT = Format(
    name="SUMO FCD",
    title="SUMO's floating-car data (.xml)",
    recognises=_recognises,
    read=_read,
)
