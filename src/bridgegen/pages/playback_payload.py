"""A playback as the JSON that the page reads; ``unpack.js`` makes arrays of it again.

What has a value at every instant is a `series`, rounded to what a screen can show: positions are
half a millimetre off at most, headings 0.003°.
"""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.assess.metrics.distances import first_closest
from bridgegen.base.arrays import Float, Int
from bridgegen.drivers import kinds as column
from bridgegen.pages.findings_payload import conflict_payload
from bridgegen.pages.playback import Beside, Course, Lamp, Planned, Playback, Sensed, Weather
from bridgegen.pages.series import packed
from bridgegen.scenario.participants import PARTICIPANTS, drawing_of
from bridgegen.scenario.weather import in_words

SCALE = {
    "x": 1000,
    "y": 1000,
    "h": 10_000,
    "v": 1000,
    "a": 100,
    "distance": 1000,
    "ttc": 100,
    "length": 100,
    "width": 100,
    "confidence": 100,
    "station": 100,
    "shift": 100,
}
"""Units to 1 m, rad, m/s … of each quantity that the page has as whole numbers."""

MILLIMETRE = 3
ANGLE = 4


def road_payload(playback: Playback) -> list[dict[str, Any]]:
    """Return the road's outlines: x, y of the first point, then differences, in whole units."""
    return [
        {"kind": lane.kind, "points": _line(lane.points, ROAD_SCALE)} for lane in playback.lanes
    ]


ROAD_SCALE = 100
"""Units to 1 m of the road and other fixed objects; half a centimetre is nowhere seen."""


def _line(points: Float, scale: int) -> list[int]:
    units = np.round(points * scale).astype(np.int64)
    steps: list[int] = np.diff(units, axis=0, prepend=0).ravel().tolist()
    return steps


def playback_payload(p: Playback, road: int, picture: int | None) -> dict[str, Any]:
    """Return a playback.

    Args:
        p: the playback.
        road: number of its road.
        picture: number of its picture, if it has one.
    """
    real = slice(0, p.n_steps)
    contact = p.distance[real] <= 0.0  # before rounding: a miss by 0.1 mm is a miss
    # A contact that lasts is one mark, at its first instant.
    begins = np.flatnonzero(contact & ~np.concatenate([[False], contact[:-1]]))
    finite = np.where(np.isfinite(p.distance[real]), p.distance[real], np.inf)
    lights = [] if p.street_lights is None else np.round(p.street_lights, 1).tolist()
    return {
        "name": p.name,
        "rank": int(p.rank),
        "evaluation": int(p.evaluation),
        "critical": bool(p.critical),
        "cause": p.cause,
        "conflict": None if p.conflict is None else conflict_payload(p.conflict, p.cause),
        "parameters": {name: number(value) for name, value in p.parameters.items()},
        "metrics": {name: number(value) for name, value in p.metrics.items()},
        "files": list(p.files),
        "time_step": float(p.time_step),
        "n_steps": int(p.n_steps),
        "road": road,
        "picture": picture,
        "entities": [
            {
                "name": e.name,
                "length": float(e.length),
                "width": float(e.width),
                "center_ahead": float(e.center_ahead),
                "height": PARTICIPANTS.get(e.type, PARTICIPANTS["car"]).body.height,
                "shape": drawing_of(e.type).shape,
                "headlights": drawing_of(e.type).headlights,
                "shows": [] if p.shows is None else _shows(p.shows[i, : p.n_steps]),
            }
            for i, e in enumerate(p.entities)
        ],
        "lamps": [_lamp(lamp, p.n_steps) for lamp in p.lamps],
        "series": _series(p),
        "closest": first_closest(finite) if np.isfinite(finite).any() else None,
        "contacts": begins.tolist(),
        "sensed": None if p.sensed is None else _sensed(p.sensed, p),
        "course": None if p.course is None else _course(p.course, p.n_steps),
        "plans": [_planned(plan) for plan in p.plans if plan.step < p.n_steps],
        "beside": [_beside(beside, p.n_steps) for beside in p.beside if beside.entities],
        "weather": [_weather(weather) for weather in p.weather if weather.step < p.n_steps],
        "street_lights": lights,
    }


def _series(p: Playback) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name in "xyhva":
        rows = getattr(p, name)
        if rows is not None:
            found[name] = [packed(row[: p.n_steps], SCALE[name]) for row in rows]
    for name in ("distance", "ttc"):
        row = getattr(p, name)
        if row is not None:
            found[name] = packed(row[: p.n_steps], SCALE[name])
    return found


def _beside(beside: Beside, n_steps: int) -> dict[str, Any]:
    x = beside.x[:, :n_steps]
    # x is NaN where an entity is absent; then nothing of it is sent.
    y, h = (np.where(np.isnan(x), np.nan, row[:, :n_steps]) for row in (beside.y, beside.h))
    series = {"x": x, "y": y, "h": h}
    return {
        "label": beside.label,
        "entities": list(beside.entities),
        **{name: [packed(row, SCALE[name]) for row in rows] for name, rows in series.items()},
    }


def _lamp(lamp: Lamp, n_steps: int) -> dict[str, Any]:
    """Return a light with the steps at which it changes, and to what."""
    states = lamp.states[:n_steps]
    changes = [0, *(np.flatnonzero(np.diff(states)) + 1).tolist()]
    return {
        "name": lamp.name,
        "x": round(float(lamp.x), MILLIMETRE),
        "y": round(float(lamp.y), MILLIMETRE),
        "h": round(float(lamp.h), ANGLE),
        "changes": [[k, int(states[k])] for k in changes],
    }


def _weather(weather: Weather) -> dict[str, Any]:
    numbers = {**weather.stated, "sight": weather.sight, "background": weather.background}
    return {
        "step": weather.step,
        "words": in_words(weather.stated),
        **{name: number(_digits(value, 4)) for name, value in numbers.items()},
    }


def _phantom(ghost: Float, steps: Int, p: Playback) -> Any:
    """Return a ghost's detections: the frame, and the columns of a detection from x on, scaled.

    The centre is that from the ego's reference point.
    """
    frames = np.flatnonzero(ghost[:, column.SEEN_BY] == column.GHOST)
    here = np.column_stack((p.x[0, steps[frames]], p.y[0, steps[frames]]))
    scales = [SCALE[name] for name in ("length", "length", "h", "length", "width", "confidence")]
    rows = ghost[frames, 1:] * [*scales, 1]
    rows[:, :2] -= here * SCALE["length"]
    return np.column_stack((frames, np.round(rows))).astype(np.int64).tolist()


def _sensed(s: Sensed, p: Playback) -> dict[str, Any]:
    """Return detections: a letter per entity and frame, and six numbers of each detection.

    The numbers are the detected centre [cm from the true one], the heading [0.1 mrad from the true
    one], length and width [cm], confidence [%]; where it was taken for something else, what for.
    The letter: ``-`` not applicable, ``0`` missed, ``1`` to ``3`` the sensor; ``m``, ``a`` to ``c``
    the same beyond what the metrics count.
    """
    kept = s.steps < p.n_steps
    steps = s.steps[kept]
    entities = []
    for e, body in enumerate(p.entities):
        seen, counts = s.seen_by[e, kept], s.counts[e, kept]
        detected = np.flatnonzero(seen > 0)
        k = steps[detected]
        cos, sin = np.cos(p.h[e, k]), np.sin(p.h[e, k])
        turn = s.h[e, kept][detected] - p.h[e, k]
        columns = [
            # Relative to the body: small numbers, which deflate well.
            (s.x[e, kept][detected] - (p.x[e, k] + body.center_ahead * cos)) * SCALE["length"],
            (s.y[e, kept][detected] - (p.y[e, k] + body.center_ahead * sin)) * SCALE["length"],
            (turn - 2.0 * math.pi * np.round(turn / (2.0 * math.pi))) * SCALE["h"],
            s.length[e, kept][detected] * SCALE["length"],
            s.width[e, kept][detected] * SCALE["width"],
            s.confidence[e, kept][detected] * SCALE["confidence"],
        ]
        kind = s.kind[e, kept][detected]
        wrong = np.flatnonzero(kind != s.kind_of[e])
        letters = [
            "-" if by < 0 else ("0123" if counted else "mabc")[by]
            for by, counted in zip(seen.tolist(), counts.tolist(), strict=True)
        ]
        entities.append(
            {
                "seen": "".join(letters),
                "numbers": [np.round(column).astype(np.int64).tolist() for column in columns],
                "taken_for": [[int(i), int(kind[i])] for i in wrong],
            }
        )
    return {
        "steps": np.diff(steps, prepend=0).tolist(),
        "entities": entities,
        "phantoms": [_phantom(ghost[kept], steps, p) for ghost in s.ghosts],
        "kinds": list(s.kinds),
        "tolerance": s.tolerance,
    }


def _course(c: Course, n_steps: int) -> dict[str, Any]:
    kept = c.steps < n_steps
    steps = c.steps[kept]
    shift = c.shift[kept]
    moved = np.ones(len(shift), dtype=np.bool_)
    # Only where it changes: most of the time, a driver keeps its lane.
    moved[1:] = (shift[1:] != shift[:-1]).any(axis=1)
    if not shift.any():
        moved[:] = False
    return {
        "ways": [_line(way, ROAD_SCALE) for way in c.ways],
        "steps": np.diff(steps, prepend=0).tolist(),
        "way": _changes(c.way[kept]),
        "station": packed(c.station[kept], SCALE["station"]),
        "acceleration": packed(c.acceleration[kept], SCALE["a"]),
        "shift": [[int(i), *np.round(shift[i], 2).tolist()] for i in np.flatnonzero(moved)],
    }


def _planned(planned: Planned) -> dict[str, Any]:
    return {
        "step": planned.step,
        "seconds": round(planned.seconds, 2),
        "points": _line(planned.points, ROAD_SCALE),
    }


def _shows(states: npt.NDArray[np.int8]) -> list[list[int]]:
    """Return the instants at which what lamps show changes, and to what; nothing shows before."""
    at = np.flatnonzero(np.diff(states, prepend=np.int8(0)))
    return [[int(k), int(states[k])] for k in at]


def _changes(values: np.ndarray) -> list[list[int]]:
    at = np.flatnonzero(np.diff(values, prepend=values[:1] - 1))
    return [[int(i), int(values[i])] for i in at]


def _digits(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}")


def number(value: float | None) -> float | None:
    """Return a number as JSON has it; None for what is not finite."""
    if value is None or not math.isfinite(value):
        return None
    return float(value)
