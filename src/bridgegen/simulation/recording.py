"""Another tool's recording as a rollout, so that the same metrics apply."""

import csv
import io
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import FileFormatError, InputError, UnknownNameError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.read import read as read_scenario
from bridgegen.openx.openscenario.resolve import resolved
from bridgegen.openx.xml import read_bytes
from bridgegen.simulation.rollout import Rollout
from bridgegen.simulation.trace import COLUMNS, MORE

# --- The states in another tool's recording: a table, or the log of esmini, line by line ---
# A table has a header that names its columns: those of a trace (`trace.COLUMNS`), in any order, and
# any of `trace.MORE`. A line is the state of one entity at one instant.


STATES = ("time", "x", "y", "h", "speed")
MAX_PROBLEMS = 20
MOST = 1e9
"""Largest coordinate or other number [m]: larger than any place on Earth, and than what may be
squared without thinking."""


@dataclass
class Track:
    """What a recording says of one entity, line by line; ``lines`` are their numbers in the file.

    Attributes:
        states: per column of a trace, but for the entity's name, a value for each line.
        lines: the number of each line.
    """

    states: dict[str, list[float]] = field(default_factory=dict)
    lines: list[int] = field(default_factory=list)

    def add(self, line: int, values: dict[str, float]) -> None:
        """Take in a line, all with the same columns."""
        self.lines.append(line)
        for name, value in values.items():
            self.states.setdefault(name, []).append(value)


@dataclass
class Tracks:
    """A file's tracks by entity, in the order of their first lines, and what to say about them."""

    place: str
    tracks: dict[str, Track] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)

    def say(self, line: int, problem: str) -> None:
        """Note a problem; too many end the reading.

        Raises:
            FileFormatError: there are too many.
        """
        self.problems.append(f"{self.place}, line {line}: {problem}")
        if len(self.problems) == MAX_PROBLEMS:
            raise FileFormatError(*self.problems, f"{self.place}: and perhaps more")

    def number(self, line: int, column: str, text: str) -> float:
        """Return a field's number; 0 and a problem if it is none."""
        try:
            value = float(text)
        except ValueError:
            value = float("nan")
        # Python reads "1_000" as a number; a table that says so is damaged.
        if not isfinite(value) or "_" in text or abs(value) > MOST:
            shown = text if len(text) <= 40 else f"{text[:40]}…"
            self.say(line, f"{column} must be a number within ±{MOST:g}, got '{shown}'")
            return 0.0
        if column == "speed" and value < 0.0:
            self.say(line, f"speed [m/s] must be ≥ 0, got {text} (going backwards is not known)")
        if column in ("length", "width") and value <= 0.0:
            self.say(line, f"{column} [m] must be > 0, got {text}")
        return value


def read_tracks(path: Path) -> Tracks:
    """Read a recording.

    Raises:
        FileFormatError: missing, too large, not text, without the columns that it needs, or with
            values that are no finite numbers; line by line.
    """
    place = str(path)
    try:
        text = read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise FileFormatError(f"{place}: must be UTF-8 text, byte {error.start} is not") from None
    found = Tracks(place)
    if text.startswith("esmini"):
        _read_log(text, found)
    else:
        _read_table(text, found)
    if found.problems:
        raise FileFormatError(*found.problems)
    if not found.tracks:
        raise FileFormatError(f"{place}: holds no line of states")
    return found


def _read_table(text: str, found: Tracks) -> None:
    lines = _csv_lines(text, found)
    _, head = next(lines, (1, []))
    head = [name.strip() for name in head]
    missing = [name for name in COLUMNS if name not in head]
    if missing:
        raise FileFormatError(
            f"{found.place}, line 1: a recording needs the columns {', '.join(COLUMNS)} "
            f"(comma-separated), or to be esmini's --csv_logger's; missing: {', '.join(missing)}"
        )
    wanted = [name for name in (*STATES, *MORE) if name in head]
    twice = sorted({name for name in (*wanted, "entity") if head.count(name) > 1})
    if twice:
        raise FileFormatError(f"{found.place}, line 1: columns twice: {', '.join(twice)}")
    unused = [name for name in head if name not in (*wanted, "entity")]
    if unused:
        found.notes.append(f"columns that are not used: {', '.join(unused)}")
    at = {name: head.index(name) for name in wanted}
    entity = head.index("entity")
    for line, row in lines:
        if len(row) != len(head):
            found.say(line, f"has {len(row)} fields, the header has {len(head)}")
            continue
        name = row[entity].strip()
        if not name:
            found.say(line, "entity must be a name, got nothing")
            continue
        values = {column: found.number(line, column, row[i]) for column, i in at.items()}
        found.tracks.setdefault(name, Track()).add(line, values)


def _csv_lines(text: str, found: Tracks) -> Iterator[tuple[int, list[str]]]:
    """Yield the lines that are not empty, with their numbers."""
    reader = csv.reader(io.StringIO(text), strict=True)
    try:
        for row in reader:
            if row:
                yield reader.line_num, row
    except csv.Error as error:
        raise FileFormatError(f"{found.place}, line {reader.line_num}: {error}") from None


LOG_HEAD = "Index [-], TimeStamp [s], #1 Entity_Name [-]"
LOG_FIELDS = {
    "speed": 2,
    "centre": 5,
    "length": 8,
    "width": 9,
    "x": 11,
    "y": 12,
    "h": 24,
}
"""Index of each quantity among the fields of one entity; esmini's reference point is
OpenSCENARIO's."""
LOG_WIDTH = 31
"""Number of fields of one entity."""


def _read_log(text: str, found: Tracks) -> None:
    """Read the log that esmini writes with --csv_logger: a line an instant, entities side by side.

    Source: esmini 3.6, class CSV_Logger.
    """
    lines = enumerate(text.splitlines(), 1)
    if not any(line.startswith(LOG_HEAD) for _, line in lines):
        raise FileFormatError(f"{found.place}: is esmini's, but not what --csv_logger writes")
    for number, line in lines:
        fields = [text.strip() for text in line.split(",")]
        if fields and not fields[-1]:
            fields.pop()  # every line ends with a comma
        if not fields:
            continue
        if len(fields) < 2 + LOG_WIDTH or (len(fields) - 2) % LOG_WIDTH:
            found.say(number, f"must have 2 fields and {LOG_WIDTH} an entity, got {len(fields)}")
            continue
        time = found.number(number, "time", fields[1])
        for first in range(2, len(fields), LOG_WIDTH):
            values = {"time": time}
            for column, i in LOG_FIELDS.items():
                values[column] = found.number(number, column, fields[first + i])
            found.tracks.setdefault(fields[first], Track()).add(number, values)


MAX_INSTANTS = 100_000
MAX_STATES = 2_000_000
"""Largest number of states of a recording: entities times instants."""
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
    for obj in scenario.entities.scenario_objects:
        body = obj.entity_object
        if isinstance(body, osc.Vehicle | osc.Pedestrian | osc.MiscObject):
            size, centre = body.bounding_box.dimensions, body.bounding_box.center
            boxes[str(obj.name)] = (_plain(size.length), _plain(size.width), _plain(centre.x))
    return boxes


def kinds_of(path: Path) -> dict[str, int]:
    """Return what a scenario file's entities are, as `bridgegen.drivers.kinds` numbers it.

    Raises:
        FileFormatError: not a valid OpenSCENARIO file.
    """
    from bridgegen.simulation.embedded.compiler.layouts import kind

    scenario = resolved(read_scenario(path), str(path))
    return {
        str(obj.name): kind(obj.entity_object)
        for obj in scenario.entities.scenario_objects
        if isinstance(obj.entity_object, osc.Vehicle | osc.Pedestrian | osc.MiscObject)
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
            # Forward differences, as ours are: from this instant on.
            states["acceleration"] = _accelerations(states["speed"], states["time"])
        at = (states["time"] - start) / step
        # Unequal steps are refused by default: linear interpolation flattens what brakes and turns.
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
            x=arrays["x"],
            y=arrays["y"],
            h=arrays["h"],
            v=arrays["speed"],
            a=arrays["acceleration"],
            offset=arrays["offset"],
            n_steps=np.array([n], dtype=np.int64),
            status=np.zeros(1, dtype=np.int8),
            present=np.zeros((0, 0, 0), np.bool_) if present.all() else present,
        ),
        has_offset="offset" in ordered[0].states,
        notes=tuple(found.notes),
    )


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
        step = next(
            (value for value in (float(steps[0]), float(mean)) if _fits(times, value)), None
        )
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
            (
                track.states["length"][0],
                track.states["width"][0],
                track.states.get("centre", [0.0])[0],
            )
        )
    if problems:
        raise FileFormatError(*problems)
    if not centred:
        found.notes.append("without the column centre, positions are taken as the boxes' centres")
    return np.array(rows)
