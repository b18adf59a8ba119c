"""The kept scenarios, rolled out again, with all that their playback shows."""

from collections.abc import Sequence

import numpy as np

from bridgegen.arrays import Float
from bridgegen.cause import Cause
from bridgegen.ego import _weather_columns as column
from bridgegen.evaluation import Replay
from bridgegen.metrics.ttc import ttc_over_time
from bridgegen.ontology.check import constraints_in_words
from bridgegen.pipeline import Pipeline
from bridgegen.report.painter import paint
from bridgegen.report.playback import Course, Playback, Weather
from bridgegen.report.scenery import Scenery, bodies, lamps
from bridgegen.report.sensing import sensed
from bridgegen.simulation.outcomes import with_outcomes
from bridgegen.store import Rows

THIN = 0.01
"""How far a way's line may be off where its points lie nearly straight [m]."""


def playbacks(
    pipeline: Pipeline,
    rows: Rows,
    kept: Sequence[tuple[str, int, tuple[str, ...]]],
    *,
    brief: bool = False,
) -> tuple[Playback, ...]:
    """Return the playbacks of some of a run's scenarios.

    Args:
        pipeline: what evaluated the rows.
        rows: all of the run, in order.
        kept: name, evaluation and files of each, most critical first.
        brief: without the individuals' picture and the ego's planned course, which take most of the
            time.
    """
    if not kept:
        return ()
    at = [evaluation for _, evaluation, _ in kept]
    replay = pipeline.replay(rows.X[at], plans=not brief)
    rollout = replay.rollout
    entities, scenery = bodies(rollout, pipeline.source.bodies), Scenery(pipeline)
    nearest = rollout.distance.min(axis=1)
    ttc, detections = ttc_over_time(rollout), sensed(rollout)
    checked = constraints_in_words(pipeline.source.constraints)
    found = []
    for k, (name, evaluation, files) in enumerate(kept):
        concrete = pipeline.concrete(rows.X[evaluation]) if not brief else None
        motion = {name: getattr(rollout, name)[k] for name in "xyhva"}
        if rollout.present.size:  # who is not there has no place and no speed
            motion |= {name: np.where(rollout.present[k], motion[name], np.nan) for name in "xyva"}
        road = scenery.road(rows.X[evaluation])
        picture = None
        if concrete is not None and concrete.individuals is not None:
            whole = with_outcomes(concrete.individuals, rollout, concrete.roads, k)
            picture = paint(whole, (), checked)
        found.append(
            Playback(
                name=name,
                rank=k + 1,
                evaluation=evaluation,
                parameters=pipeline.facts(rows.X[evaluation]),
                metrics=dict(zip(pipeline.metrics, rows.metrics[evaluation].tolist(), strict=True)),
                critical=bool(rows.critical[evaluation]),
                time_step=rollout.time_step,
                entities=entities,
                **motion,
                distance=nearest[k],
                ttc=ttc[k],
                lanes=road.outlines,
                n_steps=int(rollout.n_steps[k]),
                files=files,
                picture=picture,
                lamps=lamps(rollout, k, road.lights),
                cause=Cause(rows.cause[evaluation]).label,
                sensed=detections[k] if detections else None,
                course=_course(replay, k),
                weather=tuple(_weather(step, one) for step, one in replay.weathers[k]),
                street_lights=road.street_lights,
            )
        )  # fmt: skip
    return tuple(found)


def _course(replay: Replay, row: int) -> Course | None:
    meant = replay.intentions
    ways = replay.ways[row] if meant else None
    if not meant or not ways:
        return None
    number = np.full(max(ways) + 2, -1)  # -1 stays -1
    number[list(ways)] = range(len(ways))
    return Course(
        ways=tuple(_thin(way) for way in ways.values()),
        steps=meant.steps,
        way=number[meant.way[row]],
        station=meant.station[row],
        acceleration=meant.acceleration[row],
        shift=meant.shift[row],
    )


def _thin(line: Float) -> Float:
    """Return a line without the points that it does not need to stay within ``THIN`` of itself."""
    kept = np.zeros(len(line), dtype=np.bool_)
    kept[[0, -1]] = True
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
        if gap[worst] > THIN:
            kept[first + 1 + worst] = True
            parts += [(first, first + 1 + worst), (first + 1 + worst, last)]
    return line[kept]


def _weather(step: int, felt: Float) -> Weather:
    from bridgegen.ego._physics_kernels import KOSCHMIEDER  # numba is slow to import

    return Weather(
        step=step,
        visual_range=float(felt[column.VISUAL_RANGE]),
        sight=float(KOSCHMIEDER / felt[column.EXTINCTION]),
        rain=float(felt[column.RAIN]),
        snow=float(felt[column.SNOW]),
        sun=float(felt[column.SUN_ELEVATION]),
        cloud=float(felt[column.CLOUD]),
        background=float(felt[column.BACKGROUND]),
        friction=float(felt[column.FRICTION_SCALE]),
    )
