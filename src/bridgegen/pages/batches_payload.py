"""Data of the charts over the iterations."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from bridgegen.pages import convergence
from bridgegen.pages.data import Evaluations
from bridgegen.pages.rounding import significant

TRENDS = {"d_min": False, "v_d": True}
"""The metrics shown over iterations, and whether a larger one is worse."""

TRENDS_OF_HARM = {"harm": True, "d_min": False}
"""Likewise, where harm makes a scenario critical."""


def batches_payload(e: Evaluations, trends_of: Mapping[str, bool] = TRENDS) -> dict[str, Any]:
    """Return shares and trends, batch by batch.

    Args:
        e: all evaluations.
        trends_of: the metrics, and whether a larger one is worse.
    """
    found = convergence.batches(e)
    n = found.first.size
    trends = {}
    for column in e.metrics:
        if column.name in trends_of:
            values = np.where(e.status == 0, column.whole, np.nan)
            t = convergence.trend(values, found.group, n, larger_is_worse=trends_of[column.name])
            trends[column.name] = {
                "unit": column.unit,
                "median": significant(t.median),
                "lower": significant(t.lower),
                "upper": significant(t.upper),
                "best": significant(t.best),
            }
    return {
        "first": found.first.tolist(),
        "last": found.last.tolist(),
        "evaluations": found.evaluations.tolist(),
        "share": significant(found.share),
        "cumulative": significant(found.cumulative),
        "trends": trends,
    }
