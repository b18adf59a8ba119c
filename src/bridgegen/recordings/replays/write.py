"""Recorded events as files, each proven to replay what was recorded."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

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
