"""Pass criteria applied to rollouts: signals, margins, and what of them a search records."""

from bridgegen.assess.criteria.measured import evaluate, quantity
from bridgegen.assess.criteria.monitor import CriterionResult, Monitor, margin_in_words, unit_of
from bridgegen.assess.criteria.signals import SIGNALS, Signal
from bridgegen.assess.criteria.summary import (
    CriterionSummary,
    by_gravity,
    headline,
    summarise_criteria,
)

__all__ = [
    "SIGNALS",
    "CriterionResult",
    "CriterionSummary",
    "Monitor",
    "Signal",
    "by_gravity",
    "evaluate",
    "headline",
    "margin_in_words",
    "quantity",
    "summarise_criteria",
    "unit_of",
]
