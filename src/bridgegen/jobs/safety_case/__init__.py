"""Safety cases of runs: claims with evidence in Goal Structuring Notation."""

from bridgegen.jobs.safety_case.export import Exported, export_safety_case
from bridgegen.jobs.safety_case.model import SafetyCase

__all__ = ["Exported", "SafetyCase", "export_safety_case"]
