"""Criticality metrics: one file per family, each metric a function of a recorded rollout.

``registry`` knows them by name. A metric is the same whichever simulator made the rollout.
"""

from bridgegen.assess.metrics.metric import Metric, Need, Quantity
from bridgegen.assess.metrics.registry import (
    METRICS,
    OF_BASELINE,
    TABLE_I,
    about,
    evaluate,
    existing,
    get,
    held_by,
    read,
    require,
    stand_in,
    to_record,
)

__all__ = [
    "METRICS",
    "OF_BASELINE",
    "TABLE_I",
    "Metric",
    "Need",
    "Quantity",
    "about",
    "evaluate",
    "existing",
    "get",
    "held_by",
    "read",
    "require",
    "stand_in",
    "to_record",
]
