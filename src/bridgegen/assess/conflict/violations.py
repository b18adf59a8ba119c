"""Violations of the ego's: it leaves its lane or the road, or passes someone too closely.

Nothing needs to come near it for that. A departure has no other participant: it stands in the ego's
own column. Both need the lanes of the ego's route (`Rollout.corridors`); without them, no violation
is known.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from bridgegen.assess.conflict import severity as injury
from bridgegen.assess.conflict._limits import (
    CLEAR_ZONE,
    CLOSE,
    CLOSE_TIME,
    HORIZON,
    PASSED_AHEAD,
    PASSED_BESIDE,
    PASSES,
)
from bridgegen.assess.conflict.analysis import CONTACT, COURSE, NEAR_MISS, VIOLATION, Conflicts
from bridgegen.assess.conflict.types import ConflictType, Responsible, Rule
from bridgegen.assess.metrics.metric import Motion, motion, recorded
from bridgegen.base import elementary
from bridgegen.base.arrays import Bool, Int
from bridgegen.drivers.kinds import CAR, OTHER
from bridgegen.drivers.lane_tables import EDGES, HEADING, LANES
from bridgegen.simulation.rollout import Rollout

_CHANGED = (
    "kind",
    "type",
    "responsible",
    "rule",
    "instant",
    "decided",
    "v_ego",
    "v_other",
    "aside",
    "breach",
    "potential",
)


def with_violations(rollout: Rollout, found: Conflicts) -> Conflicts:
    """Return the conflicts of a rollout with the ego's violations.

    A departure that a near miss or contact by another's fault caused, or that leads round what
    drives or stands in the ego's lane, is none. A pass counts where there is neither a near miss
    nor a contact with that participant.
    """
    known = rollout.corridor_of >= 0 if rollout.corridors.size else np.zeros(0, np.bool_)
    if not known.any():
        return found
    from bridgegen.assess.conflict import _violation_kernels as kernels

    n, e, t = rollout.shape
    moving, rows = motion(rollout), np.flatnonzero(known)
    kinds = rollout.kinds if rollout.kinds.size else np.full(e, OTHER)
    # Only what happens up to the ego's first contact counts.
    touch = np.where(found.kind == CONTACT, found.instant, t).min(axis=1)
    leavings, begins = np.full((n, kernels.LEAVINGS), -1), np.zeros(n, dtype=np.int64)
    passings = np.full((n, e, kernels.PASSINGS), -1)
    over, beside = np.zeros((n, 1)), np.zeros((n, e, 2))
    others: Bool = np.any((found.kind >= NEAR_MISS) & ~found.at_fault, axis=1)
    while rows.size:
        kernels.find_rows(
            rows, rollout.corridors, rollout.corridor_of, moving.half, kinds, rollout.x, rollout.y,
            moving.x, moving.y, moving.cosine, moving.sine, moving.v,
            recorded(rollout, "offset"), moving.distance,
            rollout.time_step, begins, np.minimum(touch, moving.n_steps), leavings, over, passings,
            beside,
        )  # fmt: skip
        # What comes after a departure that is excused is looked at, too.
        out = leavings[rows]
        place = rollout.corridors[rollout.corridor_of[rows], out[:, kernels.SAMPLE]]
        passes = (out[:, kernels.ROAD] == 0) & np.isfinite(place[:, EDGES]).all(axis=1)
        may = (out[:, kernels.AT] >= 0) & found.ok[rows] & (passes | others[rows])
        left = rows[may].tolist()
        excused = [_is_excused(rollout, found, moving, row, leavings[row]) for row in left]
        rows = np.array(left, dtype=np.int64)[np.array(excused, dtype=np.bool_)]
        begins[rows] = leavings[rows, kernels.END]
        leavings[rows], over[rows] = -1, 0.0
    left = np.flatnonzero((leavings[:, kernels.AT] >= 0) & found.ok)
    limit = PASSED_BESIDE[passings[:, :, kernels.IN_TOWN]]
    closest = np.minimum(CLOSE + CLOSE_TIME * beside[:, :, 1], limit)
    close = (passings[:, :, kernels.MOMENT] >= 0) & found.ok[:, np.newaxis]
    close &= beside[:, :, 0] < np.where(found.kind == COURSE, closest, limit)
    close &= found.kind < NEAR_MISS
    if not left.size and not close.any():
        return found
    arrays = {name: getattr(found, name).copy() for name in _CHANGED}
    at, worst, road, side = leavings[left, :4].T
    v, off = moving.v[left, 0, worst], road == 1
    own = np.full(len(left), kinds[0])
    grip = rollout.friction[left] if rollout.friction.size else np.full(len(left), np.inf)
    grip = np.where(np.isfinite(grip), grip, 0.0)
    struck = np.sqrt(np.maximum(v * v - 2.0 * grip * CLEAR_ZONE, 0.0))
    # Severity is that of what the departure may lead to: a solid obstacle beside the road, or a car
    # that comes on the next lane.
    against = injury.severity(own, OTHER, struck, 0.0, injury.FRONT, injury.FRONT, True, False)
    head_on = injury.severity(own, CAR, 2.0 * v, 0.0, injury.FRONT, injury.FRONT)
    share = np.minimum(over[left, 0] / rollout.box[0, 1], 1.0)
    _put(
        arrays,
        (left, np.zeros_like(left)),
        instant=worst,
        decided=at,
        v_ego=v,
        breach=1.0,
        type=np.where(off, ConflictType.ROAD_DEPARTURE, ConflictType.LANE_DEPARTURE),
        rule=np.where(off, Rule.LEFT_THE_ROAD, Rule.DID_NOT_KEEP_LANE),
        aside=side * over[left, 0],
        potential=np.where(off, against, share * head_on),
    )
    i, k = np.nonzero(close)
    moment, (clearance, faster) = passings[i, k, kernels.MOMENT], beside[i, k].T
    limit, closest = limit[i, k], closest[i, k]
    front = injury.severity(kinds[0], kinds[k], faster, 0.0, injury.FRONT, injury.REAR)
    _put(
        arrays,
        (i, k),
        instant=moment,
        decided=moment,
        v_ego=moving.v[i, 0, moment],
        v_other=moving.v[i, k, moment],
        type=ConflictType.CLOSE_PASS,
        rule=Rule.PASSED_TOO_CLOSE,
        aside=clearance,
        potential=front * np.maximum(1.0 - clearance / closest, 0.0),
        breach=np.minimum((limit - clearance) / np.maximum(limit - closest, 1e-9), 1.0),
    )
    return replace(found, **arrays)


def _put(arrays: dict[str, Any], at: tuple[Int, Int], **values: Any) -> None:
    """Set the ego's violations at some rows and columns."""
    values |= {"kind": VIOLATION, "responsible": Responsible.EGO}
    for name, value in values.items():
        arrays[name][at] = value


def _is_excused(rollout: Rollout, found: Conflicts, moving: Motion, row: int, leaving: Int) -> bool:
    """Return whether a departure is another's fault, or leads round what is in the ego's lane."""
    at, _, off_road, side, sample, _ = leaving.tolist()
    dx, dy = (array[row, :, at] - array[row, 0, at] for array in (moving.x, moving.y))
    c, s = moving.cosine[row, :, at], moving.sine[row, :, at]
    left = (dy * c[0] - dx * s[0]) * side  # how far towards where the ego leaves
    recent = (at - found.instant[row]) * found.time_step
    evaded = (found.kind[row] >= NEAR_MISS) & ~found.at_fault[row]
    evaded &= (np.abs(recent) <= HORIZON) & (left < 0.0)
    if evaded.any():
        return True
    table = rollout.corridors[rollout.corridor_of[row]]
    # A first definition let a departure from the road pass as a way round what is ahead, and missed
    # 117 of 572 slides, which begin in the junction and end behind it.
    if off_road or not np.isfinite(table[sample, EDGES]).all():
        return False  # within a junction, it passes none
    slower = moving.v[row, 0, at] - moving.v[row, :, at] * (c * c[0] + s * s[0]) > PASSES
    there = (moving.distance[row, :, at] < PASSED_AHEAD) & slower
    for e in np.flatnonzero(there).tolist():
        x, y = moving.x[row, e, at], moving.y[row, e, at]
        i = int(np.argmin(elementary.hypot(table[:, 0] - x, table[:, 1] - y)))
        h = table[i, HEADING]
        its = (y - table[i, 1]) * elementary.cos(h) - (x - table[i, 0]) * elementary.sin(h)
        reach = moving.half[e, 1]
        right, left_border = -table[i, LANES][1], table[i, LANES][0]
        if i >= sample and its + reach > right and its - reach < left_border:
            return True
    return False
