"""Observations of a user's own driver that wants "conflicts" or "history"."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import bundled, bundled_row, kernel
from bridgegen.drivers._prediction_kernels import predict
from bridgegen.drivers._reference_kernels import reach_of
from bridgegen.drivers._yielding_kernels import (
    ENTER,
    ENTITY,
    FRONT,
    HOW,
    LEAVE,
    OTHER_ENTERS,
    OTHER_LEAVES,
    RANK,
    REAR,
    STATION,
)
from bridgegen.drivers.interface import HISTORY_STEP
from bridgegen.simulation.embedded._memory_kernels import N_STEPS


@kernel
def see_conflicts(k, plan, roads, state, record, found):
    """Fill ``found`` ``(M, W, CONFLICT)``; the tracks must be those of instant k."""
    on, s, body = state.on[0], state.station[0], plan.bodies[0]
    path, n, ds = roads.paths[on], roads.counts[on], roads.steps[on]
    # By the reference driver's own kernel, so that what a driver is told is what ours goes by.
    count = predict(
        path, n, ds, s, reach_of(record.v[0, k]), body[1], state.tracks, state.around, on == 0,
        roads.hypotheses, roads.hypothesis_counts, roads.hypothesis_steps, roads.hypothesis_zones,
        roads.hypothesis_ranks, roads.hypothesis_first, state.feet, state.passages,
    )  # fmt: skip
    front, rear = s + body[2] + 0.5 * body[0], s + body[2] - 0.5 * body[0]
    for e in range(found.shape[0]):
        for w in range(found.shape[1]):
            for i in range(found.shape[2]):
                found[e, w, i] = math.nan
    for i in range(count):
        passage = state.passages[i]
        q, e = passage[STATION], int(passage[ENTITY]) - 1
        row = (
            passage[ENTER] - front,
            passage[LEAVE] - rear,
            passage[OTHER_ENTERS] - q - passage[FRONT],
            passage[OTHER_LEAVES] - q + passage[REAR],
            passage[RANK],
            passage[HOW],
        )
        at = 0
        while at < found.shape[1] and found[e, at, 0] <= row[0]:
            if (
                found[e, at, 0] == row[0]
                and found[e, at, 1] == row[1]
                and found[e, at, 2] == row[2]
                and found[e, at, 3] == row[3]
                and found[e, at, 4] == row[4]
                and found[e, at, 5] == row[5]
            ):
                at = found.shape[1]  # two ways that part beyond it
            at += 1
        if at < found.shape[1]:
            for w in range(found.shape[1] - 1, at, -1):
                for j in range(found.shape[2]):
                    found[e, w, j] = found[e, w - 1, j]
            (
                found[e, at, 0],
                found[e, at, 1],
                found[e, at, 2],
                found[e, at, 3],
                found[e, at, 4],
                found[e, at, 5],
            ) = row


@kernel
def see_conflicts_of_rows(k, plan, networks, rows, states, records, found):
    """Fill ``(N, M, W, CONFLICT)`` of rows that run."""
    plan = bundled(plan)
    for i in range(len(rows)):
        if states.ending[i, N_STEPS] == 0:
            roads, state = bundled_row(networks, rows[i]), bundled_row(states, i)
            see_conflicts(k, plan, roads, state, bundled_row(records, i), found[i])


@kernel
def remember(k, dt, others, past, tracked):
    """Keep the tracks of instant k, and fill those of the last second.

    ``others`` ``(M, TRACK)`` are the tracks, ``past`` ``(F, M, TRACK)`` those of the last F
    instants, instant k in k mod F; ``tracked`` ``(M, H, TRACK)``.
    """
    frames = past.shape[0]
    for e in range(others.shape[0]):
        for i in range(others.shape[1]):
            past[k % frames, e, i] = others[e, i]
        for j in range(tracked.shape[1]):
            back = round(j * HISTORY_STEP / dt)
            for i in range(others.shape[1]):
                tracked[e, j, i] = past[(k - back) % frames, e, i] if back <= k else 0.0
