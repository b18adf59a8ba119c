"""All quantities of a scenario by name: metrics, and measures of the conflict analysis."""

from collections import ChainMap
from collections.abc import Collection, Mapping, Sequence
from typing import cast

import numpy as np

from bridgegen.assess import metrics as measures
from bridgegen.assess.conflict._limits import HORIZON
from bridgegen.assess.conflict.analysis import COURSE, analyse
from bridgegen.assess.conflict.harm import decisive
from bridgegen.assess.metrics import METRICS, Need, Quantity
from bridgegen.base.arrays import Float
from bridgegen.base.errors import UnknownNameError
from bridgegen.simulation.rollout import Rollout

HARM, HARM_ANY = "harm", "harm_any"

_MEASURED = (
    Quantity(
        HARM,
        "1",
        "how much the scenario is a failure of the ego, 0 to 1; critical from 0.3 on",
        "larger",
        0.0,
    ),
    Quantity(
        HARM_ANY,
        "1",
        "as harm, whoever is responsible",
        "larger",
        0.0,
    ),
    Quantity(
        "severity", "1", "probability of a MAIS3+ injury in the ego's collision", "larger", 0.0
    ),
    Quantity("delta_v", "m/s", "change of the ego's velocity in its collision", "larger", 0.0),
    Quantity(
        "course_ttc", "s", "least time to collision on a collision course", "smaller", HORIZON
    ),
    Quantity("course_braking", "m/s²", "deceleration that the ego needed then", "larger", 0.0),
)

MEASURED = tuple(quantity.name for quantity in _MEASURED)
"""The names of the conflict analysis's measures; a search records them all."""

_BY_NAME: dict[str, Quantity] = {quantity.name: quantity for quantity in _MEASURED}

QUANTITIES: Mapping[str, Quantity] = ChainMap(_BY_NAME, cast(dict[str, Quantity], METRICS))
"""The metrics, then the measures of the conflict analysis."""


def get(name: str) -> Quantity:
    """Return the quantity of that name.

    Raises:
        UnknownNameError: there is none; the message suggests the nearest.
    """
    if name not in QUANTITIES:
        raise UnknownNameError("metric", name, QUANTITIES)
    return QUANTITIES[name]


def require(names: Sequence[str], held: Collection[Need], source: str) -> tuple[str, ...]:
    """Return the names, all of which must exist where rollouts hold ``held``.

    See `bridgegen.assess.metrics.require`.
    """
    for name in names:
        get(name)
    measures.require([name for name in names if name not in _BY_NAME], held, source)
    return tuple(names)


def evaluate(rollout: Rollout, names: Sequence[str]) -> Float:
    """Return the named quantities of every scenario.

    Returns:
        ``(N, M)`` float64, a column per name, in the quantity's unit; NaN throughout a row exactly
        where the scenario failed. ``severity`` and ``delta_v`` are 0 without a contact;
        ``course_ttc`` is +inf and ``course_braking`` 0 without a collision course.

    Raises:
        UnknownNameError: a name is not a quantity's.
        ValueError: the rollout does not hold what a quantity needs, or what it holds is malformed.
    """
    metrics = [name for name in names if name not in _BY_NAME]
    out = np.empty((rollout.shape[0], len(names)))
    at = [j for j, name in enumerate(names) if name not in _BY_NAME]
    out[:, at] = measures.evaluate(rollout, metrics)
    if len(metrics) < len(names):
        measured = _measured(rollout)
        for j, name in enumerate(names):
            if name in _BY_NAME:
                out[:, j] = measured[name]
    return out


def _measured(rollout: Rollout) -> dict[str, Float]:
    conflicts = analyse(rollout)
    rows = np.arange(rollout.shape[0])
    other, harm = decisive(conflicts)
    _, harm_any = decisive(conflicts, "any")
    on_course = (conflicts.kind[rows, other] >= COURSE) & np.isfinite(conflicts.ttc[rows, other])
    found = {
        HARM: harm,
        HARM_ANY: harm_any,
        "severity": conflicts.severity[rows, other],
        "delta_v": conflicts.delta_v_ego[rows, other],
        "course_ttc": np.where(on_course, conflicts.ttc[rows, other], np.inf),
        "course_braking": np.where(on_course, conflicts.needed[rows, other], 0.0),
    }
    for values in found.values():
        values[~conflicts.ok] = np.nan
    return found
