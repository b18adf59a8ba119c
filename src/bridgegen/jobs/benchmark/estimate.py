"""How long a benchmark will take, from the speed of each driver on this machine."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bridgegen.base.errors import BridgeGenError
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Threads
from bridgegen.jobs.benchmark.plan import Entrant, Plan
from bridgegen.jobs.search.scenarios import load

FEW, MANY = 4, 32
"""Random rows in the two batches that measure a driver's speed."""

SLOW = 10.0
"""Seconds beyond which the larger batch is not driven: the smaller one says enough."""

TESTED = {"full": 2000, "short": 800, "none": 0}
"""Rows that a triage simulates again, about: neighbours, causes, minimal scenarios. Measured: 260
to 3,800 a run if full, 0 to 1,200 if short."""

BESIDE = 8.0
"""Seconds that a run takes besides: to begin, export and report. Measured on one core."""


@dataclass(frozen=True)
class Speed:
    """The speed of a driver.

    Attributes:
        seconds: of one evaluation, in one thread.
        runs: that it has to make.
    """

    seconds: float
    runs: int


def measured(plan: Plan, say: Callable[[str], None]) -> tuple[Plan, dict[str, Speed]]:
    """Return the plan, with the drivers that cannot be made, and the speed of each other one.

    Each drives some random rows of the first scenario that is applicable to it.

    Args:
        plan: of the benchmark.
        say: called with each driver's name.
    """
    found, speeds = [], {}
    for one in plan.entrants:
        say(one.name)
        runs = sum(cell.driver == one.name for cell in plan.cells)
        scenario = next((s for s in plan.scenarios if plan.is_applicable(one, s)), None)
        if scenario is None:
            found.append(one)
            continue
        try:
            seconds = _seconds(one, plan.scenarios[scenario])
        except BridgeGenError as error:
            found.append(replace(one, problem=str(error)))
            continue
        found.append(one)
        speeds[one.name] = Speed(seconds, runs)
    return replace(plan, entrants=tuple(found)), speeds


def seconds_of(plan: Plan, speeds: dict[str, Speed], at_once: int) -> float:
    """Return how many seconds the whole benchmark takes, about.

    Each run makes its evaluations; about one of those of each driver, scenario and column is
    tested, too.
    """
    total = 0.0
    for one in speeds.values():
        tested = one.runs / plan.seeds * TESTED[plan.triage]
        total += one.seconds * (one.runs * plan.budget + tested) + one.runs * BESIDE
    return total / at_once


def _seconds(entrant: Entrant, scenario: str) -> float:
    """Return the seconds of one evaluation among others; failed rows count as well."""
    logical = load(scenario)
    ideal = ("perception",) if entrant.perceives else ()
    options = PipelineOptions(ego=entrant.name, ideal=ideal)
    pipeline = Pipeline(logical, logical.space(), options, workers=Threads(1))
    pipeline.warm_up()
    U = np.random.default_rng(0).random((MANY, pipeline.space.n_var))
    X = pipeline.space.decode(U)
    took = {}
    for n in (FEW, MANY):
        start = time.perf_counter()
        pipeline.rollout(X[:n])
        took[n] = time.perf_counter() - start
        if took[n] > SLOW:
            break
    pipeline.simulator.stop()
    return took[max(took)] / max(took)
