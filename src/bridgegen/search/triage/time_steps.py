"""Whether findings depend on the simulation's time step: rows again at fractions of it.

Triggers, drivers and contacts act at the instants of a simulation, so that its results have an
error of the first order in the step, and a verdict may hang on it.
"""

from collections.abc import Sequence

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.trials import EVENT
from bridgegen.search.triage.record import AtStep, StepCheck
from bridgegen.simulation.choice import SimulatorChoice


def step_checks(
    pipeline: Pipeline, X: Float, evaluations: Int, finer: Sequence[int]
) -> list[StepCheck]:
    """Simulate rows at the time step and at fractions of it; a row's result depends on it alone.

    Args:
        pipeline: the run's, one that ``tries``.
        X: ``(K, len(space.names))``, the rows.
        evaluations: ``(K,)`` their ids in the store.
        finer: how many steps make one of the scenario's, in ascending order; the rows that a
            driver sees, its noise and its sensors' rates stay as they are.
    """
    if not len(X):
        return []
    at: list[list[AtStep]] = [[] for _ in evaluations]
    for steps in (1, *finer):
        there = pipeline if steps == 1 else pipeline.elsewhere(SimulatorChoice(finer=steps))
        trials = there.try_all(X)
        event = dict(zip(EVENT, trials.event.T.tolist(), strict=True))
        for k, results in enumerate(at):
            conflict = str(trials.findings.conflict[k])
            results.append(
                AtStep(
                    steps=steps,
                    ok=bool(trials.ok[k]),
                    harmful=bool(trials.harmful[k]),
                    harm=float(trials.harm[k]),
                    severity=float(trials.severity[k]),
                    time=event["time"][k] if conflict else None,
                    place=(event["x"][k], event["y"][k]) if conflict else None,
                    speed=event["v_ego"][k] if conflict else None,
                    conflict=conflict,
                )
            )
    step = pipeline.runner.embedded.time_step
    return [
        StepCheck(evaluation=int(i), time_step=step, at=tuple(results))
        for i, results in zip(np.asarray(evaluations).tolist(), at, strict=True)
    ]
