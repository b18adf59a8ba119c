"""All metrics by name. A new one: its own file with a ``METRIC``, and one entry here."""

from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np

from bridgegen.arrays import Float
from bridgegen.errors import UnknownNameError
from bridgegen.metrics import (
    a_change,
    btn,
    d_min,
    drac,
    e_position,
    iou,
    l_offset,
    mean_average_precision,
    n_brake,
    n_collision,
    pet,
    r_red,
    rss,
    tet,
    thw,
    tit,
    ttc,
    v_d,
)
from bridgegen.metrics.metric import Metric
from bridgegen.simulation.rollout import Rollout

_TABLE_I = (
    r_red, n_collision, ttc, d_min, v_d, l_offset, iou, e_position, mean_average_precision,
    a_change, n_brake,
)  # fmt: skip

_BEYOND = (pet, drac, btn, thw, tet, tit, rss)

METRICS: Mapping[str, Metric] = MappingProxyType(
    {module.METRIC.name: module.METRIC for module in (*_TABLE_I, *_BEYOND)}
)
"""In the order of Table I, then those beyond it."""

TABLE_I = tuple(module.METRIC.name for module in _TABLE_I)
"""The names of the paper's eleven, which every run records as far as its rollouts hold them."""


def get(name: str) -> Metric:
    """Return the metric of that name.

    Raises:
        UnknownNameError: there is none; the message suggests the nearest.
    """
    if name not in METRICS:
        raise UnknownNameError("metric", name, METRICS)
    return METRICS[name]


def evaluate(rollout: Rollout, names: Sequence[str]) -> Float:
    """Return the named metrics of every scenario.

    Returns:
        ``(N, M)`` float64, a column per name, in the metric's unit; NaN throughout a row exactly
        where the scenario failed (``rollout.status`` says why).

    Raises:
        UnknownNameError: a name is not a metric's.
        ValueError: the rollout does not hold what a metric needs, or what it holds is malformed.
    """
    metrics = [get(name) for name in names]
    out = np.empty((rollout.shape[0], len(metrics)))
    for j, metric in enumerate(metrics):
        out[:, j] = metric.compute(rollout)
    return out
