"""A rollout as a trace of ASAM OSI: one GroundTruth or SensorView an instant, in an MCAP file.

Each message has the lanes near the participants, as viewers expect it. Roads are flat, and bodies
as high as usual ones; brake lights follow from the deceleration where the rollout has no lights.

Source: ASAM OSI 3.7.0, and its naming of trace files.
"""

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import pi
from pathlib import Path

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.base.disk import write_whole
from bridgegen.base.protobuf import Parts, flat, nested, rows
from bridgegen.drivers import kinds
from bridgegen.drivers._weather_columns import BACKGROUND, RAIN, SNOW, VISUAL_RANGE
from bridgegen.drivers.osi import (
    OSI,
    VALUES,
    VERSION,
    codes,
    identifier,
    known,
    lanes_near,
    message,
    moving_object,
    size,
    stamped,
    turned,
    vector,
)
from bridgegen.openx.opendrive.mirror import as_written
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.outline import lights
from bridgegen.simulation.osi.mcap import mcap
from bridgegen.simulation.rollout import Rollout

GROUND_TRUTH, SENSOR_VIEW = "GroundTruth", "SensorView"
ENDINGS = {GROUND_TRUTH: "_gt.mcap", SENSOR_VIEW: "_sv.mcap"}
"""How names of files end, by what their messages are."""

_HEIGHT = 1.5  # m, where the kind is unknown
_LAMPS = {"RED": ((1, 2), 3.6), "YELLOW": ((2, 3), 3.3), "GREEN": ((4,), 3.0)}
"""Of each lamp of a traffic light the states in which it is lit, and its height [m]."""
_RAIN = (0.1, 0.5, 1.9, 8.1, 34.0, 149.0)  # mm/h
_RAINS = VALUES["EnvironmentalConditions.Precipitation"][2:]
_SIGHT = (50.0, 200.0, 1000.0, 2000.0, 4000.0, 10_000.0, 40_000.0)  # m
_FOGS = VALUES["EnvironmentalConditions.Fog"][:1:-1]
_LIT = (0.01, 1.0, 3.0, 10.0, 20.0, 400.0, 1000.0, 10_000.0)  # lx
_ALBEDO = 0.2  # of what ``BACKGROUND`` is the luminance of, see ``drivers._physics_kernels``

_EGO = 1
"""The ego's id; those of the others, of borders, lanes and lamps follow."""


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What is around a scenario's participants.

    Attributes:
        roads: the map; None, or one without roads, where there is none.
        weather: from which instant on, and ``(WEATHER,)`` float64; empty where it is unknown.
    """

    roads: OpenDrive | None = None
    weather: Sequence[tuple[int, Float]] = ()


def write_osi(paths: Sequence[Path], rollout: Rollout, around: Surroundings, row: int = 0) -> None:
    """Write one scenario of a rollout as MCAP files, each whole or not at all.

    Args:
        paths: the files; one whose name ends in _sv.mcap has SensorViews, another GroundTruths.
        rollout: N scenarios.
        around: the map and the weather of that scenario.
        row: which of them.

    Raises:
        StorageError: one cannot be written.
    """
    truths = [*ground_truths(rollout, around, row)]
    version, library = ".".join(map(str, VERSION)), "3.0.0"  # any that reads these bytes
    about = dict.fromkeys(("version", "min_osi_version", "max_osi_version"), version)
    about |= dict.fromkeys(("min_protobuf_version", "max_protobuf_version"), library)
    versions = {"osi_version": version, "protobuf_version": library}
    channel = {f"net.asam.osi.trace.channel.{key}": text for key, text in versions.items()}
    for path in paths:
        is_view = path.name.lower().endswith(ENDINGS[SENSOR_VIEW])
        kind = SENSOR_VIEW if is_view else GROUND_TRUTH
        messages = map(_sensor_view, truths) if is_view else truths
        metadata = ("net.asam.osi.trace", about)
        write_whole(
            path, mcap(kind, f"osi3.{kind}", OSI.descriptors(), messages, metadata, channel)
        )


def _sensor_view(truth: tuple[int, bytes]) -> tuple[int, bytes]:
    time, data = truth
    head = message(
        SENSOR_VIEW, **stamped(time), sensor_id=identifier(_EGO), host_vehicle_id=identifier(_EGO)
    )
    return time, flat([*head, *nested(7, [data])])


def ground_truths(
    rollout: Rollout, around: Surroundings, row: int = 0
) -> Iterator[tuple[int, bytes]]:
    """Yield time [ns] and bytes of a GroundTruth for each instant of one scenario."""
    rollout, n = rollout.as_driven(), int(rollout.n_steps[row])
    road, changing = b"", [nested(5, _object(rollout, row, e, n)) for e in range(rollout.shape[1])]
    if around.roads is not None and around.roads.roads:
        road, lamps = _road(as_written(around.roads), rollout, row, n)
        changing += lamps
    states = [rows(parts, n) for parts in changing]
    present = np.ones((len(states), n), np.bool_)
    if rollout.present.size:
        present[: rollout.shape[1]] = rollout.present[row, :, :n]
    begins = [k for k, _ in around.weather]
    static = [flat(_environment(weather)) + road for _, weather in around.weather] or [road]
    for k in range(n):
        time = round(k * rollout.time_step * 1e9)
        head = flat(message(GROUND_TRUTH, **stamped(time), host_vehicle_id=identifier(_EGO)))
        there = [states[i][k] for i in np.flatnonzero(present[:, k]).tolist()]
        yield time, b"".join((head, *there, static[max(bisect_right(begins, k) - 1, 0)]))


def _object(rollout: Rollout, row: int, e: int, n: int) -> Parts:
    """Return a participant at its n instants."""
    kind, height = _kind_of(rollout, e), height_of(rollout, e)
    length, width, ahead = rollout.box[e].tolist()
    x, y, h, v, a = (getattr(rollout, name)[row, e, :n] for name in ("x", "y", "h", "v", "a"))
    cos, sin = elementary.cos(h), elementary.sin(h)
    rate = np.gradient(h, rollout.time_step) if n > 1 else np.zeros(n)
    if rollout.lamps.size:
        lit = rollout.lamps[row, e, :n].astype(np.int64)
    else:
        lit = kinds.BRAKE * (a < -kinds.BRAKE_LIGHTS_FROM)
    return moving_object(
        _EGO + e,
        kind,
        (length, width, height),
        # The box's centre moves across, too, where the reference point moves ahead.
        vector(x + ahead * cos, y + ahead * sin, 0.5 * height),
        h,
        vector(v * cos - rate * ahead * sin, v * sin + rate * ahead * cos),
        lit,
        acceleration=vector(a * cos - v * rate * sin, a * sin + v * rate * cos),
        rate=rate,
        ahead=ahead,
        name=rollout.names[e],
    )


def _kind_of(rollout: Rollout, e: int) -> str:
    known = len(rollout.kinds) and rollout.kinds[e] >= 0
    return kinds.NAMES[rollout.kinds[e]] if known else ""


def height_of(rollout: Rollout, e: int) -> float:
    """Return the usual height of a participant's kind [m]."""
    kind = _kind_of(rollout, e)
    return kinds.HEIGHTS[kinds.NAMES.index(kind)] if kind else _HEIGHT


def _environment(weather: Float) -> Parts:
    lit = 1 + bisect_right(_LIT, float(weather[BACKGROUND]) * pi / _ALBEDO)
    conditions = message(
        "EnvironmentalConditions",
        ambient_illumination=f"LEVEL{lit}",
        precipitation=_RAINS[bisect_right(_RAIN, float(weather[RAIN] + weather[SNOW]))],
        fog=_FOGS[bisect_right(_SIGHT, float(weather[VISUAL_RANGE]))],
    )
    return message(GROUND_TRUTH, environmental_conditions=conditions)


# --- The road network ---


def _road(model: OpenDrive, rollout: Rollout, row: int, n: int) -> tuple[bytes, list[Parts]]:
    """Return the lanes near the participants with their borders; and the lamps, which change."""
    from bridgegen.drivers.road_map import road_map

    found = road_map(model, None, rollout.light_names)
    there = rollout.present[row, :, :n] if rollout.present.size else np.s_[:]
    places = np.array([rollout.x[row, :, :n][there].ravel(), rollout.y[row, :, :n][there].ravel()])
    parts, ids, first = lanes_near(found.lanes, places, _EGO + rollout.shape[1])
    governed = {light.id: light.lanes for light in found.lights}
    lamps = list[Parts]()
    for pole in (each for each in lights(model) if each.id in governed):
        states = rollout.lights[row, rollout.light_names.index(pole.id), :n]
        yaw = pole.h - pi if pole.h > 0.0 else pole.h + pi  # it faces the traffic
        for color, (lit, z) in _LAMPS.items():
            kind = "TrafficLight.Classification"
            lamp = message(
                "TrafficLight",
                id=identifier(first + len(lamps)),
                base=message(
                    "BaseStationary",
                    dimension=size(0.1, 0.3, 0.3),
                    position=vector(pole.x, pole.y, z),
                    orientation=turned(yaw),
                ),
                classification=message(
                    kind,
                    color=color,
                    icon="NONE",
                    mode=codes(f"{kind}.Mode", np.isin(states, lit), "CONSTANT"),
                    assigned_lane_id=known(ids, *governed[pole.id]),
                ),
            )
            lamps.append(nested(7, lamp))
    return flat(parts), lamps
