"""harm: one number in [0, 1] for how much a scenario is a failure of the vehicle under test.

========================================  ==================================================
0                                         a conflict that the ego is not responsible for and
                                          could not have prevented
0 to ``COURSE`` (0.1)                     no collision course: how near they come
``COURSE`` to ``NEAR_MISS`` (0.3)         a collision course that leaves time to act
``NEAR_MISS`` to 1                        a collision, a near miss or a violation of the ego's, by
                                          severity
========================================  ==================================================

The harm of a collision course grows as its time to collision falls and as the deceleration that it
needs rises. That of a collision grows with its severity s, the probability of MAIS3+: ``NEAR_MISS +
(1 - NEAR_MISS) log(1 + s / LIGHT) / log(1 + 1 / LIGHT)``. A near miss of urgency u has the harm of
a collision of severity ``NEARLY u s``, where s is the severity that it would have had, and thus
less than that collision. ``_limits`` has the limits of a near miss and their sources.
"""

from typing import Literal

import numpy as np

from bridgegen.assess.conflict import analysis
from bridgegen.assess.conflict._limits import HORIZON, SERIOUS_DECELERATION
from bridgegen.assess.conflict.analysis import Conflicts
from bridgegen.base import elementary
from bridgegen.base.arrays import Float, Int

Count = Literal["ego", "any"]
"""Conflicts that count: those that the ego is responsible for or could prevent, or all."""

COURSE, NEAR_MISS = 0.1, 0.3
"""The least harm of a collision course, and of a near miss or collision. Critical rows have
``NEAR_MISS`` or more; whether one is a collision, `Conflicts.kind` says."""

LIGHT = 1e-4
"""Severity [1] below which collisions hardly differ. Ours: that of two cars that close at walking
pace, 1.2 m/s. From there on, each factor of ten adds about 0.175 to harm."""

# A tenth would rank a pedestrian missed at 47 km/h with two cars that close at 70 km/h.
NEARLY = 0.01
"""Severity of the most urgent near miss, as a share [1] of that of the collision that it nearly
was. Ours: a pedestrian that is nearly hit at 13 m/s ranks with two cars that collide at 7 m/s."""


VIOLATES = 0.02
"""Severity of a violation, as a share [1] of what it may lead to: above near misses of the same
speed, below the collision. Ours."""


def urgency(conflicts: Conflicts) -> Float:
    """Return how urgent each collision course is, ``(N, E)`` in [0, 1]; 0 without one."""
    ttc = np.minimum(conflicts.ttc, HORIZON)
    needed = 1.0 - elementary.exp(-conflicts.needed / SERIOUS_DECELERATION)
    return (1.0 - ttc / HORIZON) * needed


def harm_of_pairs(conflicts: Conflicts, count: Count = "ego") -> Float:
    """Return the harm of each pair, ``(N, E)`` in [0, 1]; column 0: of its departures."""
    violates = conflicts.kind == analysis.VIOLATION
    share = np.select(
        [conflicts.kind == analysis.CONTACT, violates],
        [1.0, VIOLATES],
        NEARLY * urgency(conflicts),
    )
    # Severities span five powers of ten: on a linear scale 83 % of 3,259 collisions lay within
    # 0.02, and a touch at 0.23 m/s outranked a pedestrian missed at 13 m/s.
    # Not log1p, whose bits are the system's: harm ranks what is searched.
    top = elementary.log(1.0 + 1.0 / LIGHT)
    severe = elementary.log(1.0 + share * conflicts.potential / LIGHT) / top
    worth = NEAR_MISS + (1.0 - NEAR_MISS) * severe
    value = _of_kinds(conflicts, count, contact=worth, near=worth)
    noted = COURSE + (NEAR_MISS - COURSE) * conflicts.breach
    of_violations = np.where(conflicts.breach < 1.0, noted, worth)
    return np.where(violates, np.maximum(value, of_violations), value)


def closeness_of_pairs(conflicts: Conflicts, count: Count) -> Float:
    """Return how close each pair comes to a collision, ``(N, E)`` in [0, 1], by kind.

    As harm below a near miss; near misses from ``NEAR_MISS`` to ``2 NEAR_MISS`` by urgency; and
    collisions from there on by severity. Estimators of rare events climb it.
    """
    # Not on the logarithmic scale: the estimators of risk climb this one, and their probabilities
    # were to stay as they were.
    least = 2.0 * NEAR_MISS
    return _of_kinds(
        conflicts,
        count,
        contact=least + (1.0 - least) * conflicts.severity,
        near=NEAR_MISS + (least - NEAR_MISS) * urgency(conflicts),
    )


def _of_kinds(conflicts: Conflicts, count: Count, contact: Float, near: Float) -> Float:
    """Return values by the kind of each pair, ``(N, E)``; 0 where a conflict does not count."""
    touches, nearly = (
        conflicts.kind == number for number in (analysis.CONTACT, analysis.NEAR_MISS)
    )
    value = np.select(
        [touches, nearly, (conflicts.kind != analysis.NO_CONFLICT) & np.isfinite(conflicts.ttc)],
        [contact, near, COURSE + (NEAR_MISS - COURSE) * urgency(conflicts)],
        COURSE * conflicts.nearness,
    )
    if count == "ego":
        # 0, not a little less: a search turns away from conflicts that the ego could not prevent.
        value[(touches | nearly) & ~conflicts.at_fault] = 0.0
    value[:, 0] = 0.0
    value[~conflicts.ok] = 0.0
    return value


def decisive(conflicts: Conflicts, count: Count = "ego") -> tuple[Int, Float]:
    """Return the participant of each row's decisive conflict, ``(N,)``, and the harm, ``(N,)``.

    A collision that counts is decisive; else the conflict of the largest harm; if all are below
    that of a collision course, a contact takes precedence, then a near miss. The participant is 0
    if the ego left its lane or the road, or there is no other. The harm is the row's: the largest
    of all pairs, even where a near miss before a light collision outranks it.
    """
    harm = harm_of_pairs(conflicts, count)
    happened = harm >= COURSE
    # Rows without harm are told apart by the kind of their conflict, so that each has a decisive
    # one.
    order = harm + np.where(happened, 4.0, conflicts.kind.astype(np.float64))
    order += happened & (conflicts.kind == analysis.CONTACT)
    order[conflicts.kind[:, 0] != analysis.VIOLATION, 0] = -1.0
    other = np.argmax(order, axis=1)
    return other.astype(np.int64), harm.max(axis=1)
