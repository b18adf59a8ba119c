"""All metrics by name. A new one: its own file with a ``METRIC``, and one entry here.

Or a package's: an entry point of the group ``bridgegen.assess.metrics``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from bridgegen.assess.metrics import (
    a_change,
    btn,
    d_min,
    drac,
    e_position,
    impact_speed,
    iou,
    l_offset,
    mean_average_precision,
    n_brake,
    n_collision,
    pet,
    r_red,
    relative_impact_speed,
    rss,
    speed_reduction,
    tet,
    thw,
    tit,
    ttc,
    v_d,
)
from bridgegen.assess.metrics.metric import Metric
from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.base.plugins import PlugIns, Registry
from bridgegen.simulation.rollout import Rollout

_TABLE_I = (
    r_red, n_collision, ttc, d_min, v_d, l_offset, iou, e_position, mean_average_precision,
    a_change, n_brake,
)  # fmt: skip

_BEYOND = (
    pet, drac, btn, thw, tet, tit, rss, impact_speed, relative_impact_speed, speed_reduction,
)  # fmt: skip

_OURS: dict[str, Metric] = {module.METRIC.name: module.METRIC for module in (*_TABLE_I, *_BEYOND)}

ADDED = PlugIns("metric", "bridgegen.metrics")


def _checked(found: object, name: str) -> Metric:
    """Return a package's metric, with checks of its results.

    Raises:
        InputError: it is not a metric of that name.
    """
    if not isinstance(found, Metric):
        raise InputError(
            f"{ADDED.place(name)} must be a bridgegen.assess.metrics.Metric, got "
            f"{type(found).__name__}"
        )
    if found.name != name:
        raise InputError(
            f"{ADDED.place(name)} has the name '{found.name}'; the two names must agree"
        )

    def compute(rollout: Rollout) -> Float:
        try:
            values = np.asarray(found.compute(rollout), dtype=np.float64)
        except Exception as error:
            raise InputError(
                f"{ADDED.place(name)} fails: {type(error).__name__}: {error}"
            ) from error
        n, failed = rollout.shape[0], np.asarray(rollout.status) != 0
        if values.shape != (n,):
            raise InputError(
                f"{ADDED.place(name)} must return {n} numbers, one for each scenario, got an array "
                f"of the shape {values.shape}"
            )
        if bad := np.flatnonzero(np.isnan(values) != failed).size:
            raise InputError(
                f"{ADDED.place(name)} must be NaN exactly where a scenario failed; it is otherwise "
                f"in {bad} of {n}"
            )
        return values

    return replace(found, compute=compute)


METRICS: Mapping[str, Metric] = Registry(_OURS, ADDED, _checked)
"""In the order of Table I, then ours beyond it, then those of installed packages."""

TABLE_I = tuple(module.METRIC.name for module in _TABLE_I)
"""The names of the paper's eleven, which every run records as far as its rollouts allow."""


def get(name: str) -> Metric:
    """Return the metric of that name.

    Raises:
        UnknownNameError: there is none; the message suggests the nearest.
        InputError: an installed package's that cannot be loaded.
    """
    if name not in METRICS:
        raise UnknownNameError("metric", name, METRICS)
    return METRICS[name]


def evaluate(rollout: Rollout, names: Sequence[str]) -> Float:
    """Return the named metrics of every scenario.

    Returns:
        ``(N, M)`` float64, a column per name, in the metric's unit; NaN throughout a row exactly
        where the scenario failed (the reason is in ``rollout.status``).

    Raises:
        UnknownNameError: a name is not a metric's.
        ValueError: the rollout does not hold what a metric needs, or what it holds is malformed.
    """
    metrics = [get(name) for name in names]
    out = np.empty((rollout.shape[0], len(metrics)))
    for j, metric in enumerate(metrics):
        out[:, j] = metric.compute(rollout)
    return out
