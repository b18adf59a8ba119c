"""Page data that is seldom needed: deflated, as text; ``inflate.js`` reads it."""

import json
import zlib
from base64 import b64encode
from collections.abc import Iterable, Mapping
from itertools import islice
from typing import Any

import numpy as np

from bridgegen.pages.playback import Playback
from bridgegen.pages.playback_payload import playback_payload, road_payload

CHUNK = 40
"""Scenarios that are deflated together: as they are alike, they take a third of the space."""

MOST_FILES = 200_000
"""Maximum number of characters of all files together."""

OF_ROW = ("parameters", "metrics")
"""Fields that the page takes from a row instead of from its playback."""


def deflated(data: bytes) -> str:
    """Return bytes as zlib's format in base64."""
    return b64encode(zlib.compress(data, 9)).decode("ascii")


def packed_motions(
    playbacks: Iterable[Playback], roads: Mapping[Any, int], room: int, *, of_rows: bool
) -> dict[str, Any]:
    """Return the motions of the first scenarios, as many as there is room for.

    Each text is a chunk: JSON of ``playbacks`` as in the page's own data, and of ``roads``, the
    roads of these that the page does not hold; number −1 is the first of them.

    Args:
        playbacks: the scenarios; at most one chunk beyond the room is consumed.
        roads: the numbers of the page's roads, by `road_key`.
        room: maximum number of characters of all texts together.
        of_rows: whether they are rows of the page, which has their parameters and metrics.
    """
    texts: list[str] = []
    evaluations: list[int] = []
    left = iter(playbacks)
    while some := tuple(islice(left, CHUNK)):
        own: dict[Any, int] = {}
        motions, drawn = [], []
        for playback in some:
            key = road_key(playback)
            if key not in roads and key not in own:
                own[key] = -1 - len(own)
                drawn.append(road_payload(playback))
            motion = playback_payload(playback, roads[key] if key in roads else own[key], None)
            without = OF_ROW if of_rows else ()
            motions.append({name: value for name, value in motion.items() if name not in without})
        chunk = {"playbacks": motions, "roads": drawn}
        text = deflated(json.dumps(chunk, allow_nan=False, separators=(",", ":")).encode())
        room -= len(text)
        if room < 0:
            break
        texts.append(text)
        evaluations += [playback.evaluation for playback in some]
    return {"chunk": CHUNK, "evaluations": evaluations, "texts": texts}


def packed_files(files: Mapping[str, bytes]) -> dict[str, Any]:
    """Return the first files, as many as there is room for.

    Scenarios' files have most lines in common, so each line is held once: ``lines`` are the
    different ones, joined by a line feed. ``runs`` are, for each of ``names``, the lines that it
    consists of: ``[first, number, first, number …]``, where lines follow each other.
    """
    number: dict[bytes, int] = {}
    runs: list[list[int]] = []
    lines, starts = zlib.compressobj(9), zlib.compressobj(9)
    size = 0
    for data in files.values():
        # What it would add is compressed in copies: a stream cannot be rewound.
        # Of ten scenarios' 40 files with 2.9 MB, 226 kB are different lines: held once they take 58
        # kB deflated, file by file 521 kB.
        new = {line: None for line in data.split(b"\n") if line not in number}
        for line in new:
            number[line] = len(number)
        run = _runs([number[line] for line in data.split(b"\n")])
        more_lines, more_starts = lines.copy(), starts.copy()
        size += len(more_lines.compress(b"\n".join([*new, b""])))
        size += len(more_lines.flush(zlib.Z_SYNC_FLUSH))
        size += len(more_starts.compress(_json(run))) + len(more_starts.flush(zlib.Z_SYNC_FLUSH))
        if size * 4 / 3 > MOST_FILES:  # as base64
            for line in new:
                del number[line]
            break
        lines, starts = more_lines, more_starts
        runs.append(run)
    return {
        "names": [*files][: len(runs)],
        "lines": deflated(b"\n".join(number)),
        "runs": deflated(_json(runs)),
    }


def _runs(numbers: list[int]) -> list[int]:
    """Return stretches of successive numbers, each as its first and its length."""
    values = np.array(numbers)
    starts = np.flatnonzero(np.diff(values, prepend=values[0] - 2) != 1)
    lengths = np.diff(starts, append=len(values))
    pairs: list[int] = np.stack([values[starts], lengths], axis=1).ravel().tolist()
    return pairs


def _json(value: Any) -> bytes:
    return json.dumps(value, separators=(",", ":")).encode()


def road_key(playback: Playback) -> tuple[tuple[str, bytes], ...]:
    """Return a key that identifies a playback's road."""
    return tuple((lane.kind, lane.points.tobytes()) for lane in playback.lanes)
