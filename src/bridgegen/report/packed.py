"""Page data that is seldom needed: deflated, as text; ``inflate.js`` reads it."""

import json
import zlib
from base64 import b64encode
from collections.abc import Iterable, Mapping
from itertools import islice
from typing import Any

from bridgegen.report.playback import Playback
from bridgegen.report.playback_payload import playback_payload, road_payload

CHUNK = 20
"""Scenarios that are deflated together: as they are alike, they take a third of the space."""

MOST_MOTION = 4_000_000
"""Maximum number of characters of all motions together."""

MOST_FILES = 1_000_000
"""Maximum number of characters of all files together."""


def deflated(data: bytes) -> str:
    """Return bytes as zlib's format in base64."""
    return b64encode(zlib.compress(data, 9)).decode("ascii")


def packed_motions(playbacks: Iterable[Playback], roads: Mapping[Any, int]) -> dict[str, Any]:
    """Return the motions of the first scenarios, as many as there is room for.

    Each text is a chunk: JSON of ``playbacks`` as in the page's own data, and of ``roads``, the
    roads of these that the page does not hold; number −1 is the first of them.

    Args:
        playbacks: the scenarios; at most one chunk beyond the room is consumed.
        roads: the numbers of the page's roads, by `road_key`.
    """
    texts: list[str] = []
    evaluations: list[int] = []
    room, left = MOST_MOTION, iter(playbacks)
    while some := tuple(islice(left, CHUNK)):
        own: dict[Any, int] = {}
        motions, drawn = [], []
        for one in some:
            key = road_key(one)
            if key not in roads and key not in own:
                own[key] = -1 - len(own)
                drawn.append(road_payload(one))
            motions.append(playback_payload(one, roads[key] if key in roads else own[key], None))
        chunk = {"playbacks": motions, "roads": drawn}
        text = deflated(json.dumps(chunk, allow_nan=False, separators=(",", ":")).encode())
        room -= len(text)
        if room < 0:
            break
        texts.append(text)
        evaluations += [one.evaluation for one in some]
    return {"chunk": CHUNK, "evaluations": evaluations, "texts": texts}


def packed_files(files: Mapping[str, bytes]) -> dict[str, str]:
    """Return the first files by their names, as many as there is room for."""
    found: dict[str, str] = {}
    room = MOST_FILES
    for name, data in files.items():
        text = deflated(data)
        room -= len(text)
        if room < 0:
            break
        found[name] = text
    return found


def road_key(playback: Playback) -> tuple[tuple[str, bytes], ...]:
    """Return a key that identifies a playback's road."""
    return tuple((lane.kind, lane.points.tobytes()) for lane in playback.lanes)
