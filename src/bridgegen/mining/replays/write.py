"""The most critical events of a recording as files, each proven to replay what was recorded."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bridgegen.disk import write_whole
from bridgegen.errors import InputError
from bridgegen.mining.conflicts.find import RecordedConflict
from bridgegen.mining.excerpt import Clock, clock_of
from bridgegen.mining.replays.road import along
from bridgegen.mining.replays.scenario import driven, others_near, replay_of, with_map
from bridgegen.openx.opendrive import write as opendrive
from bridgegen.openx.openscenario import write as openscenario
from bridgegen.openx.openscenario.recorded import Recording
from bridgegen.recordings.table import RecordedTraffic
from bridgegen.simulate import simulate_file
from bridgegen.simulation.rollout import Rollout

BEFORE, AFTER = 5.0, 3.0
"""Of an event [s], as far as the ego was recorded."""


@dataclass(frozen=True)
class Replay:
    """A recorded event as files.

    Attributes:
        event: what happened.
        begin: first instant, by the recording's clock.
        end: last one.
        scenario: the OpenSCENARIO file.
        road: the OpenDRIVE file beside it.
        motion: what was recorded, from time 0.
        off: the largest distance of any participant, when simulated, from where it was [m].
        too_fast: the largest difference of any speed [m/s].
        problem: why it is not simulated; "" if it is.
    """

    event: RecordedConflict
    begin: int
    end: int
    scenario: Path
    road: Path
    motion: Rollout
    off: float
    too_fast: float
    problem: str = ""


def write_replays(
    traffic: RecordedTraffic,
    events: Sequence[RecordedConflict],
    folder: Path,
    *,
    first: int = 1,
    ego: str | None = None,
) -> Iterator[Replay]:
    """Write events of a cleaned recording; yield each as it is written.

    Args:
        traffic: cleaned.
        events: in this order.
        folder: for the files, ``0001.xosc``, ``0001.xodr`` and so on.
        first: number of the first.
        ego: a driver that takes the ego's place in the files; the recorded motion is proven first.

    Raises:
        StorageError: a file cannot be written.
    """
    clock = clock_of(traffic)
    for number, event in enumerate(events, first):
        yield _write(traffic, clock, event, folder / f"{number:04}", ego)


def _write(
    traffic: RecordedTraffic, clock: Clock, event: RecordedConflict, stem: Path, ego: str | None
) -> Replay:
    step = traffic.facts.time_step
    begin = max(event.instant - round(BEFORE / step), int(clock.begin[event.ego]))
    end = min(event.instant + round(AFTER / step), int(clock.end[event.ego]))
    others = others_near(traffic, clock, event.ego, [event.other], begin, end)
    scenario, motion, recording = replay_of(traffic, clock, event.ego, others, begin, end)
    roads, start = along(motion.x[0, 0], motion.y[0, 0], motion.h[0, 0])
    road, file = stem.with_suffix(".xodr"), stem.with_suffix(".xosc")
    scenario = with_map(scenario, road.name)
    write_whole(road, [opendrive.to_xml(roads)])
    write_whole(file, [openscenario.to_xml(scenario)])
    off, too_fast, problem = _compared(file, recording)
    if ego is not None:
        scenario = driven(scenario, motion, ego, start, roads.roads[0].length)
        write_whole(file, [openscenario.to_xml(scenario)])
    return Replay(event, begin, end, file, road, motion, off, too_fast, problem)


def _compared(file: Path, recording: Recording) -> tuple[float, float, str]:
    """Return how far a file's motion is off [m], how much too fast [m/s], and any problem."""
    try:
        played = simulate_file(file, metrics=("d_min",))
    except InputError as error:
        return math.nan, math.nan, str(error)
    if played.rollout.status[0] != 0:
        return math.nan, math.nan, played.status
    order = [played.rollout.names.index(name) for name in recording.names]
    n = min(played.rollout.shape[2], recording.x.shape[1])
    is_there = np.ones((len(order), n), np.bool_)
    if recording.present is not None:
        is_there = recording.present[:, :n]
    x, y, v = (getattr(played.rollout, name)[0, order, :n] for name in ("x", "y", "v"))
    off = np.hypot(x - recording.x[:, :n], y - recording.y[:, :n])
    too_fast = np.abs(v - recording.v[:, :n])
    return float(off[is_there].max()), float(too_fast[is_there].max()), ""
