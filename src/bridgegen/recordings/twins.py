"""Recorded events beside their parameterised twins: which verdicts do the parameters change?

On the scenario's straight road a driver meets the others twice: as the parameters say, and as they
were recorded. All else is the same: bodies, road, weather, the ego's start and driver. The others
follow a course in both, and do not react to the ego.

Source: E. de Gelder and O. Op den Camp, How (not) to parameterize scenarios?, arXiv:2409.01117
(recall, precision, F1 of verdicts; its abstract was read). What is put back, and how, is ours.
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bridgegen.assess.conflict.analysis import CONTACT, analyse
from bridgegen.assess.conflict.harm import COURSE, NEAR_MISS, decisive
from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError, ScenarioError, UnknownNameError
from bridgegen.drivers import DRIVERS
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.runner import Runner
from bridgegen.openx.source import OntologySource
from bridgegen.recordings import TIME_STEP
from bridgegen.recordings.events.event import ABSENT, Events
from bridgegen.recordings.events.find import find_events
from bridgegen.recordings.events.scene import Scene
from bridgegen.recordings.lanes.find import locate, read_map
from bridgegen.recordings.lanes.model import NONE
from bridgegen.recordings.readers.clean import clean
from bridgegen.recordings.readers.formats import files_of, read
from bridgegen.recordings.readers.states import centre_ahead
from bridgegen.scenario.exposure.fit import Progress
from bridgegen.scenario.language.adversary import with_others
from bridgegen.scenario.language.event_kinds import EVENT_KINDS
from bridgegen.scenario.language.parameterisation import (
    ELEMENTS,
    VERDICTS,
    Agreement,
    Parameterisation,
)
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.ontology.builder import rounded
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator
from bridgegen.simulation.rollout import Rollout

KINDS = ("cut-in", "cut-out", "lead-brakes", "approach")
"""Kinds of events in which the others are on the ego's lane, or come to it."""
BEFORE, AFTER = 1.0, 3.0
"""Time before an event over which initial speed and acceleration are measured, and time after it
from which on the others keep speed and place in the lane [s]."""
MOST = 200
"""Largest number of events that are simulated; of more, evenly spread ones."""
OFF = "not on the ego's carriageway throughout"
OUTSIDE = "outside the scenario's ranges or constraints"
NO_RESULT = "without a result, or the event does not begin in the simulation"


@dataclass(frozen=True, eq=False)
class Track:
    """What one participant did in an event, on lanes.

    Attributes:
        states: ``(5, T)``: time from the event's begin [s], ascending; way along the lane [m]; rear
            axle left of the middle of the ego's lane, in widths of that lane [1]; heading less the
            lane's [rad]; speed along the lane [m/s].
        speed: at the begin, by what was before it [m/s].
        acceleration: likewise [m/s²].
        duration: of the event [s].
    """

    states: Float
    speed: float
    acceleration: float
    duration: float


Met = tuple[Mapping[str, float], list[Track]]
"""An event that is a scenario: its searched parameters, and a track for each other."""


def twins_of(
    scenario: LogicalScenario,
    recordings: Sequence[Path],
    drivers: Sequence[str],
    road_map: Path | None = None,
    progress: Progress | None = None,
) -> Parameterisation:
    """Replay the events of recordings that are a scenario, and their parameterised twins.

    Args:
        scenario: it.
        recordings: files, or folders of files.
        drivers: names of drivers that ship.
        road_map: of the place; by default the recordings' own lanes.
        progress: is told how many of how many batches are simulated.

    Raises:
        FileFormatError: a file cannot be read, or there is none.
        InputError: a scenario of other events, or of others than the events name.
        UnknownNameError: no such driver.
    """
    if unknown := [name for name in drivers if name not in DRIVERS]:
        raise UnknownNameError("driver that ships", unknown[0], tuple(DRIVERS))
    story, spec = scenario.story, scenario.recorded
    plain = scenario.roads.template == "road" and not (story.jams or story.works)
    roles = EVENT_KINDS[spec.event].roles if spec and spec.event in KINDS else ()
    if spec is None or len(_others(scenario)) > len(roles) or not plain or scenario.effects:
        raise InputError(
            f"{scenario.name}: replays beside parameterised twins need the key 'recorded' with an "
            f"event of {', '.join(KINDS)}, no participants that it has not, and a road without "
            "junctions, jams, works and effects"
        )
    on_map = read_map(road_map) if road_map is not None else None
    found, left_out, names = list[Met](), Counter[str](), list[str]()
    for file in [file for path in recordings for file in (files_of(path)[0] or [path])]:
        for recording in read(file):
            traffic = clean(recording, TIME_STEP).traffic
            located = locate(traffic, on_map)
            kinds = find_events(traffic, located).kinds
            events = next(kind for kind in kinds if kind.kind.name == spec.event)
            found += met_of(scenario, Scene(traffic, located), events, left_out)
            names.append(traffic.facts.name.strip()[:80] or "unnamed")
    shown = ", ".join(names[:5]) + ", …" * (len(names) > 5) or "no recording"
    return compare(scenario, found, drivers, shown, left_out, progress)


def met_of(
    scenario: LogicalScenario, scene: Scene, events: Events, left_out: Counter[str]
) -> list[Met]:
    """Return the events of a recording that are a scenario; count the others by reason."""
    spec, space, found = scenario.recorded, scenario.space(), list[Met]()
    assert spec is not None
    rows = {n: v for n, v in spec.values(events.quantities).items() if n in space.variables}
    whole = np.isfinite([*rows.values()]).all(axis=0) & spec.counts(events.quantities)
    roles = [*events.others.values()][: len(_others(scenario))]
    for i in np.flatnonzero(whole).tolist():
        values = {name: float(column[i]) for name, column in rows.items()}
        try:
            space.row(values)
        except ScenarioError:
            left_out[OUTSIDE] += 1
            continue
        tracks = [_track(scene, events, i, int(who[i])) for who in roles]
        kept = [track for track in tracks if track is not None]
        if len(kept) < len(_others(scenario)):
            left_out[OFF] += 1
        else:
            found.append((values, kept))
    return found


def _others(scenario: LogicalScenario) -> list[str]:
    return [one.name for one in scenario.participants[1:]]


def _track(scene: Scene, events: Events, i: int, who: int) -> Track | None:
    """Return what a participant did in event i; None if that is not known."""
    traffic, placed, lanes, step = scene.traffic, scene.placed, scene.lanes, scene.step
    begin, ego = float(events.begin[i]) / step, events.ego[i : i + 1]
    duration = float(events.end[i] - events.begin[i])
    own = int(placed.lane[scene.state(ego, np.array([begin]))[0]])
    if who == ABSENT or own == NONE:
        return None
    first = int(scene.clock.begin[who])
    low = max(int(np.ceil(begin - BEFORE / step)), first)
    high = min(int(np.ceil(begin + (duration + AFTER) / step)), int(scene.clock.end[who]))
    time = (np.arange(low, high + 1) - begin) * step
    at = np.arange(low, high + 1) - first + int(traffic.first[who])
    lane = placed.lane[at].astype(np.int64)
    off = (lane == NONE) | (lanes.carriageway[lane] != lanes.carriageway[own])
    # What follows the event may lead elsewhere, into an exit say: the track ends there.
    count = int(np.argmax(off)) if off.any() else len(at)
    time, at, lane = time[:count], at[:count], lane[:count]
    same = np.flatnonzero(lanes.number[lane] == lanes.number[own])
    if not len(same) or time[0] > 0.0 or time[-1] < duration - step:
        return None
    offset, across, heading, v = (
        np.asarray(column[at], np.float64)
        for column in (placed.offset, placed.across, placed.heading, placed.along)
    )
    # Where it crosses a line, its offset counts from another lane's middle from then on.
    apart = np.where(np.diff(lane), offset[:-1] + across[:-1] * step - offset[1:], 0.0)
    shift = np.concatenate([[0.0], np.cumsum(apart)])
    ahead = centre_ahead(int(traffic.kind[who]), float(traffic.length[who]))
    aside = offset + shift - shift[same[0]] - ahead * np.sin(heading)
    width = float(scene.lane_width(ego, np.array([begin]))[0])
    before, line = time <= 0.0, (0.0, float(np.interp(0.0, time, v)))
    if before.sum() * step >= 0.5 * BEFORE:
        line = tuple(np.polyfit(time[before], v[before], 1).tolist())
    states = np.array([time, placed.station[at], aside / width, heading, v])
    return Track(states, line[1], line[0], duration)


def compare(
    scenario: LogicalScenario,
    events: Sequence[Met],
    drivers: Sequence[str],
    source: str,
    left_out: Counter[str],
    progress: Progress | None = None,
) -> Parameterisation:
    """Return how verdicts of replays and of their twins agree; see `twins_of`."""
    if (count := len(events)) > MOST:
        events = [events[i * count // MOST] for i in range(MOST)]
        left_out[f"beyond {MOST}, which are spread over all"] += count - MOST
    good = np.ones(len(events), np.bool_)
    ways = [(), ELEMENTS, *((element,) for element in ELEMENTS)]
    found: dict[str, list[Mapping[str, Bool]]] = {driver: [] for driver in drivers}
    for number, driver in enumerate(drivers if events else ()):
        player = _Player(scenario, driver, events)
        good &= np.isfinite(player.begin)
        for part, elements in enumerate(ways):
            if progress is not None:
                progress(number * len(ways) + part, len(drivers) * len(ways))
            rollout = player.run(elements)
            good &= rollout.status == 0
            conflicts = analyse(rollout)
            contact = (conflicts.kind == CONTACT).any(axis=1)
            (_, own), (_, harm) = decisive(conflicts), decisive(conflicts, "any")
            verdicts = (contact, own >= NEAR_MISS, harm >= COURSE)
            found[driver].append(dict(zip(VERDICTS, verdicts, strict=True)))
    left_out.update([NO_RESULT] * int((~good).sum()))
    agreement: dict[str, dict[str, Agreement]] = {verdict: {} for verdict in VERDICTS}
    back = {verdict: dict.fromkeys(ELEMENTS, 0) for verdict in VERDICTS}
    for (driver, runs), verdict in ((of, v) for of in found.items() for v in VERDICTS if of[1]):
        twin, replay, *others = (run[verdict][good] for run in runs)
        pairs = (replay & twin, replay & ~twin, ~replay & twin, ~replay & ~twin)
        counts = zip(Agreement.model_fields, (int(pair.sum()) for pair in pairs), strict=True)
        agreement[verdict][driver] = Agreement(**dict(counts))
        for element, other in zip(ELEMENTS, others, strict=True):
            back[verdict][element] += int((other != replay).sum())
    return Parameterisation(
        source=source,
        events=int(good.sum()),
        left_out=dict(left_out),
        agreement=agreement,
        given_back=back,
    )


class _Player:
    """Simulates events with one driver, each with some elements as they were recorded.

    Attributes:
        begin: ``(N,)`` when the event begins by the parameters [s]; NaN if it never does.
    """

    def __init__(self, scenario: LogicalScenario, driver: str, events: Sequence[Met]) -> None:
        scenario = with_others(scenario, "scripted")
        space = scenario.space()
        runner = Runner(scenario, space, PipelineOptions(ego=driver))
        X = np.array([space.row(values) for values, _ in events])
        rollout = runner.run(X)
        self._names, self._events, self._step = _others(scenario), events, rollout.time_step
        knob = scenario.roads.knobs["lane_width"]
        self._width = float(scenario.usual_values()[knob] if isinstance(knob, str) else knob)
        self._frame = rollout.x[:, 0, 0], rollout.y[:, 0, 0], rollout.h[:, 0, 0]
        if np.ptp(rollout.h[:, :, 0], axis=1).max() > 1e-6:
            raise InputError(f"{scenario.name}: replays need a straight road in one direction")
        x, y, h = (one[:, None, None] for one in self._frame)
        dx, dy = rollout.x - x, rollout.y - y
        cosine, sine = np.cos(h), np.sin(h)
        motion = dx * cosine + dy * sine, dy * cosine - dx * sine, rollout.h - h, rollout.v
        self._motion = np.stack(motion, axis=2)[:, 1:]
        ended = rollout.n_steps < rollout.shape[2]  # from then on nobody moves
        self.begin = np.where(ended, np.nan, _begin(rollout, self._motion))
        still = replace(scenario, story=replace(scenario.story, events=()))
        made = OntologySource(still, driver).concrete(space.values(X[0]), "", self._courses(0, ()))
        self._simulator = EmbeddedSimulator(made.storyboard, scenario.name, others="scripted")
        self._model, given = made.roads, self._simulator.parameters
        self._values = {n: column for n, column in runner.columns(X).items() if n in given}

    def run(self, elements: Sequence[str]) -> Rollout:
        """Simulate all events; what is none of these elements is as the parameters say."""
        n = len(self._events)
        courses = [self._courses(i, elements) for i in range(n)]
        roads = self._simulator.roads([self._model] * n, courses)
        return self._simulator.run(roads, np.arange(n, dtype=np.int64), self._values)

    def _courses(self, i: int, elements: Sequence[str]) -> dict[str, Float]:
        x, y, h = (float(one[i]) for one in self._frame)
        time = np.arange(self._motion.shape[3]) * self._step
        u, found = time - np.nan_to_num(self.begin[i]), {}
        for name, motion, track in zip(
            self._names, self._motion[i], self._events[i][1], strict=True
        ):
            s, d, turned = _composed(u, motion, track, self._width, elements)
            place = x + s * np.cos(h) - d * np.sin(h), y + s * np.sin(h) + d * np.cos(h)
            found[name] = rounded(np.column_stack([time, *place, h + turned]))
        return found


def _composed(
    u: Float, motion: Float, track: Track, width: float, elements: Sequence[str]
) -> Iterator[Float]:
    """Yield a motion with some elements as they were recorded: s, d [m], heading [rad].

    The distance to the recorded motion is the sum of three: that of another speed at the begin; of
    another acceleration then, which lasts as long as the event; and the rest, the shape.

    Args:
        u: ``(T,)`` time from the event's begin [s].
        motion: ``(4, T)`` s, d, heading and speed by the parameters.
        track: what was recorded.
        width: of the scenario's lane [m].
        elements: that are put back.
    """
    s, d, h, v = motion
    time, way, aside, turned, speeds = track.states
    after, known = u >= 0.0, np.clip(u, 0.0, time[-1])
    off = np.interp(known, time, way) + speeds[-1] * np.maximum(u - time[-1], 0.0)
    off += np.interp(0.0, u, s) - np.interp(0.0, time, way) - s
    faster = track.speed - float(np.interp(0.0, u, v))
    # The second before brings the speed there: a speed that jumps would be an event of its own.
    rise, lasting = np.clip(1.0 + u, 0.0, 1.0), np.clip(u, 0.0, track.duration)
    speed = faster * np.where(after, u, 0.5 * (rise**2 - 1.0))
    gain = track.acceleration * lasting * (np.maximum(u, 0.0) - 0.5 * lasting)
    rest = np.where(after, off - speed - gain, 0.0)
    for name, part in zip(ELEMENTS, (speed, gain, rest), strict=False):
        s = s + part if name in elements else s
    if ELEMENTS[3] in elements:
        # A lane change to the other side is mirrored: there, the scenario may have no lane.
        far, here = (float(one[np.argmax(np.abs(one))]) for one in (aside, d / width))
        if far * here < 0.0 and min(abs(far), abs(here)) > 0.5:
            aside, turned = -aside, -turned
        path = width * np.interp(known, time, aside)
        d = np.where(after, path, d + rise * (path[0] - float(np.interp(0.0, u, d))))
        h = np.where(after, np.interp(known, time, turned) * (u <= time[-1]), h)
    yield from (np.maximum.accumulate(s), d, h)


def _begin(rollout: Rollout, motion: Float) -> Float:
    """Return when the others' event begins, as a detector sees it, ``(N,)`` [s]; NaN if never.

    Of a change of speed that builds up and fades steadily, the ramp that fits passes half of it
    when the speed does, at the largest rate.
    """
    for number, actors in enumerate(rollout.event_actors):
        if actors and 0 not in actors:
            began, step = rollout.began[:, number], rollout.time_step
            found = np.where(began >= 0, began * step, np.nan)
            _, d, _, v = motion[:, min(actors) - 1].transpose(1, 0, 2)
            for i in np.flatnonzero((began >= 0) & (np.ptp(d, axis=1) < 0.1)).tolist():
                half, rate = 0.5 * (v[i, 0] + v[i, -1]), np.abs(np.diff(v[i])).max() / step
                if rate > 0.0:
                    middle = float(np.argmax(v[i] <= half)) * step
                    found[i] = max(middle - abs(v[i, 0] - half) / rate, found[i])
            return found
    return np.zeros(len(rollout.status))
