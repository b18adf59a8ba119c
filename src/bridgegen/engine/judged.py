"""Rows of which a verdict is asked, not their motion: on a device, so that a row costs bytes.

The kernels are those of a rollout's analysis, so that all numbers have the same bits.
"""

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.assess.conflict import _codes as codes
from bridgegen.assess.conflict.analysis import IS_SO, NUMBERS, WHOLES, Conflicts
from bridgegen.assess.conflict.judging import facts_of, measuring_of, verdict_of
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.cuda import DEVICE
from bridgegen.drivers.lane_tables import CORRIDOR
from bridgegen.engine.runner import Runner
from bridgegen.simulation.embedded import _memory_kernels as memory


@dataclass(frozen=True)
class Judged:
    """The verdicts on N rows.

    Attributes:
        status: ``(N,)`` int8, see `Rollout`.
        code: ``(N,)`` int64, of `Implausible`.
        worst: ``(N,)`` int64, the highest kind of a row's conflicts.
        touches: ``(N,)`` bool, whether the ego's box meets another.
        n_steps: ``(N,)`` int64, see `Rollout`.
        metrics: ``(N, M)`` those that were asked for, NaN of a row that failed.
        conflicts: of some rows that succeeded; see `analysis.encounters`.
    """

    status: npt.NDArray[np.int8]
    code: Int
    worst: Int
    touches: Bool
    n_steps: Int
    metrics: Float
    conflicts: Callable[[Int], Conflicts]


def judge(
    runner: Runner,
    X: Float,
    *,
    until_collision: bool = False,
    violations: bool = False,
    metrics: Sequence[str] = (),
) -> Judged | None:
    """Judge N rows of one storyboard on this process's device; None where there is none.

    Args:
        runner: has the storyboard.
        X: ``(N, len(space.names))`` feasible rows.
        until_collision: whether a row may end with a collision of the ego's.
        violations: whether the ego's are among its conflicts; where its route changes lanes, only
            those of the rows in which it has not.
        metrics: of ``_measure_kernels.MEASURED``.
    """
    if not os.environ.get(DEVICE) or runner.refused or not len(X):
        return None
    # Numba is slow to import.
    from bridgegen.assess.conflict._judge_kernels import Facts
    from bridgegen.assess.conflict._measure_kernels import MEASURED, Measuring
    from bridgegen.engine._device_kernels import FIRST_METRIC, JUDGED, VIOLATIONS
    from bridgegen.simulation.embedded import device
    from bridgegen.simulation.embedded.batch import Batch

    program = runner.embedded.program
    roads, networks = runner.roads_of(X)
    first = np.unique(networks, return_index=True)[1]
    like = Batch(
        program, roads, networks[first], runner.columns(X[first]), None, None, until_collision
    )
    template = device.template_of(like.state)  # before it stands, which ends its rows
    rollout = like.standing()
    e, t = rollout.shape[1:]
    each = range(len(first))
    there = networks[first].tolist()
    corridors = roads.corridors(there) if violations else np.zeros((len(there), 0, CORRIDOR))
    facts = [facts_of(rollout, p, corridors[p]) for p in each]
    if facts[0].own_bodies != 1:
        return None
    judging = device.Judging(
        JUDGED
        | (VIOLATIONS if violations else 0)
        | sum(FIRST_METRIC << MEASURED.index(name) for name in metrics),
        _stacked(Facts, facts),
        _stacked(Measuring, [measuring_of(rollout, p) for p in each]),
        verdict_of(e, t),
        device.found_of(1, e, len(MEASURED), codes.INTEGERS, codes.FLOATS),
    )
    given = device.own_of(program, roads, networks, runner.columns(X))
    plan = device.coded(like.plan, program)

    def run(at: Int) -> device.Found:
        own = device.some_of(given, at)
        tables = roads.tables
        return device.current().run(
            plan, tables, networks[at], own, like.state, template, like.record, judging
        )

    found = run(np.arange(len(X)))
    while (again := np.flatnonzero(found.ending[:, memory.STATUS] == memory.UNPLANNED)).size:
        wanted = np.column_stack((networks[again], found.wanted[again]))
        roads.plan(tuple(item) for item in np.unique(wanted, axis=0).tolist())
        for array, part in zip(found, run(again), strict=True):
            array[again] = part
    if (found.done == 0).any():
        return None  # this processor has more memory for a row
    return Judged(
        found.ending[:, memory.STATUS].astype(np.int8),
        found.code[:, 0],
        found.worst[:, 0],
        found.instants[:, 0] >= 0,
        found.ending[:, memory.N_STEPS],
        found.metrics[:, [MEASURED.index(name) for name in metrics]],
        partial(_conflicts, found, rollout),
    )


def _stacked(kind: Any, each: list[Any]) -> Any:
    """Return the arrays of P road networks as one each; numbers are the same for all."""
    pairs = (list(values) for values in zip(*each, strict=True))
    return kind(
        *(np.stack(values) if isinstance(values[0], np.ndarray) else values[0] for values in pairs)
    )


def _conflicts(found: Any, rollout: Any, at: Int) -> Conflicts:
    """Return the conflicts of some rows, as ``analysis.encounters`` has them."""
    whole, real, changes = found.whole[at], found.real[at], found.changes[at]
    pairs: dict[str, Any] = {name: whole[:, :, column] for name, column in WHOLES.items()}
    pairs |= {name: whole[:, :, column] > 0 for name, column in IS_SO.items()}
    pairs |= {name: real[:, :, column] for name, column in NUMBERS.items()}
    shape = whole.shape[:2]
    return Conflicts(
        names=rollout.names,
        time_step=rollout.time_step,
        **pairs,
        severity=found.severity[at],
        potential=found.potential[at],
        delta_v_ego=changes[:, :, 0],
        delta_v_other=changes[:, :, 1],
        ok=np.ones(len(at), np.bool_),
        body=np.zeros(shape, np.int64),
        aside=found.aside[at],
        breach=found.breach[at],
        left_hand=rollout.left_hand,
        country=rollout.country,
    )
