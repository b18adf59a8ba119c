"""One simulated scenario as a recording that the viewer Rerun shows: a ``.rrd`` file.

Positions are single precision, as Rerun keeps them. Needs the extra ``rerun``.
"""

from collections.abc import Iterator
from functools import partial
from math import isfinite
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bridgegen.assess.conflict.summary import summarise
from bridgegen.assess.criteria import margin_in_words
from bridgegen.assess.criteria.signals import read
from bridgegen.base.arrays import Float
from bridgegen.base.disk import write_whole
from bridgegen.drivers import kinds
from bridgegen.drivers.osi import REACH
from bridgegen.engine.simulate import FileResult
from bridgegen.openx.opendrive.mirror import as_written
from bridgegen.openx.opendrive.outline import LINES, lights, outline
from bridgegen.simulation.osi.trace import height_of
from bridgegen.simulation.rollout import Rollout

TIME, TO_CONFLICT = "time", "to the conflict"
"""Timelines: since the scenario's start, and until the conflict."""
BEFORE = 2.0
"""When the viewer opens, before the conflict [s]."""

_EGO, _OTHER, _DETECTED = (31, 119, 180), (214, 96, 44), (44, 160, 44)
_LINE_COLOURS = {"stop": (255, 255, 255), "stripe": (200, 200, 200), "edge": (150, 150, 150)}
_LIGHTS = ("off", "red", "red and yellow", "yellow", "green")
_LIGHT_COLOURS = ((90, 90, 90), (220, 40, 40), (240, 130, 30), (240, 200, 40), (50, 180, 80))
_LAMP = 3.3  # m, the height of a light's middle lamp
_SIGNALS = {"distance": ("gap", "m"), "time to collision": ("ttc", "s")}


def write_rerun(path: Path, result: FileResult, name: str) -> None:
    """Write a simulated scenario as a ``.rrd`` file, whole or not at all.

    Rerun numbers its chunks at random: the same scenario gives the same data, not the same bytes.

    Args:
        path: the file.
        result: of the scenario.
        name: of the scenario.

    Raises:
        StorageError: it cannot be written.
    """
    import rerun as rr

    rollout, around = result.rollout.as_driven(), result.around()
    n = int(rollout.n_steps[0])
    conflict = summarise(result.conflicts)
    at = conflict.time if conflict is not None and isfinite(conflict.time) else result.seconds
    to = rr.RecordingStream("bridgegen", recording_id=name, send_properties=False)
    memory = to.memory_recording()
    clock = _Clock(to, at)
    to.set_log_time_enabled(False)
    to.set_log_tick_enabled(False)
    to.send_blueprint(_blueprint(rollout, at))
    if around.roads is not None:
        model = as_written(around.roads)
        _write_map(to, outline(model), rollout, n)
        for light in lights(model):
            if light.id in rollout.light_names:
                states = rollout.lights[0, rollout.light_names.index(light.id), :n]
                _write_light(clock, f"lights/{light.id}", light.x, light.y, states, rollout)
    for e in range(len(rollout.names)):
        _write_participant(clock, rollout, e, n)
    if rollout.detections.size:
        _write_detections(clock, rollout, n)
    _write_series(clock, rollout, n)
    clock.set(at)
    for text, level in _verdict(result, conflict.sentence if conflict else "No conflict."):
        to.log("verdict", rr.TextLog(text, level=level))
    to.flush()
    write_whole(path, [memory.drain_as_bytes()])


class _Clock(NamedTuple):
    """The times of what is written.

    Rerun opens a recording where its timeline begins, so that the second one begins shortly before
    the conflict: what is earlier is there at its beginning.

    Attributes:
        to: the recording.
        at: the time of the conflict [s].
    """

    to: Any
    at: float

    def set(self, time: float) -> None:
        """Let what is logged next be at a time [s]."""
        self.to.set_time(TIME, duration=time)
        self.to.set_time(TO_CONFLICT, duration=max(time - self.at, -BEFORE))

    def send(self, path: str, times: Any, columns: Any, *, line: bool = False) -> None:
        """Write columns, a row at each time [s]; of a line nothing that is earlier."""
        import rerun as rr

        late = np.maximum(times - self.at, -BEFORE)
        columns_of = [rr.TimeColumn(TIME, duration=times)]
        if not line:
            columns_of.append(rr.TimeColumn(TO_CONFLICT, duration=late))
        self.to.send_columns(path, columns_of, columns(slice(None)))
        if line and (there := late > -BEFORE).any():
            shown = [rr.TimeColumn(TO_CONFLICT, duration=late[there])]
            self.to.send_columns(path, shown, columns(there))


def _verdict(result: FileResult, sentence: str) -> Iterator[tuple[str, str]]:
    """Yield the lines of the verdict, each with its level."""
    import rerun as rr

    yield sentence, rr.TextLogLevel.INFO if sentence == "No conflict." else rr.TextLogLevel.WARN
    if result.cause:
        yield f"root cause: {result.cause}", rr.TextLogLevel.INFO
    if result.unjudged:
        yield f"not judged: {result.unjudged}", rr.TextLogLevel.WARN
    for each in result.criteria:
        level = rr.TextLogLevel.ERROR if each.verdict == "violated" else rr.TextLogLevel.INFO
        margin = margin_in_words(each.margin, each.unit)
        yield f"{each.criterion.id}: {each.verdict}, margin {margin}", level


def _blueprint(rollout: Rollout, at: float) -> Any:
    """Return what the viewer opens with: the conflict from above, and what leads to it."""
    from rerun import blueprint as rrb

    k = min(round(at / rollout.time_step), int(rollout.n_steps[0]) - 1)
    x, y = float(rollout.x[0, 0, k]), float(rollout.y[0, 0, k])
    # Not straight down: there, no direction is up.
    eye = rrb.EyeControls3D(position=(x, y - 25.0, 45.0), look_target=(x, y, 0.0))
    plots = [
        rrb.TimeSeriesView(origin=f"metrics/{of}", name=f"{of} [{unit}]")
        for of, unit in {of: unit for of, (_, unit) in _SIGNALS.items()}.items()
    ]
    plots += [
        rrb.TimeSeriesView(origin="metrics/speed", name="speed [m/s]"),
        rrb.TimeSeriesView(origin="metrics/acceleration", name="acceleration of the ego [m/s²]"),
    ]
    state = [rrb.StateTimelineView(origin="lights", name="lights")] if rollout.light_names else []
    world = rrb.Spatial3DView(
        origin="/", contents=["+ /**", "- /metrics/**"], name="scenario", eye_controls=eye
    )
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(world, rrb.TextLogView(origin="verdict"), row_shares=[4, 1]),
            rrb.Vertical(*plots, *state),
            column_shares=[3, 2],
        ),
        rrb.TimePanel(timeline=TO_CONFLICT, play_state="playing", state="collapsed"),
        collapse_panels=True,
    )


def _write_map(to: Any, shapes: list[tuple[str, Float]], rollout: Rollout, n: int) -> None:
    """Write the lines and crosswalks near the participants, an entity for each kind."""
    import rerun as rr

    there = rollout.present[0, :, :n] if rollout.present.size else np.s_[:]
    places = np.array([rollout.x[0, :, :n][there].ravel(), rollout.y[0, :, :n][there].ravel()])
    low, high = places.min(1) - REACH, places.max(1) + REACH
    found: dict[str, list[Float]] = {}
    for kind, points in shapes:
        if (points.max(0) < low).any() or (points.min(0) > high).any():
            continue
        if kind == "stripe":
            found.setdefault(kind, []).append(points[[*range(len(points)), 0]])
        elif kind in LINES:
            found.setdefault(kind, []).append(points)
    for kind, lines in found.items():
        colour = _LINE_COLOURS.get(kind, (230, 230, 230))
        to.log(
            f"map/{kind}",
            rr.LineStrips3D([_flat(line) for line in lines], colors=colour, radii=0.06),
            static=True,
        )


def _flat(points: Float, z: float = 0.0) -> Float:
    return np.column_stack([points, np.full(len(points), z)])


def _write_light(
    clock: _Clock, path: str, x: float, y: float, states: Any, rollout: Rollout
) -> None:
    import rerun as rr

    clock.to.log(path, rr.StateConfiguration(values=_LIGHTS, colors=_LIGHT_COLOURS), static=True)
    for k in (0, *(np.flatnonzero(np.diff(states)) + 1).tolist()):
        clock.set(k * rollout.time_step)
        clock.to.log(path, rr.StateChange(state=_LIGHTS[states[k]]))
        clock.to.log(
            path, rr.Points3D([(x, y, _LAMP)], colors=_LIGHT_COLOURS[states[k]], radii=0.3)
        )


def _half(h: Float) -> Float:
    """Return quaternions (x, y, z, w), ``(…, 4)``, of turns about the z axis [rad]."""
    nil = np.zeros_like(h)
    return np.stack([nil, nil, np.sin(0.5 * h), np.cos(0.5 * h)], axis=-1)


def _path(*parts: str) -> str:
    import rerun as rr

    return str(rr.new_entity_path([*parts]))


def _write_participant(clock: _Clock, rollout: Rollout, e: int, n: int) -> None:
    """Write a body's motion, and the body where it is there; its origin is the reference point."""
    import rerun as rr

    path, name = _path("participants", rollout.names[e]), rollout.names[e]
    x, y, h = (getattr(rollout, of)[0, e, :n] for of in ("x", "y", "h"))
    places, turns = np.column_stack([x, y, np.zeros(n)]), _half(h)
    clock.send(
        path,
        rollout.time_step * np.arange(n),
        lambda of: rr.Transform3D.columns(translation=places[of], quaternion=turns[of]),
    )
    (length, width, ahead), height = rollout.box[e].tolist(), height_of(rollout, e)
    body = rr.Boxes3D(
        half_sizes=[(0.5 * length, 0.5 * width, 0.5 * height)],
        centers=[(ahead, 0.0, 0.5 * height)],
        colors=_OTHER if e else _EGO,
        labels=name,
        show_labels=True,
    )
    there = rollout.present[0, e, :n] if rollout.present.size else np.ones(n, np.bool_)
    for k in (0, *(np.flatnonzero(np.diff(there)) + 1).tolist()):
        clock.set(k * rollout.time_step)
        clock.to.log(path, body if there[k] else rr.Clear(recursive=False))


def _write_detections(clock: _Clock, rollout: Rollout, n: int) -> None:
    """Write what the ego's sensors detected in each frame, ghosts included."""
    import rerun as rr

    for k in range(n):
        rows = rollout.detections[0, 1:, k]
        if rollout.ghosts.size:
            rows = np.concatenate([rows, rollout.ghosts[0, :, k]])
        if (rows[:, kinds.SEEN_BY] == kinds.NO_FRAME).all():
            continue
        rows = rows[rows[:, kinds.SEEN_BY] >= kinds.CAMERA]
        clock.set(k * rollout.time_step)
        clock.to.log(
            "detections",
            rr.Boxes3D(
                centers=_flat(rows[:, [kinds.X, kinds.Y]], 0.75),
                half_sizes=_flat(0.5 * rows[:, [kinds.LENGTH, kinds.WIDTH]], 0.75),
                quaternions=_half(rows[:, kinds.HEADING]),
                colors=_DETECTED,
                labels=[
                    f"{kinds.NAMES[int(row[kinds.KIND])]} {row[kinds.CONFIDENCE]:.0%}"
                    for row in rows
                ],
                show_labels=False,
            ),
        )


def _write_series(clock: _Clock, rollout: Rollout, n: int) -> None:
    """Write metrics over time; where one is infinite, its line has a gap."""
    import rerun as rr

    times = rollout.time_step * np.arange(n)
    series = {("acceleration", rollout.names[0]): rollout.a[0, 0, :n]}
    for e, name in enumerate(rollout.names):
        series["speed", name] = rollout.v[0, e, :n]
        if e and not rollout.is_ego_s(e):
            for of, (signal, _) in _SIGNALS.items():
                series[of, name] = read(rollout, signal, (rollout.names[0], name))[0, :n]
    for (of, name), values in series.items():
        known = np.isfinite(values)
        if rollout.present.size and of != "acceleration":
            known &= rollout.present[0, rollout.names.index(name), :n]
        path = _path("metrics", of, name)
        clock.to.log(path, rr.SeriesLines(names=name), static=True)
        clock.send(path, times[known], partial(_scalars, values[known]), line=True)


def _scalars(values: Float, of: Any) -> Any:
    import rerun as rr

    return rr.Scalars.columns(scalars=values[of])
