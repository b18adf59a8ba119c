"""Compiled metrics of a row that ``judge_row`` has judged: the batch's kernels, of one row.

They also run where there is no Python: in a page.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from typing import NamedTuple

import numpy as np

from bridgegen.assess.conflict._plausibility_kernels import judge
from bridgegen.assess.metrics._brake_kernels import largest_required
from bridgegen.assess.metrics._kernels import (
    acceleration_change,
    braking_edges,
    contacts,
    largest_offset,
    missing_share,
    red_lights,
)
from bridgegen.assess.metrics._perception_kernels import (
    mean_average_precision,
    mean_error,
    mean_iou,
    truth,
)
from bridgegen.assess.metrics._time_kernels import (
    avoidance_rate,
    encroachment,
    headway,
    least_time,
    short_times,
)
from bridgegen.base.arrays import Float, Int
from bridgegen.base.compiled import kernel
from bridgegen.simulation._box_kernels import directions

MEASURED = (
    *("d_min", "v_d", "l_offset", "a_change", "n_brake", "n_collision", "r_red", "rss", "btn"),
    *("ttc", "pet", "drac", "thw", "tet", "tit", "iou", "e_position", "map"),
)
"""Names of the metrics, by their number."""

(
    D_MIN, V_D, L_OFFSET, A_CHANGE, N_BRAKE, N_COLLISION, R_RED, RSS, BTN,
    TTC, PET, DRAC, THW, TET, TIT, IOU, E_POSITION, MAP,
) = range(18)  # fmt: skip


class Measuring(NamedTuple):
    """What the metrics and the gate need besides `Facts`, the same for all rows of a storyboard.

    Attributes:
        limits: ``(E, 6)``, see ``plausibility.LIMITS``.
        towed_by: ``(E,)``; -1 of who has no trailer.
        window: instants of `plausibility.WINDOW`,
        merged: of ``impact.MERGED``,
        abrupt: of ``braking.ABRUPT``,
        longest: of ``times.LONGEST``.
        hard: deceleration of a hard braking [m/s²],
        most: largest that counts,
        grip: what tyres give.
        target: ``times.TARGET`` [s].
        beside: ``road.ASIDE`` [m].
        safe: ``(8,)``, ``distances.Parameters``.
        lines: ``(L, 3)``, stop lines of the ego,
        line_lights: ``(L,)``, and their lights.
        classes: ``(E,)`` of detection,
        reach: ``(E,)`` their ranges [m].
        class_of_kind, ranges, thresholds: see ``perception``.
    """

    limits: Float
    towed_by: Int
    window: int
    merged: int
    abrupt: int
    longest: int
    hard: float
    most: float
    grip: float
    target: float
    beside: float
    safe: Float
    lines: Float
    line_lights: Int
    classes: Int
    reach: Float
    class_of_kind: Int
    ranges: Float
    thresholds: Float


@kernel
def headings(n_steps, record):
    """Return cosine and sine of the headings, ``(1, E, T)``: ``Verdict``'s turn who reverses."""
    cosine, sine = np.empty((1, *record.h.shape)), np.empty((1, *record.h.shape))
    for e in range(len(record.h)):
        directions(record.h[e], n_steps, cosine[0, e], sine[0, e])
    return cosine, sine


@kernel
def implausible_row(n_steps, facts, measuring, record, verdict):
    """Return the code of what is implausible in a row, see ``plausibility.Implausible``."""
    steps, failed = np.empty(1, np.int64), np.zeros(1, np.bool_)
    steps[0] = min(n_steps - 1, verdict.until[0]) + 1
    code, instant, entity, other = (
        np.empty(1, np.int8), np.empty(1, np.int64), np.empty(1, np.int64), np.empty(1, np.int64),
    )  # fmt: skip
    value, limit = np.empty(1), np.empty(1)
    cosine, sine = headings(n_steps, record)
    judge(
        facts.box, measuring.limits, record.x[None], record.y[None], record.h[None],
        record.v[None], cosine, sine, verdict.distance[None],
        record.present[None][: min(len(record.present), 1)], measuring.towed_by, steps, failed,
        facts.time_step, measuring.window, code, instant, entity, other, value, limit,
    )  # fmt: skip
    return code[0]


@kernel
def measure_row(which, n_steps, facts, measuring, record, verdict):
    """Return a metric of a row that did not fail; the last four are bundles.

    Args:
        which: its number in ``MEASURED``.
        n_steps: the recorded instants.
        facts: `Facts`.
        measuring: `Measuring`.
        record: of this row, see ``_memory_kernels.Record``.
        verdict: `Verdict`, as ``judge_row`` has filled it.
    """
    if which == D_MIN:
        return verdict.least[0]
    if which == V_D:
        return abs(record.v[0, verdict.instants[1]]) if verdict.instants[1] >= 0 else 0.0
    out, steps = np.zeros(1), np.empty(1, np.int64)
    steps[0] = n_steps
    distance = verdict.distance[None]
    if which == L_OFFSET:
        largest_offset(record.offset[None], steps, out)
    elif which == A_CHANGE:
        acceleration_change(record.a[None], steps, measuring.abrupt, out)
    elif which == N_BRAKE:
        braking_edges(record.a[None], steps, measuring.hard, out)
    elif which == N_COLLISION:
        contacts(distance, steps, measuring.merged, out)
    elif which == TTC:
        least_time(
            facts.box, record.x[None], record.y[None], record.h[None], record.v[None], distance,
            steps, out,
        )  # fmt: skip
    elif which == R_RED:
        if len(measuring.lines):
            cosine, sine = headings(n_steps, record)
            red_lights(
                facts.box[0, 2] + 0.5 * facts.box[0, 0], record.x[None], record.y[None], cosine,
                sine, measuring.lines[None], measuring.line_lights, record.lights[None], steps,
                measuring.beside, out,
            )  # fmt: skip
    elif which >= IOU:
        _perceive(which, steps, facts, measuring, record, out)
    else:
        _course(which, steps, facts, measuring, verdict, distance, out)
    return out[0]


@kernel
def _course(which, steps, facts, measuring, verdict, distance, out):
    """Write a metric of bodies that keep their course."""
    x, y, c, s = verdict.x[None], verdict.y[None], verdict.cosine[None], verdict.sine[None]
    v, half, dt = verdict.v[None], facts.half, facts.time_step
    if which == PET:
        encroachment(half, x, y, c, s, distance, steps, measuring.longest, out)
        out[0] *= dt
    elif which == DRAC:
        avoidance_rate(half, x, y, c, s, v, distance, steps, measuring.most, out)
    elif which == THW:
        headway(half, x, y, c, s, v, distance, steps, out)
    elif which == RSS:
        missing_share(half, x, y, c, s, v, distance, steps, measuring.safe, out)
    elif which == BTN:
        largest_required(half, x, y, c, s, v, verdict.a[None], distance, steps, measuring.most, out)
        out[0] /= measuring.grip
    else:
        short = np.empty((1, 2))
        short_times(half, x, y, c, s, v, distance, steps, measuring.target, short)
        out[0] = short[0, 0 if which == TET else 1] * dt


@kernel
def _perceive(which, steps, facts, measuring, record, out):
    """Write a metric of perception."""
    x, y, h = record.x[None], record.y[None], record.h[None]
    seen = record.detections[: len(record.x)][None]  # ghosts come after the participants
    cosine, sine = headings(steps[0], record)
    centre_x, centre_y = np.empty(x.shape), np.empty(x.shape)
    counts = np.empty(x.shape, np.bool_)
    truth(facts.box, x, y, cosine, sine, seen, steps, measuring.reach, centre_x, centre_y, counts)
    for e in range(len(record.present)):
        for k in range(steps[0]):
            counts[0, e, k] = counts[0, e, k] and record.present[e, k]
    if which == IOU:
        mean_iou(facts.half, h, cosine, sine, centre_x, centre_y, counts, seen, steps, out)
    elif which == E_POSITION:
        mean_error(centre_x, centre_y, counts, seen, steps, out)
    else:
        mean_average_precision(
            x, y, centre_x, centre_y, counts, measuring.classes, seen, steps,
            measuring.class_of_kind, measuring.ranges, measuring.thresholds, out,
        )  # fmt: skip
