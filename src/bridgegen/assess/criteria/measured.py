"""All quantities of a scenario by name: metrics, measures of conflicts, and margins of criteria."""

from collections.abc import Sequence

import numpy as np

from bridgegen.assess.conflict import quantities
from bridgegen.assess.criteria.monitor import LARGEST, Monitor
from bridgegen.assess.metrics import OF_BASELINE, Quantity
from bridgegen.base.arrays import Float
from bridgegen.scenario.language.criteria import PREFIX
from bridgegen.simulation.rollout import Rollout


def quantity(name: str) -> Quantity:
    """Return the quantity of a name: a metric, a measure of the conflict analysis, or a margin.

    Or one of these with the baseline's driver, ``baseline:harm`` say.

    Raises:
        UnknownNameError: no such quantity; the message suggests the nearest.
    """
    if name.startswith(PREFIX):
        text = f"margin by which criterion {name.removeprefix(PREFIX)} is met; violated below 0"
        return Quantity(
            name,
            "1",
            text,
            "smaller",
            LARGEST,
        )
    if name.startswith(OF_BASELINE):
        item = quantity(name.removeprefix(OF_BASELINE))
        text = f"{item.name} with the baseline's driver"
        return Quantity(name, item.unit, text, item.sense, item.cap)
    return quantities.get(name)


def evaluate(rollout: Rollout, names: Sequence[str], monitor: Monitor | None = None) -> Float:
    """Return the named quantities of every scenario.

    Args:
        rollout: of N scenarios.
        names: of metrics, measures and margins; see ``quantity``.
        monitor: the criteria of the scenario, where margins are among them.

    Returns:
        ``(N, M)`` float64, as `bridgegen.assess.conflict.quantities.evaluate` and
        ``Monitor.margins``.

    Raises:
        UnknownNameError: a name is not a quantity's.
    """
    margins = {item: j for j, item in enumerate(monitor.names)} if monitor else {}
    others = [name for name in names if name not in margins]
    if len(others) == len(names):
        return quantities.evaluate(rollout, names)
    out = np.empty((rollout.shape[0], len(names)))
    at = [j for j, name in enumerate(names) if name not in margins]
    out[:, at] = quantities.evaluate(rollout, others)
    assert monitor is not None
    found = monitor.margins(rollout)
    for j, name in enumerate(names):
        if name in margins:
            out[:, j] = found[:, margins[name]]
    return out
