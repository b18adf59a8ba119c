"""harm: one number in [0, 1] for how much a scenario is a failure of the vehicle under test.

========================================  ==================================================
0                                         a conflict that the ego is not responsible for and
                                          could not have prevented
0 to ``COURSE`` (0.1)                     no collision course: how near they come
``COURSE`` to ``NEAR_MISS`` (0.3)         a collision course that leaves time to act
``NEAR_MISS`` to ``COLLISION`` (0.6)      a near miss of the ego's
``COLLISION`` to 1                        a collision of the ego's, by severity
========================================  ==================================================

The harm of a collision course, and of a near miss, grows as its time to collision falls and as the
deceleration that it needs rises; that of a collision grows with its severity alone. No speed enters
by itself. ``_limits`` has the limits of a near miss and their sources.
"""

from typing import Literal

import numpy as np

from bridgegen.arrays import Float, Int
from bridgegen.conflict import analysis
from bridgegen.conflict._limits import HORIZON, SERIOUS_DECELERATION
from bridgegen.conflict.analysis import Conflicts

Count = Literal["ego", "any"]
"""Which conflicts count: those that the ego is responsible for or could prevent, or all."""

COURSE, NEAR_MISS, COLLISION = 0.1, 0.3, 0.6
"""The least harm of each; see the table above. Critical rows have ``NEAR_MISS`` or more."""


def harm_of_pairs(conflicts: Conflicts, count: Count = "ego") -> Float:
    """Return the harm of each pair, ``(N, E)`` in [0, 1]; 0 in the ego's own column."""
    contact, near = conflicts.kind == analysis.CONTACT, conflicts.kind == analysis.NEAR_MISS
    ttc = np.minimum(conflicts.ttc, HORIZON)
    closeness = (1.0 - ttc / HORIZON) * (1.0 - np.exp(-conflicts.needed / SERIOUS_DECELERATION))
    harm = np.select(
        [contact, near, conflicts.kind == analysis.COURSE],
        [
            COLLISION + (1.0 - COLLISION) * conflicts.severity,
            NEAR_MISS + (COLLISION - NEAR_MISS) * closeness,
            COURSE + (NEAR_MISS - COURSE) * closeness,
        ],
        COURSE * conflicts.nearness,
    )
    if count == "ego":
        harm[(contact | near) & ~conflicts.at_fault] = 0.0
    harm[:, 0] = 0.0
    harm[~conflicts.ok] = 0.0
    return harm


def decisive(conflicts: Conflicts, count: Count = "ego") -> tuple[Int, Float]:
    """Return the participant of each row's decisive conflict, ``(N,)``, and its harm, ``(N,)``.

    The conflict of the largest harm is decisive; if all are below that of a collision course, a
    contact takes precedence, then a near miss. The participant is 0 if there is no other.
    """
    harm = harm_of_pairs(conflicts, count)
    happened = harm >= COURSE
    order = harm + np.where(happened, 4.0, conflicts.kind.astype(np.float64))
    order[:, 0] = -1.0
    other = np.argmax(order, axis=1)
    return other.astype(np.int64), harm.max(axis=1)
