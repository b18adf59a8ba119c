"""The contract of a user's driver, tested: ``bridgegen check-driver module:Class``.

A scenario's result must depend on that scenario alone. So a driver must give the same answers for a
scenario whatever else is in the batch, in any order and at each repetition, and must forget its
state when it is reset.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bridgegen.arrays import Float
from bridgegen.odd.reader import load
from bridgegen.options import PipelineOptions
from bridgegen.pipeline import Pipeline
from bridgegen.simulation.rollout import STATUS_MESSAGES, Rollout

SCENARIOS = ("crossroads-s1", "cut-in", "red-light-runner", "pedestrian-behind-parked")
"""Crossing traffic, a motorway, a traffic light, a pedestrian between parked cars."""

ROWS = 16
"""Rows per scenario: few, since each is driven several times."""

MANY, SECONDS = 512, 1.0
"""Rows in the batch that measures the driver's speed, at most; fewer if they would take longer than
so many seconds."""

FIXED_BATCH = (
    "so little is rounding: networks and matrix products round differently by the size of the "
    "batch, unless they are called through bridgegen.ego.batches.FixedBatch"
)
"""What to do about a driver that differs by rounding only."""

ROUNDING = 1e-5
"""A relative difference below which rounding explains that a motion differs."""

_STATES = ("x", "y", "h", "v", "a", "n_steps", "status")


@dataclass(frozen=True)
class Check:
    """The result of one check.

    Attributes:
        scenario: in which the driver was checked.
        rule: that must hold.
        problem: how the driver breaks it; empty if it does not.
        figure: a measurement, or empty.
    """

    scenario: str
    rule: str
    problem: str = ""
    figure: str = ""


def check_driver(
    spec: str, scenarios: Sequence[str] = SCENARIOS, *, time_limit: float | None = None
) -> Iterator[Check]:
    """Yield the results of the checks of a driver, one after the other.

    Args:
        spec: ``package.module:Class``, ``file.py:Class``, a compiled driver's function, or
            ``file.fmu``, ``connect:HOST:PORT``, ``unix:PATH``, ``exec:COMMAND``.
        scenarios: names of the catalogue, or paths.
        time_limit: [s] that one call may take.

    Raises:
        InputError: the driver cannot be created, or no such scenario.
    """
    for name in scenarios:
        logical = load(name)
        pipeline = Pipeline(
            logical, logical.space(), PipelineOptions(ego=spec, time_limit=time_limit)
        )
        pipeline.warm_up()
        rng = np.random.default_rng(0)
        X = pipeline.space.decode(rng.random((ROWS, pipeline.space.n_var)))
        yield from _in_one(name, pipeline, X, rng)


def _in_one(name: str, pipeline: Pipeline, X: Float, rng: np.random.Generator) -> Iterator[Check]:
    start = time.perf_counter()
    whole = pipeline.rollout(X)
    took = time.perf_counter() - start
    failures = _failures(whole)
    yield Check(name, "every row is driven to its end", failures)
    order = rng.permutation(len(X)).tolist()
    single = order[0]
    tries: tuple[tuple[str, Callable[[], Rollout], Sequence[int]], ...] = (
        ("the same row again gives the same motion", lambda: pipeline.rollout(X), range(len(X))),
        ("the order of the rows does not matter", lambda: pipeline.rollout(X[order]), order),
        (
            "a row alone moves as it does among others",
            lambda: pipeline.rollout(X[single : single + 1]),
            [single],
        ),
        (
            "what it drove before is forgotten",
            lambda: _after(pipeline, X[::-1], X[: len(X) // 2]),
            range(len(X) // 2),
        ),
    )
    for rule, run, rows in tries:
        yield Check(name, rule, _difference(whole, run(), rows))
    if failures:
        return  # isolating failed rows takes time, which would be measured
    many = np.tile(X, (int(np.clip(SECONDS / took, 1, MANY // len(X))), 1))
    start = time.perf_counter()
    pipeline.rollout(many)
    rate = len(many) / (time.perf_counter() - start)
    yield Check(name, "speed", figure=f"{rate:.0f} scenarios/s in a batch of {len(many)}")


def _after(pipeline: Pipeline, before: Float, X: Float) -> Rollout:
    pipeline.rollout(before)
    return pipeline.rollout(X)


def _failures(rollout: Rollout) -> str:
    failed = np.flatnonzero(rollout.status)
    if not len(failed):
        return ""
    row = int(failed[0])
    words = [STATUS_MESSAGES[int(rollout.status[row])], *filter(None, [rollout.messages.get(row)])]
    return f"{len(failed)} of {len(rollout.status)} rows failed, the first: {': '.join(words)}"


def _difference(whole: Rollout, other: Rollout, rows: Sequence[int]) -> str:
    """Return the first difference between rows of two rollouts in words, or an empty text."""
    at = np.asarray(rows)
    for name in _STATES:
        one, two = getattr(whole, name)[at], getattr(other, name)
        if np.array_equal(one, two):
            continue
        place = tuple(int(i) for i in np.argwhere(one != two)[0])
        when = f" at {place[2] * whole.time_step:g} s" if len(place) == 3 else ""
        row, before, after = at[place[0]], float(one[place]), float(two[place])
        problem = f"row {row} has {name} = {before:.17g}{when}, and then {after:.17g}"
        rounded = abs(before - after) <= ROUNDING * max(abs(before), abs(after))
        return f"{problem}; {FIXED_BATCH}" if rounded else problem
    return ""
