"""Scenarios of a run with all that their playback shows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from bridgegen.assess.cause import Cause
from bridgegen.assess.conflict.analysis import Conflicts, analyse
from bridgegen.assess.conflict.harm import Count, decisive
from bridgegen.assess.conflict.outcomes import with_outcomes
from bridgegen.assess.conflict.summary import summarise
from bridgegen.assess.conflict.types import Zone
from bridgegen.assess.metrics.times import ttc_over_time
from bridgegen.base.arrays import Float
from bridgegen.base.errors import FileFormatError
from bridgegen.drivers import _weather_columns as column
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.replays import Replay, Replays
from bridgegen.pages.painter import paint
from bridgegen.pages.playback import Beside, Conflict, Course, Planned, Playback, Weather
from bridgegen.pages.scenery import Scenery, bodies, lamps, vehicle_lamps
from bridgegen.pages.sensing import sensed
from bridgegen.results.store import Recorded, Rows
from bridgegen.scenario.ontology.check import constraints_in_words
from bridgegen.scenario.ontology.mirror import mirrored
from bridgegen.scenario.weather import COLUMNS
from bridgegen.search.triage.record import Minimal
from bridgegen.simulation.rollout import STATUS_MESSAGES, Rollout

THIN = 0.01
"""Tolerance of a simplified line: largest distance of a dropped point from it [m]."""


PLAN_POINTS, PLANS_EVERY = 20, 0.2
"""Largest number of points of a trajectory that are shown, and least time between two trajectories
[s]."""

APART = 0.05
"""Least distance between an entity's positions with two drivers for the playback to show both
[m]."""


DIVERGED, COMMANDED = 0.1, 1.0
"""Distance between the ego's positions [m], and difference of its accelerations [m/s²], from which
on two drivers have diverged.

0.1 m is what one sees (two pixels of the playback), and far less than a gap that decides a
conflict. A command shows before the position does: 1 m/s² makes 0.1 m in 0.45 s. It is more than
drivers that keep their speed differ by, and less than braking that is meant to avoid something.
"""


@dataclass(frozen=True)
class Shown:
    """A row that is played.

    Attributes:
        name: of its files, or for people.
        evaluation: its row in the store, from 0; of a minimal scenario, what that was made from;
            `NO_ROW` of a fresh random draw.
        files: paths relative to the page.
        x: ``(len(space.names),)``.
        metrics: ``(M,)``.
        critical: whether it counts as critical.
        cause: the quick label; may be empty.
    """

    name: str
    evaluation: int
    files: tuple[str, ...]
    x: Float
    metrics: Float
    critical: bool
    cause: str


def playbacks(
    pipeline: Pipeline,
    rows: Rows | Recorded,
    kept: Sequence[tuple[str, int, tuple[str, ...]]],
    *,
    brief: bool = False,
    replays: Replays | None = None,
) -> tuple[Playback, ...]:
    """Return the playbacks of some of a run's scenarios.

    Args:
        pipeline: what evaluated the rows.
        rows: all of the run, in order.
        kept: name, evaluation and files of each, most critical first.
        brief: without the individuals' picture and the ego's planned course, which take most of the
            time, and without the baseline.
        replays: of these scenarios; simulated here by default.
    """
    if not kept:
        return ()
    some = rows.take(np.array([evaluation for _, evaluation, _ in kept]))
    shown = [
        Shown(
            name,
            evaluation,
            files,
            some.X[k],
            some.metrics[k],
            bool(some.critical[k]),
            Cause(some.cause[k]).label,
        )
        for k, (name, evaluation, files) in enumerate(kept)
    ]
    # Export and page share one simulation of the kept rows; each made its own before.
    replays = pipeline.replays(some.X, plans=not brief) if replays is None else replays
    played = _all_played(pipeline, shown, replays, brief=brief)
    return played if brief else beside_others(played, some.X, others_of(pipeline))


def minimal_playbacks(
    pipeline: Pipeline, wanted: Sequence[tuple[str, int, tuple[str, ...], Minimal]]
) -> tuple[Playback, ...]:
    """Return the playbacks of minimal scenarios, which are no rows of the run.

    Args:
        pipeline: what evaluated the run.
        wanted: name of each, the evaluation that it is the minimal form of, its files, and itself.
    """
    if not wanted:
        return ()
    X = np.array([minimal.x for *_, minimal in wanted])
    noise = np.array([minimal.noise_key for *_, minimal in wanted], dtype=np.uint64)
    names = [(name, evaluation, files) for name, evaluation, files, _ in wanted]
    played = measured_playbacks(pipeline, names, X, noise)
    return beside_others(played, X, others_of(pipeline), noise)


def measured_playbacks(
    pipeline: Pipeline,
    wanted: Sequence[tuple[str, int, tuple[str, ...]]],
    X: Float,
    noise: npt.NDArray[np.uint64] | None = None,
    *,
    brief: bool = True,
) -> tuple[Playback, ...]:
    """Return the playbacks of rows; they are measured anew.

    Args:
        pipeline: what evaluates them.
        wanted: name, evaluation and files of each.
        X: the rows, ``(N, len(space.names))``.
        noise: keys of the sensors' noise, ``(N,)``; by default each row's own.
        brief: without picture and planned course.
    """
    replays = pipeline.replays(X, plans=not brief, noise=noise)
    metrics = np.empty((len(X), len(pipeline.metrics)))
    for at, replay in replays.parts:
        metrics[at] = pipeline.measure(replay.rollout)
    critical = pipeline.objective.critical(metrics, pipeline.metrics)
    shown = [
        Shown(name, evaluation, files, X[k], metrics[k], bool(critical[k]), "")
        for k, (name, evaluation, files) in enumerate(wanted)
    ]
    return _all_played(pipeline, shown, replays, brief=brief)


def others_of(pipeline: Pipeline) -> Mapping[str, Pipeline]:
    """Return the pipelines of the drivers that the ego's is compared with, by their labels."""
    baseline = pipeline.baseline
    return {} if baseline is None else {baseline.driver.label: baseline}


def beside_others(
    played: Sequence[Playback],
    X: Float,
    others: Mapping[str, Pipeline],
    noise: npt.NDArray[np.uint64] | None = None,
) -> tuple[Playback, ...]:
    """Return playbacks with the motion of the same rows with other drivers of the ego.

    Args:
        played: the playbacks.
        X: their rows, ``(N, len(space.names))``.
        others: pipelines of the same scenario, by the labels of their drivers.
        noise: keys of the sensors' noise, ``(N,)``; by default each row's own.
    """
    found: list[list[Beside]] = [[] for _ in played]
    for label, pipeline in others.items() if played else ():
        rollout = pipeline.rollout(X) if noise is None else pipeline.runner.run(X, noise=noise)
        for k, playback in enumerate(played):
            if rollout.status[k] == 0:
                found[k].append(_beside(label, playback, rollout, k))
    return tuple(
        replace(playback, beside=tuple(other))
        for playback, other in zip(played, found, strict=True)
    )


def _beside(label: str, playback: Playback, rollout: Rollout, row: int) -> Beside:
    """Return the motion of a row, of the entities that move otherwise than in a playback."""
    rollout = rollout.as_driven()
    motion = {name: getattr(rollout, name)[row].copy() for name in "xyh"}
    motion["x"][:, int(rollout.n_steps[row]) :] = np.nan
    if rollout.present.size:
        motion["x"][~rollout.present[row]] = np.nan
    both = min(int(rollout.n_steps[row]), playback.n_steps)
    x, y = (motion[name][:, :both] - getattr(playback, name)[:, :both] for name in "xy")
    # At instants at which one of both is absent (NaN), nothing is compared.
    apart = np.nan_to_num(np.hypot(x, y), nan=0.0).max(axis=1, initial=0.0) > APART
    return Beside(label, tuple(np.flatnonzero(apart).tolist()), *(motion[n][apart] for n in "xyh"))


def diverged_at(first: Playback, second: Playback) -> int | None:
    """Return the first instant at which the ego moves otherwise with two drivers; see `DIVERGED`.

    Args:
        first: of a row with one driver.
        second: of the same row with the other one.

    Returns:
        None if it moves alike as long as both last, and as long with one as with the other.
    """
    both = min(first.n_steps, second.n_steps)
    apart = np.hypot(*(getattr(first, n)[0, :both] - getattr(second, n)[0, :both] for n in "xy"))
    differs = apart > DIVERGED
    if first.a is not None and second.a is not None:
        # The last instant begins no step: no acceleration holds from there on.
        a = np.abs(first.a[0, : both - 1] - second.a[0, : both - 1])
        differs[: both - 1] |= a > COMMANDED
    if differs.any():
        return int(differs.argmax())
    return None if first.n_steps == second.n_steps else both - 1


def nominal_playback(pipeline: Pipeline, name: str, x: Float | None = None) -> Playback:
    """Return the playback of a scenario with all parameters at their defaults, or of a row.

    No objective is asked whether it is critical.

    Args:
        pipeline: of the scenario.
        name: of the playback.
        x: the row, ``(len(space.names),)``.

    Raises:
        FileFormatError: it has no result.
    """
    X = (pipeline.space.row({}) if x is None else x)[np.newaxis]
    # One row has one storyboard, hence one part.
    ((_, replay),) = pipeline.replays(X, plans=False).parts
    rollout = replay.rollout
    if rollout.status[0] != 0:
        words = [STATUS_MESSAGES[int(rollout.status[0])], *rollout.messages.values()]
        raise FileFormatError(f"{pipeline.scenario.place}: {': '.join(words)}")
    metrics = pipeline.measure(rollout)
    shown = Shown(name, 0, (), X[0], metrics[0], critical=False, cause="")
    return _played(pipeline, [shown], replay, brief=True)[0]


def _all_played(
    pipeline: Pipeline, shown: Sequence[Shown], replays: Replays, *, brief: bool
) -> tuple[Playback, ...]:
    """Return the playbacks of rows that were rolled out, of one storyboard or of several."""
    found: dict[int, Playback] = {}
    for at, replay in replays.parts:
        some = [shown[i] for i in at.tolist()]
        played = _played(pipeline, some, replay, brief=brief)
        found |= zip(at.tolist(), played, strict=True)
    return tuple(replace(found[i], rank=i + 1) for i in sorted(found))


def _played(
    pipeline: Pipeline, shown: Sequence[Shown], replay: Replay, *, brief: bool
) -> tuple[Playback, ...]:
    """Return the playbacks of rows of one storyboard that were rolled out."""
    rollout, objective = replay.rollout, getattr(pipeline, "objective", None)
    seen = rollout.as_driven()
    count: Count = objective.count if objective else "ego"
    conflicts = analyse(rollout)
    entities = bodies(rollout, pipeline.runner.bodies(shown[0].x))
    scenery = Scenery(pipeline.runner)
    nearest = {0: rollout.distance.min(axis=1)} | {
        rollout.names.index(view.names[0]): view.distance.min(axis=1) for view in rollout.egos
    }
    ttc, detections = ttc_over_time(rollout), sensed(seen)
    shows = vehicle_lamps(seen, pipeline.runner.embedded.program.sirens)
    checked = constraints_in_words(pipeline.runner.source.constraints)
    found = []
    for k, item in enumerate(shown):
        conflict = _conflict(conflicts, k, count)
        concrete = pipeline.runner.concrete(item.x) if not brief else None
        motion = {name: getattr(seen, name)[k] for name in "xyhva"}
        if rollout.present.size:  # who is not there has no place and no speed
            motion |= {name: np.where(rollout.present[k], motion[name], np.nan) for name in "xyva"}
        road = scenery.road(item.x)
        picture = None
        if concrete is not None and concrete.individuals is not None:
            whole = with_outcomes(concrete.individuals, rollout, concrete.roads, k)
            picture = paint(mirrored(whole), (), checked)
        found.append(
            Playback(
                name=item.name,
                rank=k + 1,
                evaluation=item.evaluation,
                parameters=pipeline.runner.facts(item.x),
                metrics=dict(zip(pipeline.metrics, item.metrics.tolist(), strict=True)),
                critical=item.critical,
                time_step=rollout.time_step,
                entities=entities,
                **motion,
                distance=nearest[conflict.vehicle if conflict else 0][k],
                ttc=ttc[k],
                lanes=road.outlines,
                n_steps=int(rollout.n_steps[k]),
                files=item.files,
                picture=picture,
                lamps=lamps(rollout, k, road.lights),
                cause=item.cause,
                sensed=detections[k] if detections else None,
                course=_course(replay, k),
                plans=_plans(replay, k),
                weather=tuple(_weather(step, weather) for step, weather in replay.weathers[k]),
                street_lights=road.street_lights,
                conflict=conflict,
                shows=shows[k],
            )
        )
    return tuple(found)


def _conflict(conflicts: Conflicts, row: int, count: Count) -> Conflict | None:
    """Return the decisive conflict of a row."""
    summary = summarise(conflicts, row, count)
    if summary is None:
        return None
    other = int(decisive(conflicts, count)[0][row])
    vehicle, partner = conflicts.parties(row, other)
    instant = int(conflicts.instant[row, other])
    zones = [Zone(int(a[row, other])) for a in (conflicts.zone_ego, conflicts.zone_other)]
    if conflicts.left_hand:
        zones = [zone.other_side for zone in zones]
    return Conflict(
        summary=summary,
        partner=int(partner),
        vehicle=int(vehicle),
        instant=instant,
        decided=int(conflicts.decided[row, other]) if summary.happened else instant,
        zones=(int(zones[0]), int(zones[1])),
    )


def _course(replay: Replay, row: int) -> Course | None:
    meant = replay.intentions
    ways = replay.ways[row] if meant else None
    if not meant or not ways:
        return None
    number = np.full(max(ways) + 2, -1)  # -1 stays -1
    number[list(ways)] = range(len(ways))
    side = -1.0 if replay.rollout.left_hand else 1.0
    return Course(
        ways=tuple(thin(way) * (1.0, side) for way in ways.values()),
        steps=meant.steps,
        way=number[meant.way[row]],
        station=meant.station[row],
        acceleration=meant.acceleration[row],
        shift=meant.shift[row] * (side, side, 1.0, 1.0),
    )


def _plans(replay: Replay, row: int) -> tuple[Planned, ...]:
    """Return the trajectories of a row's driver, with a few points of each."""
    made = replay.intentions.plans if replay.intentions else ()
    if not made:
        return ()
    every = max(1, round(PLANS_EVERY / replay.rollout.time_step))
    found: list[Planned] = []
    for step, states in sorted(made[row].items()):
        if found and step - found[-1].step < every:
            continue
        time = states[:, 0]
        at = np.linspace(0.0, time[-1], min(PLAN_POINTS, len(time)))
        side = -1.0 if replay.rollout.left_hand else 1.0
        points = np.stack([np.interp(at, time, states[:, i]) for i in (1, 2)], axis=1)
        points *= 1.0, side
        found.append(Planned(step, float(time[-1]), points))
    return tuple(found)


def thin(line: Float, tolerance: float = THIN) -> Float:
    """Return a line ``(n, 2)`` without points it does not need to stay within a tolerance [m]."""
    kept = np.zeros(len(line), dtype=np.bool_)
    kept[[0, -1]] = True
    # Douglas and Peucker's simplification, with a stack in place of recursion, whose depth Python
    # limits.
    parts = [(0, len(line) - 1)]
    while parts:
        first, last = parts.pop()
        if last - first < 2:
            continue
        along = line[last] - line[first]
        off = line[first + 1 : last] - line[first]
        length = float(np.hypot(*along))
        gap = (
            np.abs(along[0] * off[:, 1] - along[1] * off[:, 0]) / length
            if length
            else np.hypot(*off.T)
        )
        worst = int(gap.argmax())
        if gap[worst] > tolerance:
            kept[first + 1 + worst] = True
            parts += [(first, first + 1 + worst), (first + 1 + worst, last)]
    return line[kept]


def _weather(step: int, felt: Float) -> Weather:
    from bridgegen.drivers._physics_kernels import KOSCHMIEDER  # numba is slow to import

    return Weather(
        step=step,
        stated={physical.name: float(felt[i]) for i, physical in enumerate(COLUMNS)},
        sight=float(KOSCHMIEDER / felt[column.EXTINCTION]),
        background=float(felt[column.BACKGROUND]),
    )
