"""Pass criteria applied to rollouts: signals, margins, and what of them a search records."""

from bridgegen.criteria.measured import evaluate, quantity
from bridgegen.criteria.monitor import CriterionResult, Monitor, unit_of
from bridgegen.criteria.signals import SIGNALS, Signal

__all__ = ["SIGNALS", "CriterionResult", "Monitor", "Signal", "evaluate", "quantity", "unit_of"]
