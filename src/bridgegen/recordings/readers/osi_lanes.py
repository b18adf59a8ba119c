"""The lanes of an OSI GroundTruth: driving lanes with a centre line.

Source: ASAM OSI 3.7, osi_lane.proto.
"""

from collections.abc import Iterable

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.recordings.readers.centre_lines import lanelets_of_centre_lines
from bridgegen.recordings.readers.lanelets import Lanelet
from bridgegen.recordings.readers.road_lines import CentreLine
from bridgegen.recordings.readers.wire import Message, Shape

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
    3: "bicycleLane", 4: "sidewalk", 5: "parking", 7: "restricted", 8: "border", 9: "shoulder",
}  # fmt: skip


def lanelets_of(truth: Message) -> tuple[tuple[Lanelet, ...], tuple[str, ...]]:
    """Return the lanelets of a message, and what was assumed.

    Raises:
        FileFormatError: the message is malformed, or its map too large; with the byte.
    """
    spans = truth.find(LANE_BOUNDARY, LANE)
    names = _BOUNDARY.read(truth, spans[LANE_BOUNDARY])["id"]
    road: dict[str, list[Float]] = {}
    for name, (begin, end) in zip(names.tolist(), spans[LANE_BOUNDARY].tolist(), strict=True):
        one = truth.part(begin, end)
        points = _points(_BOUNDARY_POINT.read(one, one.find(2)[2]))
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
            ascending = about["ascending"][k] == 1
            pairs = _PAIR.read(inner, found[_PAIRING])["after" if ascending else "before"]
            borders = np.concatenate([found[_RIGHT_BORDERS], found[_LEFT_BORDERS]])
            subtype = _SUBTYPES.get(int(about["subtype"][k]))
            lines.append(CentreLine(
                name=str(about["id"][k]), points=points if ascending else points[::-1],
                borders=_texts(_IDENTIFIER.read(inner, borders)["id"].tolist()),
                successors=_texts(pairs.tolist()) if len(pairs) else None,
                kinds=(subtype,) if subtype else (),
            ))  # fmt: skip
    joined = {name: np.concatenate(parts) for name, parts in road.items() if parts}
    lanelets, notes = lanelets_of_centre_lines(lines, joined, truth.place(truth.begin))
    if without:
        notes = (*notes, f"{without} driving lanes without a centre line are left out")
    return lanelets, notes


def _points(columns: dict[str, Float]) -> Float:
    return np.column_stack([columns["x"], columns["y"]])


def _texts(ids: Iterable[int]) -> tuple[str, ...]:
    return tuple(str(one) for one in ids if one >= 0)
