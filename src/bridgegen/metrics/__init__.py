"""How critical a scenario was: one file per metric, each a function of a recorded rollout.

``registry`` knows them by name. A metric is the same whichever simulator made the rollout.
"""

from bridgegen.metrics.metric import Metric
from bridgegen.metrics.registry import METRICS, evaluate, get

__all__ = ["METRICS", "Metric", "evaluate", "get"]
