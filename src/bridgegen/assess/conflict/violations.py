"""Violations of the ego's: it leaves its lane or the road, or passes someone too closely.

Nothing needs to come near it for that. A departure has no other participant: it stands in the ego's
own column. Both need the lanes of the ego's route (`Rollout.corridors`); without them, no violation
is known.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from bridgegen.assess.conflict import _codes as codes
from bridgegen.assess.conflict.analysis import IS_SO, NUMBERS, WHOLES, Conflicts
from bridgegen.assess.metrics.metric import motion, recorded
from bridgegen.drivers.kinds import OTHER
from bridgegen.simulation.rollout import Rollout


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

    n, e, _ = rollout.shape
    moving, rows = motion(rollout), np.flatnonzero(known & found.ok)
    whole, real = np.zeros((n, e, codes.INTEGERS), np.int64), np.zeros((n, e, codes.FLOATS))
    for name, column in (WHOLES | IS_SO).items():
        whole[:, :, column] = getattr(found, name)
    for name, column in NUMBERS.items():
        real[:, :, column] = getattr(found, name)
    potential, aside, breach = (
        array.copy() for array in (found.potential, found.aside, found.breach)
    )
    any_violation = kernels.violate_rows(
        rows, rollout.corridors, rollout.corridor_of, moving.half,
        rollout.kinds if rollout.kinds.size else np.full(e, OTHER), recorded(rollout, "x"),
        recorded(rollout, "y"), moving.x, moving.y, moving.cosine, moving.sine, moving.v,
        recorded(rollout, "offset"), moving.distance,
        rollout.friction if rollout.friction.size else np.full(n, np.inf), rollout.time_step,
        moving.n_steps, whole, real, potential, aside, breach,
        np.empty(kernels.LEAVINGS, np.int64), np.empty(1), np.empty(kernels.PASSINGS, np.int64),
        np.empty(2),
    )  # fmt: skip
    if not any_violation:
        return found
    changed: dict[str, Any] = {name: whole[:, :, column] for name, column in WHOLES.items()}
    changed |= {name: real[:, :, column] for name, column in NUMBERS.items()}
    return replace(found, **changed, potential=potential, aside=aside, breach=breach)
