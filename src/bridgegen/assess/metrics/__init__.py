"""Criticality metrics: one file per metric, each a function of a recorded rollout.

``registry`` knows them by name. A metric is the same whichever simulator made the rollout.
"""

from bridgegen.assess.metrics.choice import existing, held_by, require, to_record
from bridgegen.assess.metrics.metric import Metric, Need, Quantity
from bridgegen.assess.metrics.registry import METRICS, TABLE_I, evaluate, get

__all__ = [
    "METRICS",
    "TABLE_I",
    "Metric",
    "Need",
    "Quantity",
    "evaluate",
    "existing",
    "get",
    "held_by",
    "require",
    "to_record",
]
