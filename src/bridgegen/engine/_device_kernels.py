"""One row on a device: simulated, then judged and measured there, so that a row costs bytes."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import numpy as np

from bridgegen.assess.conflict._codes import KIND
from bridgegen.assess.conflict._judge_kernels import judge_row
from bridgegen.assess.conflict._measure_kernels import MEASURED, implausible_row, measure_row
from bridgegen.base.compiled import kernel
from bridgegen.drivers._weather_columns import FRICTION
from bridgegen.simulation.embedded._memory_kernels import N_STEPS, OK, STATUS
from bridgegen.simulation.embedded._rollout_kernels import simulate_row
from bridgegen.simulation.embedded.device import MOTION

JUDGED, VIOLATIONS, FIRST_METRIC = 1, 2, 4
"""What is asked of a row besides its motion: a verdict; violations in it; and metrics, each by its
bit from the third on."""


@kernel
def run_row(asked, plan, roads, state, record, facts, measuring, verdict, given, found):
    """Simulate a row, and judge and measure it if it ended well; all but the first are bundles.

    The last two are `Given` and `Found` of `bridgegen.simulation.embedded.device`.
    """
    copy_to(state.slots, given.slots)
    copy_to(state.station, given.station)
    copy_to(state.aside, given.aside)
    state.key[0] = given.key[0]
    for i in range(len(record.began)):
        record.began[i] = -1
    for e in range(len(record.present)):
        for k in range(record.present.shape[1]):
            record.present[e, k] = False
    for e in range(len(record.lamps)):
        for k in range(record.lamps.shape[1]):
            record.lamps[e, k] = 0
    for e in range(len(record.detections)):
        for k in range(record.detections.shape[1]):
            for j in range(record.detections.shape[2]):
                record.detections[e, k, j] = 0.0
    simulate_row(plan, roads, state, record)
    copy_to(found.ending, state.ending)
    copy_to(found.wanted, state.wanted)
    copy_to(found.transitions, state.transitions)
    found.on[0] = state.on[0]
    found.way[0], found.way[1] = state.travelled[0], state.station[0]
    found.way[2] = state.weather[FRICTION]
    if asked != MOTION and state.ending[STATUS] == OK:
        judge(asked, state, record, facts, measuring, verdict, found)
    found.done[0] = 1


@kernel
def judge(asked, state, record, facts, measuring, verdict, found):
    """Judge and measure a row that ended well."""
    n = state.ending[N_STEPS]
    path = state.on[0] if asked & VIOLATIONS else -1
    judge_row(n, 0, path, state.weather[FRICTION], facts, record, verdict)
    found.code[0] = implausible_row(n, facts, measuring, record, verdict)
    found.worst[0] = 0
    for e in range(len(verdict.whole)):
        found.worst[0] = max(found.worst[0], verdict.whole[e, KIND])
        copy_to(found.whole[e], verdict.whole[e])
        copy_to(found.real[e], verdict.real[e])
        copy_to(found.changes[e], verdict.changes[e])
    copy_to(found.potential, verdict.potential)
    copy_to(found.severity, verdict.severity)
    copy_to(found.aside, verdict.aside)
    copy_to(found.breach, verdict.breach)
    copy_to(found.instants, verdict.instants)
    for which in range(len(MEASURED)):
        found.metrics[which] = np.nan
        if asked & FIRST_METRIC << which:
            found.metrics[which] = measure_row(which, n, facts, measuring, record, verdict)


@kernel
def copy_to(to, what):
    """Copy the elements of an array of one axis."""
    for i in range(len(what)):
        to[i] = what[i]
