"""What the page holds but seldom needs: deflated, as text; ``inflate.js`` reads it."""

import json
import zlib
from base64 import b64encode
from collections.abc import Iterable, Mapping
from itertools import islice
from typing import Any

from bridgegen.report.playback import Playback
from bridgegen.report.playback_payload import playback_payload, road_payload

CHUNK = 20
"""Scenarios that are deflated together: alike, they take a third of what each would alone."""

MOST_MOTION = 4_000_000
"""Characters that all motions together may take."""

MOST_FILES = 1_000_000
"""Characters that all files together may take."""


def deflated(data: bytes) -> str:
    """Return bytes as zlib's format in base64."""
    return b64encode(zlib.compress(data, 9)).decode("ascii")


def packed_motions(playbacks: Iterable[Playback], roads: Mapping[Any, int]) -> dict[str, Any]:
    """Return the motions of scenarios, as many of the first as there is room for.

    Each text is a chunk: JSON of ``playbacks`` as in the page's own data, and of ``roads``, those
    of them that the page has not got; number −1 is the first of these.

    Args:
        playbacks: the scenarios; those that find no room are not asked for, a few excepted.
        roads: the numbers of the page's roads, by `road_key`.
    """
    texts: list[str] = []
    evaluations: list[int] = []
    room, left = MOST_MOTION, iter(playbacks)
    while some := tuple(islice(left, CHUNK)):
        own: dict[Any, int] = {}
        told, drawn = [], []
        for one in some:
            key = road_key(one)
            if key not in roads and key not in own:
                own[key] = -1 - len(own)
                drawn.append(road_payload(one))
            told.append(playback_payload(one, roads[key] if key in roads else own[key], None))
        chunk = {"playbacks": told, "roads": drawn}
        text = deflated(json.dumps(chunk, allow_nan=False, separators=(",", ":")).encode())
        room -= len(text)
        if room < 0:
            break
        texts.append(text)
        evaluations += [one.evaluation for one in some]
    return {"chunk": CHUNK, "evaluations": evaluations, "texts": texts}


def packed_files(files: Mapping[str, bytes]) -> dict[str, str]:
    """Return files by their names, as many of the first as there is room for."""
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
    """Return what tells a road from another."""
    return tuple((lane.kind, lane.points.tobytes()) for lane in playback.lanes)
