"""All quantities of a scenario by name: metrics, measures of conflicts, and margins of criteria."""

from collections.abc import Sequence

import numpy as np

from bridgegen.arrays import Float
from bridgegen.conflict import quantities
from bridgegen.criteria.monitor import LARGEST, Monitor
from bridgegen.metrics import Quantity
from bridgegen.odd.criteria import PREFIX
from bridgegen.simulation.rollout import Rollout


def quantity(name: str) -> Quantity:
    """Return the quantity of a name: a metric, a measure of the conflict analysis, or a margin.

    Raises:
        UnknownNameError: no such quantity; the message suggests the nearest.
    """
    if name.startswith(PREFIX):
        one = name.removeprefix(PREFIX)
        return Quantity(
            name, "1", f"margin by which criterion {one} is met; violated below 0", "smaller",
            LARGEST,
        )  # fmt: skip
    return quantities.get(name)


def evaluate(rollout: Rollout, names: Sequence[str], monitor: Monitor | None = None) -> Float:
    """Return the named quantities of every scenario.

    Args:
        rollout: of N scenarios.
        names: of metrics, measures and margins; see ``quantity``.
        monitor: the criteria of the scenario, where margins are among them.

    Returns:
        ``(N, M)`` float64, as `bridgegen.conflict.quantities.evaluate` and ``Monitor.margins``.

    Raises:
        UnknownNameError: a name is not a quantity's.
    """
    margins = {one: j for j, one in enumerate(monitor.names)} if monitor else {}
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
