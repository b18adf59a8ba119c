"""Another tool's recording as a rollout, so that the same metrics apply."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import FileFormatError, InputError, UnknownNameError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.read import read as read_scenario
from bridgegen.openx.openscenario.resolve import resolved
from bridgegen.simulation.rollout import Rollout
from bridgegen.simulation.tracks import Track, Tracks, read_tracks

MAX_INSTANTS = 100_000
MAX_STATES = 2_000_000
"""Entities times instants."""
LEAST_STEP, MOST_STEP = 1e-4, 1.0  # s
SAME = 1e-5  # s, two instants that are nearer than this are one
ROUNDING = 1e-6  # s, of times that are written with six decimals …
TOLERANCE = 1e-3  # … and what else an instant may be off, as a share of the step


@dataclass(frozen=True)
class Recording:
    """A recording, read.

    Attributes:
        rollout: N = 1; its ego is the entity that was asked for.
        has_offset: whether the recording has the offset from the lane's centre; else it is 0.
        notes: what was not said by the recording, and what was taken instead.
    """

    rollout: Rollout
    has_offset: bool
    notes: tuple[str, ...]


def boxes_of(path: Path) -> dict[str, tuple[float, float, float]]:
    """Return length, width and the centre's distance ahead [m] of a scenario file's entities.

    Raises:
        FileFormatError: not a valid OpenSCENARIO file.
    """
    scenario = resolved(read_scenario(path), str(path))
    boxes = {}
    for one in scenario.entities.scenario_objects:
        body = one.entity_object
        if isinstance(body, osc.Vehicle | osc.Pedestrian | osc.MiscObject):
            size, centre = body.bounding_box.dimensions, body.bounding_box.center
            boxes[str(one.name)] = (_plain(size.length), _plain(size.width), _plain(centre.x))
    return boxes


def kinds_of(path: Path) -> dict[str, int]:
    """Return what a scenario file's entities are, as `bridgegen.drivers.kinds` numbers it.

    Raises:
        FileFormatError: not a valid OpenSCENARIO file.
    """
    from bridgegen.simulation.embedded.compiler.bodies import kind

    scenario = resolved(read_scenario(path), str(path))
    return {
        str(one.name): kind(one.entity_object)
        for one in scenario.entities.scenario_objects
        if isinstance(one.entity_object, osc.Vehicle | osc.Pedestrian | osc.MiscObject)
    }


def _plain(value: object) -> float:
    assert isinstance(value, float)  # resolved: no parameter is left
    return value


def read_recording(
    path: Path,
    *,
    ego: str | None = None,
    boxes: Mapping[str, tuple[float, float, float]] | None = None,
    time_step: float | None = None,
) -> Recording:
    """Read a trace, another table of states, or the log of esmini.

    Missing accelerations are forward differences of the speed.

    Args:
        path: the file.
        ego: its entity under test; the one of the first line by default.
        boxes: length, width and the centre's distance ahead of the reference point [m] by entity;
            what the file says by default.
        time_step: [s] to resample at, linearly; by default the recording's own steps, which must
            then be equal.

    Raises:
        FileFormatError: not such a file, or values that are none, with their lines.
        UnknownNameError: no such entity.
        InputError: a time step out of range, or steps that are not equal.
    """
    if time_step is not None and not LEAST_STEP <= time_step <= MOST_STEP:
        raise InputError(
            f"{path}: {LEAST_STEP:g} <= time_step <= {MOST_STEP:g} [s] must hold, got {time_step:g}"
        )
    found = read_tracks(path)
    names = list(found.tracks)
    if ego is not None and ego not in found.tracks:
        raise UnknownNameError("entity", ego, names)
    first = names[0] if ego is None else ego
    names.sort(key=lambda name: name != first)  # the others stay in their order
    ordered = [_in_time(found, name) for name in names]
    start, step, n = _clock(found, names[0], ordered[0], time_step)
    if n * len(names) > MAX_STATES:
        raise FileFormatError(
            f"{path}: a recording may have {MAX_STATES} states, got {len(names)} entities at "
            f"{n} instants"
        )
    shape = (1, len(names), n)
    arrays = {name: np.zeros(shape) for name in ("x", "y", "h", "speed", "acceleration", "offset")}
    present = np.zeros(shape, dtype=np.bool_)
    for e, track in enumerate(ordered):
        states = {key: np.array(values) for key, values in track.states.items()}
        states["h"] = np.unwrap(states["h"]) if _jumps(states["h"]) else states["h"]
        if "acceleration" not in states:
            states["acceleration"] = _accelerations(states["speed"], states["time"])
        at = (states["time"] - start) / step
        if time_step is None:
            k = np.rint(at).astype(np.int64)
            off = np.flatnonzero(np.abs(at - k) * step > ROUNDING + TOLERANCE * step)
            if len(off):
                raise FileFormatError(
                    f"{path}, line {track.lines[off[0]]}: '{names[e]}' is at time "
                    f"{states['time'][off[0]]:g}, where '{names[0]}' is not (resample it: --dt)"
                )
            inside = (k >= 0) & (k < n)
            if not inside.all():
                found.notes.append(f"'{names[e]}' counts only while '{names[0]}' is there")
            present[0, e, k[inside]] = True
            for key, array in arrays.items():
                if key in states:
                    array[0, e, k[inside]] = states[key][inside]
        else:
            k = np.arange(n)
            present[0, e] = (k >= at[0] - 1e-9) & (k <= at[-1] + 1e-9)
            for key, array in arrays.items():
                if key in states:
                    array[0, e] = np.interp(k, at, states[key])
    if "acceleration" not in ordered[0].states:
        found.notes.append("accelerations are taken from the speeds")
    if time_step is not None:
        found.notes.append(f"resampled, linearly, every {time_step:g} s")
    return Recording(
        rollout=Rollout(
            time_step=step,
            names=tuple(names),
            box=_boxes(found, names, ordered, boxes),
            x=arrays["x"], y=arrays["y"], h=arrays["h"], v=arrays["speed"],
            a=arrays["acceleration"], offset=arrays["offset"],
            n_steps=np.array([n], dtype=np.int64),
            status=np.zeros(1, dtype=np.int8),
            present=np.zeros((0, 0, 0), np.bool_) if present.all() else present,
        ),
        has_offset="offset" in ordered[0].states,
        notes=tuple(found.notes),
    )  # fmt: skip


def _in_time(found: Tracks, name: str) -> Track:
    """Return a track in the order of time, of which no instant may come twice."""
    track = found.tracks[name]
    times = np.array(track.states["time"])
    order = np.argsort(times, kind="stable")
    twice = np.flatnonzero(np.diff(times[order]) < SAME)
    if len(twice):
        first, second = (track.lines[order[i]] for i in (twice[0], twice[0] + 1))
        raise FileFormatError(
            f"{found.place}, line {second}: '{name}' is at time {times[order[twice[0]]]:g} already "
            f"(line {first})"
        )
    states = {key: [values[i] for i in order] for key, values in track.states.items()}
    return Track(states, [track.lines[i] for i in order])


def _clock(
    found: Tracks, ego: str, track: Track, time_step: float | None
) -> tuple[float, float, int]:
    """Return the first instant, the step [s] and the number of instants, as the ego has them."""
    times = np.array(track.states["time"])
    if len(times) < 2:
        raise FileFormatError(f"{found.place}: '{ego}' needs two instants at least, got one")
    steps = np.diff(times)
    if time_step is None:
        mean = (times[-1] - times[0]) / len(steps)
        step = next((one for one in (float(steps[0]), float(mean)) if _fits(times, one)), None)
        if step is None:
            raise InputError(
                f"{found.place}: the steps between the instants of '{ego}' must be equal, they are "
                f"{steps.min():g} to {steps.max():g} s (resample it: --dt {np.median(steps):g})"
            )
        n = len(times)
    else:
        step, n = time_step, int((times[-1] - times[0]) / time_step + 1e-9) + 1
    if not LEAST_STEP <= step <= MOST_STEP or not 2 <= n <= MAX_INSTANTS:
        raise InputError(
            f"{found.place}: a recording must have 2 to {MAX_INSTANTS} instants {LEAST_STEP:g} to "
            f"{MOST_STEP:g} s apart, got {n}, {step:g} s apart"
        )
    return float(times[0]), step, n


def _fits(times: Float, step: float) -> bool:
    """Whether the times are a step apart, but for the rounding of what was written."""
    off = np.abs(times - (times[0] + step * np.arange(len(times)))).max()
    return bool(off <= ROUNDING + TOLERANCE * step)


def _accelerations(speed: Float, times: Float) -> Float:
    """Return forward differences; the last is that before it."""
    if len(speed) < 2:
        return np.zeros(len(speed))
    slopes = np.diff(speed) / np.diff(times)
    return np.append(slopes, slopes[-1])


def _jumps(h: Float) -> bool:
    return bool((np.abs(np.diff(h)) > np.pi).any())


def _boxes(
    found: Tracks,
    names: list[str],
    tracks: list[Track],
    given: Mapping[str, tuple[float, float, float]] | None,
) -> Float:
    """Return each entity's length, width and centre [m], ``(E, 3)``."""
    problems, rows, centred = [], [], True
    for name, track in zip(names, tracks, strict=True):
        if given is not None:
            if name not in given:
                problems.append(f"{found.place}: there is no box for '{name}'")
                continue
            rows.append(given[name])
            continue
        if not {"length", "width"} <= set(track.states):
            raise FileFormatError(
                f"{found.place}: does not say how large the entities are: it needs the columns "
                "length and width [m], or --boxes with an OpenSCENARIO file of the same entities"
            )
        for column in ("length", "width", "centre"):
            values = np.array(track.states.get(column, [0.0]))
            change = np.flatnonzero(values != values[0])
            if len(change):
                problems.append(
                    f"{found.place}, line {track.lines[change[0]]}: {column} [m] of '{name}' must "
                    f"stay the same, it was {values[0]:g} and is {values[change[0]]:g}"
                )
        centred = centred and "centre" in track.states
        rows.append(
            (track.states["length"][0], track.states["width"][0],
             track.states.get("centre", [0.0])[0])
        )  # fmt: skip
    if problems:
        raise FileFormatError(*problems)
    if not centred:
        found.notes.append("without the column centre, positions are taken as the boxes' centres")
    return np.array(rows)
