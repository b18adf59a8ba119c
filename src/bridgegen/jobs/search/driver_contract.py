"""The contract of a user's driver, tested: ``bridgegen validate module:Class``.

A scenario's result must depend on that scenario alone. So a driver must give the same answers for a
scenario whatever else is in the batch, in any order and at each repetition, and must forget its
state when it is reset.
"""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.drivers import is_remote
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.embedded.user_drivers import OwnDriver
from bridgegen.simulation.rollout import FAILURES, STATUS_MESSAGES, Rollout

SCENARIOS = ("crossroads-s1", "cut-in", "red-light-runner", "pedestrian-behind-parked")
"""Scenarios of the check: crossing traffic, a motorway, a traffic light, a pedestrian between
parked cars."""

ROWS = 16
"""Number of rows per scenario: few, since each is driven several times."""

JUDGED = 25
"""Number of rows per scenario whose verdict is compared, if the driver does not repeat."""

MANY, SECONDS = 512, 1.0
"""Largest number of rows in the batch that measures the driver's speed, and its longest duration
[s], for which it has fewer."""

FIXED_BATCH = (
    "so little is rounding: networks and matrix products round differently by the size of the "
    "batch, unless they are called through bridgegen.drivers.batches.FixedBatch"
)
"""Advice for a driver whose answers differ by rounding only."""

ROUNDING = 1e-5
"""Difference of a motion, relative or in the unit, up to which rounding explains it."""

_STATES = {
    "a": "acceleration [m/s²]",
    "v": "speed [m/s]",
    "x": "x [m]",
    "y": "y [m]",
    "h": "h [rad]",
}
"""States that are compared; first those that a driver decides first: an acceleration acts from its
instant on."""

DRIVEN = "every row is driven to its end"
AGAIN = "the same row again gives the same motion"
ANEW = "so it does in a new process"
ORDER = "the order of the rows does not matter"
ALONE = "a row alone moves as it does among others"
BEFORE = "what it drove before is forgotten"

IN_SHORT = {
    "drives": (DRIVEN,),
    "deterministic": (AGAIN, ANEW),
    "free of cross-talk": (ORDER, ALONE, BEFORE),
}
"""Rules of the contract by the word that summarises them."""


@dataclass(frozen=True)
class Check:
    """The result of one check.

    Attributes:
        scenario: in which the driver was checked; the driver's name, or "in short", of what belongs
            to no scenario.
        rule: that must hold.
        problem: how the driver breaks it; empty if it does not.
        figure: a measurement or a fact, or empty.
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
    done: list[Check] = []
    counts = np.zeros(2, dtype=np.int64)
    for name in scenarios:
        logical = load(name)
        pipeline = Pipeline(
            logical, logical.space(), PipelineOptions(ego=spec, time_limit=time_limit)
        )
        pipeline.warm_up()
        rng = np.random.default_rng(0)
        X = pipeline.space.decode(rng.random((ROWS, pipeline.space.n_var)))
        for check in _in_one(name, pipeline, X, rng):
            if not done:
                yield Check(spec, "it is", figure=described(spec, pipeline))
            done.append(check)
            yield check
        broken = {check.rule for check in done if check.problem and check.scenario == name}
        seeded = "seed" in pipeline.runner.embedded.own_driver.traits.wants
        if seeded or broken & {AGAIN, ANEW}:
            counts += _verdicts(pipeline, rng)
    yield from _in_short(done)
    if counts.any():
        changed, of = counts.tolist()
        told = f"{changed} of {of} scenarios change their verdict; use --repeats 10"
        why = "by its seed" if seeded else "does not repeat"
        yield Check("in short", "verdicts", figure=f"{why}: {told}")


def described(spec: str, pipeline: Pipeline) -> str:
    """Return in words what a driver is and asks for; it must have driven.

    Args:
        spec: its name.
        pipeline: that it has driven in.
    """
    own = pipeline.runner.embedded.own_driver
    traits = own.process.traits
    if traits.memory is not None:
        kept = f"{traits.memory} number{'' if traits.memory == 1 else 's'}"
        return f"a compiled function that keeps {kept}; answers controls"
    kind = "a class in Python"
    if is_remote(spec):
        kind = "a driver in another process"
    elif spec.endswith(".fmu"):
        kind = "a co-simulation unit"
    asked = "asked at every instant"
    if traits.period is not None:
        step = pipeline.runner.embedded.time_step
        every = traits.steps(step)
        asked = f"asked every {every * step:.4g} s ({every} time steps of {step:g} s)"
    wants = f"wants {', '.join(traits.wants)}" if traits.wants else "wants nothing beyond the usual"
    answers = (
        " and ".join(
            {"control": "controls", "trajectory": "trajectories"}[answer]
            for answer in sorted(own.process.answers)
        )
        or "nothing valid"
    )
    return f"{kind}; {asked}; {wants}; answers {answers}"


def _verdicts(pipeline: Pipeline, rng: np.random.Generator) -> tuple[int, int]:
    """Return how many scenarios change their verdict when driven again, and how many have two."""
    pipeline.choose_objective()
    X = pipeline.space.decode(rng.random((JUDGED, pipeline.space.n_var)))
    first, second = (pipeline.evaluate(X, number) for number in (1, 2))
    known = (first.status == 0) & (second.status == 0)
    return int((first.critical != second.critical)[known].sum()), int(known.sum())


def _in_short(done: Sequence[Check]) -> Iterator[Check]:
    """Yield what the rules come to, over all scenarios."""
    for word, rules in IN_SHORT.items():
        tried = [check for check in done if check.rule in rules]
        where = dict.fromkeys(check.scenario for check in tried if check.problem)
        complete = len(tried) == len(rules) * len({check.scenario for check in done})
        answer = "yes" if complete else "not known"
        if where:
            answer = f"no, see {', '.join(where)}"
        yield Check("in short", word, figure=answer)


def _in_one(name: str, pipeline: Pipeline, X: Float, rng: np.random.Generator) -> Iterator[Check]:
    start = time.perf_counter()
    # Also the time from which the size of the last batch is chosen.
    whole = pipeline.rollout(X)
    took = time.perf_counter() - start
    yield Check(name, DRIVEN, _failures(pipeline, X, whole))
    rows = np.flatnonzero(whole.status == 0)
    if not len(rows):
        return
    # A row that fails has no motion to compare.
    X, whole = X[rows], whole.take(rows)
    problem = _difference(whole, pipeline.rollout(X), rows)
    yield Check(name, AGAIN, problem)
    own = pipeline.runner.embedded.own_driver
    own.restart()
    anew = pipeline.rollout(X)
    yield Check(name, ANEW, _difference(whole, anew, rows))
    order = rng.permutation(len(rows))
    half = np.arange(max(1, len(rows) // 2))
    tries: tuple[tuple[str, Callable[[], Rollout], Int], ...] = (
        (ORDER, lambda: pipeline.rollout(X[order]), order),
        (BEFORE, lambda: _after(pipeline, X[::-1], X[half]), half),
        (ALONE, lambda: pipeline.rollout(X[order[:1]]), order[:1]),
    )
    # Where repetition alone changes the motion, order and company cannot be told apart from it.
    for rule, run, at in () if problem else tries:
        own.process.call_seconds.clear()
        yield Check(name, rule, _difference(anew.take(at), run(), rows[at]))
    times = [] if problem else [f"{_percentiles(own)} with 1 scenario"]
    many = np.tile(X, (int(np.clip(SECONDS / took, 1, MANY // len(X))), 1))
    own.process.call_seconds.clear()
    start = time.perf_counter()
    pipeline.rollout(many)
    rate = len(many) / (time.perf_counter() - start)
    if own.process.call_seconds:
        times.append(f"{_percentiles(own)} with {len(many)}")
        yield Check(name, "time per call", figure="; ".join(times))
    yield Check(name, "speed", figure=f"{rate:.0f} scenarios/s in a batch of {len(many)}")


def _percentiles(own: OwnDriver) -> str:
    """Return the median and the 99th percentile of the last calls in words; of none, nothing."""
    seconds = own.process.call_seconds
    if not seconds:
        return ""
    half, most = 1e3 * np.percentile(seconds, [50, 99])
    return f"p50 {half:.3g} ms, p99 {most:.3g} ms"


def _after(pipeline: Pipeline, before: Float, X: Float) -> Rollout:
    pipeline.rollout(before)
    return pipeline.rollout(X)


def _failures(pipeline: Pipeline, X: Float, rollout: Rollout) -> str:
    """Return which rows failed in words, and when the first did, driven again by itself."""
    failed = np.flatnonzero(rollout.status)
    if not len(failed):
        return ""
    row = int(failed[0])
    words = [STATUS_MESSAGES[int(rollout.status[row])], *filter(None, [rollout.messages.get(row)])]
    process, when = pipeline.runner.embedded.own_driver.process, ""
    if process.traits.memory is None and rollout.status[row] in FAILURES.values():
        pipeline.rollout(X[row : row + 1])
        when = f" at {process.asked_at:g} s"
    return (
        f"{len(failed)} of {len(rollout.status)} rows failed, the first: row {row}{when}: "
        f"{': '.join(words)}"
    )


def _difference(rollout: Rollout, other: Rollout, rows: Int) -> str:
    """Return the first difference in time between two rollouts in words, or nothing.

    Args:
        rollout: of N rows.
        other: of the same rows.
        rows: ``(N,)`` their numbers.
    """
    found = []
    for rank, name in enumerate(_STATES):
        apart = np.argwhere(getattr(rollout, name) != getattr(other, name))
        if len(apart):
            i, entity, k = apart[np.lexsort((apart[:, 1], apart[:, 0], apart[:, 2]))[0]].tolist()
            found.append((k, i, rank, entity, name))
    if not found:
        ends = np.flatnonzero((rollout.n_steps != other.n_steps) | (rollout.status != other.status))
        return f"row {rows[ends[0]]} ends in another way" if len(ends) else ""
    k, i, _, entity, name = min(found)
    before, after = (float(getattr(made, name)[i, entity, k]) for made in (rollout, other))
    problem = (
        f"row {rows[i]} differs first at {k * rollout.time_step:g} s: {_STATES[name]} of "
        f"'{rollout.names[entity]}' = {before:.17g}, and then {after:.17g}"
    )
    rounded = abs(before - after) <= ROUNDING * max(abs(before), abs(after), 1.0)
    return f"{problem}; {FIXED_BATCH}" if rounded else problem
