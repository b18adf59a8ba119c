"""Recorded events as files, each proven to replay what was recorded; and as moving pictures."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path

import numpy as np
from markupsafe import Markup

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.disk import write_whole
from bridgegen.base.errors import InputError
from bridgegen.engine.simulate import simulate_file
from bridgegen.openx.convert import import_file
from bridgegen.openx.opendrive import write as opendrive
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.openscenario import write as openscenario
from bridgegen.openx.openscenario.model import OpenScenario
from bridgegen.openx.openscenario.recorded import Recording
from bridgegen.recordings.conflicts.find import RecordedConflict
from bridgegen.recordings.excerpt import Clock
from bridgegen.recordings.readers.table import RecordedTraffic
from bridgegen.recordings.replays.scenario import along, driven, others_near, replay_of, with_map
from bridgegen.simulation.rollout import Rollout

BEFORE, AFTER = 5.0, 3.0
"""Time before and after an event that a replay covers [s], as far as the ego was recorded."""


@dataclass(frozen=True, eq=False)
class Prepared:
    """A recorded event that may be written.

    Attributes:
        recording: name of the recording.
        event: what happened.
        names: of the ego and the other, by the recording.
        when: the event's instant, from the begin of the scenario [s].
        scenario: all do what was recorded; its map is not named yet.
        roads: along the ego's path.
        start: where on its road the path begins [m].
        motion: what was recorded, from time 0; its entity 1 is the other.
        states: the same, as the scenario was made of.
    """

    recording: str
    event: RecordedConflict
    names: tuple[str, str]
    when: float
    scenario: OpenScenario
    roads: OpenDrive
    start: float
    motion: Rollout
    states: Recording


@dataclass(frozen=True, eq=False)
class Replay:
    """A recorded event as files.

    Attributes:
        event: that is written.
        scenario: the OpenSCENARIO file; the OpenDRIVE and ontology files have its name.
        off: the largest distance of any participant, when simulated, from where it was [m].
        too_fast: the largest difference of any speed [m/s].
        problem: why it cannot be simulated; "" if it can.
        lacks: what the ontology file lacks, and that OpenSCENARIO's has.
    """

    event: Prepared
    scenario: Path
    off: float
    too_fast: float
    problem: str
    lacks: tuple[str, ...]


def prepare(traffic: RecordedTraffic, clock: Clock, event: RecordedConflict) -> Prepared:
    """Return an event of a cleaned recording with the traffic around it."""
    step = traffic.facts.time_step
    begin = max(event.instant - round(BEFORE / step), int(clock.begin[event.ego]))
    end = min(event.instant + round(AFTER / step), int(clock.end[event.ego]))
    others = others_near(traffic, clock, event.ego, [event.other], begin, end)
    scenario, motion, states = replay_of(traffic, clock, event.ego, others, begin, end)
    roads, start = along(motion.x[0, 0], motion.y[0, 0], motion.h[0, 0])
    names = traffic.names[event.ego], traffic.names[event.other]
    return Prepared(
        traffic.facts.name,
        event,
        names,
        (event.instant - begin) * step,
        scenario,
        roads,
        start,
        motion,
        states,
    )


def write(prepared: Prepared, stem: Path, ego: str | None = None) -> Replay:
    """Write an event as ``.xosc``, ``.xodr`` and ``.owl``.

    The file that replays what was recorded is simulated first, also where a driver takes the ego's
    place in what is written.

    Args:
        prepared: the event.
        stem: path of the files without ending.
        ego: a driver that takes the ego's place.

    Raises:
        StorageError: a file cannot be written.
    """
    road, file, ontology = (stem.with_suffix(end) for end in (".xodr", ".xosc", ".owl"))
    scenario = with_map(prepared.scenario, road.name)
    write_whole(road, [opendrive.to_xml(prepared.roads)])
    write_whole(file, [openscenario.to_xml(scenario)])
    off, too_fast, problem = _compared(file, prepared.states)
    if ego is not None:
        scenario = driven(
            scenario, prepared.motion, ego, prepared.start, prepared.roads.roads[0].length
        )
        write_whole(file, [openscenario.to_xml(scenario)])
    ontology.unlink(missing_ok=True)
    try:
        _, lacks = import_file(file, ontology, partial=True)
    except InputError as error:
        lacks = list(error.problems)
    return Replay(prepared, file, off, too_fast, problem, tuple(lacks))


def _compared(file: Path, states: Recording) -> tuple[float, float, str]:
    """Return how far a file's motion is off [m], how much too fast [m/s], and any problem."""
    try:
        played = simulate_file(file, metrics=("d_min",))
    except InputError as error:
        return math.nan, math.nan, str(error)
    if played.rollout.status[0] != 0:
        return math.nan, math.nan, played.status
    order = [played.rollout.names.index(name) for name in states.names]
    n = min(played.rollout.shape[2], states.x.shape[1])
    is_there = np.ones((len(order), n), np.bool_)
    if states.present is not None:
        is_there = states.present[:, :n]
    x, y, v = (getattr(played.rollout, name)[0, order, :n] for name in ("x", "y", "v"))
    off = np.hypot(x - states.x[:, :n], y - states.y[:, :n])
    too_fast = np.abs(v - states.v[:, :n])
    return float(off[is_there].max()), float(too_fast[is_there].max()), ""


# --- A recorded event as a moving picture: SVG that needs no script ---


WIDTH, HEIGHT = 900, 320
EVERY = 0.2  # s, between two states of the picture
SPACE = 12.0  # m, around both paths
LEAST = 30.0  # m, that the picture shows
STANDS = 1.0  # m; over a shorter way the ego's heading says where it goes


def moving_picture(motion: Rollout, other: int, when: float, caption: str) -> Markup:
    """Return the picture of an event, seen from above, over and over.

    Args:
        motion: N = 1; the ego is entity 0.
        other: the entity that the conflict is with.
        when: of the conflict [s].
        caption: what the picture says to those who do not see it.
    """
    motion = _turned(motion)
    step = max(1, round(EVERY / motion.time_step))
    at = np.arange(0, motion.shape[2], step)
    seconds = float((at[-1] - at[0]) * motion.time_step)
    x, y, h = (getattr(motion, name)[0][:, at] for name in ("x", "y", "h"))
    there = motion.present[0][:, at] if motion.present.size else np.ones(x.shape, np.bool_)
    view = _view(motion, other)
    moment = int(np.clip(round(when / motion.time_step), 0, motion.shape[2] - 1))
    parts = [
        f'<svg viewBox="{" ".join(f"{value:.1f}" for value in view)}" width="{WIDTH}" '
        f'height="{HEIGHT}" role="img" aria-label="{escape(caption, quote=True)}">',
        '<g transform="scale(1,-1)">',
        *(_path(motion, e, view[2]) for e in (other, 0)),
    ]
    order = [*(e for e in range(1, len(motion.names)) if e != other), other, 0]
    for e in order:
        looks = "ego" if e == 0 else "partner" if e == other else "by"
        outline = _box(motion.box[e])
        if e in (0, other):
            place = motion.x[0, e, moment], motion.y[0, e, moment], motion.h[0, e, moment]
            parts.append(
                f'<path class="{looks} then" d="{outline}" transform="translate({place[0]:.2f} '
                f'{place[1]:.2f}) rotate({np.degrees(place[2]):.1f})"/>'
            )
        parts += _moving(looks, outline, motion.names[e], (x[e], y[e], h[e]), there[e], seconds)
    return Markup("".join((*parts, "</g></svg>")))


def _turned(motion: Rollout) -> Rollout:
    """Return the motion with the ego's way from left to right, from (0, 0) on."""
    x, y = motion.x[0, 0], motion.y[0, 0]
    dx, dy = float(x[-1] - x[0]), float(y[-1] - y[0])
    angle = math.atan2(dy, dx) if math.hypot(dx, dy) > STANDS else float(motion.h[0, 0, 0])
    cosine, sine = math.cos(angle), math.sin(angle)
    to_x, to_y = motion.x - x[0], motion.y - y[0]
    return replace(
        motion, x=to_x * cosine + to_y * sine, y=to_y * cosine - to_x * sine, h=motion.h - angle
    )


def _view(motion: Rollout, other: int) -> tuple[float, float, float, float]:
    """Return the part of the plane that is shown: left, top, width, height, y down."""
    x, y = motion.x[0][[0, other]], motion.y[0][[0, other]]
    if motion.present.size:
        there = motion.present[0][[0, other]]
        x, y = x[there], y[there]
    middle = 0.5 * (x.max() + x.min()), 0.5 * (y.max() + y.min())
    wide = max(float(np.ptp(x)) + 2.0 * SPACE, LEAST)
    high = max(float(np.ptp(y)) + 2.0 * SPACE, LEAST * HEIGHT / WIDTH)
    wide, high = max(wide, high * WIDTH / HEIGHT), max(high, wide * HEIGHT / WIDTH)
    return middle[0] - 0.5 * wide, -middle[1] - 0.5 * high, wide, high


def _path(motion: Rollout, e: int, wide: float) -> str:
    there = motion.present[0, e] if motion.present.size else np.ones(motion.shape[2], np.bool_)
    ahead = motion.box[e, 2]
    x = motion.x[0, e] + ahead * np.cos(motion.h[0, e])
    y = motion.y[0, e] + ahead * np.sin(motion.h[0, e])
    points = " ".join(f"{a:.2f},{b:.2f}" for a, b in zip(x[there], y[there], strict=True))
    looks = "ego" if e == 0 else "partner"
    return f'<polyline class="{looks}" points="{points}" style="stroke-width:{wide / 600.0:.3f}"/>'


def _box(box: Float) -> str:
    """Return the outline of a body around its reference point, its front a point."""
    length, width, ahead = box.tolist()
    rear, front, side = ahead - 0.5 * length, ahead + 0.5 * length, 0.5 * width
    nose = front - 0.25 * width
    return f"M{rear:.2f} {-side:.2f}H{nose:.2f}L{front:.2f} 0L{nose:.2f} {side:.2f}H{rear:.2f}Z"


def _moving(
    looks: str,
    outline: str,
    name: str,
    places: tuple[Float, Float, Float],
    there: Bool,
    seconds: float,
) -> Iterator[str]:
    timing = f'dur="{max(seconds, EVERY):.2f}s" repeatCount="indefinite"'
    x, y, h = places
    moves = ";".join(f"{a:.2f} {b:.2f}" for a, b in zip(x, y, strict=True))
    turns = ";".join(f"{value:.1f}" for value in np.degrees(np.unwrap(h)))
    yield f"<g><title>{escape(name)}</title>"
    if not there.all():
        shows = ";".join("visible" if item else "hidden" for item in there)
        yield f'<animate attributeName="visibility" calcMode="discrete" values="{shows}" {timing}/>'
    yield (
        f'<animateTransform attributeName="transform" type="translate" values="{moves}" {timing}/>'
        f'<g><animateTransform attributeName="transform" type="rotate" values="{turns}" {timing}/>'
        f'<path class="{looks}" d="{outline}"/></g></g>'
    )
