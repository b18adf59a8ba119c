"""How likely harm is: probabilities of rare events with intervals, and rates.

`risk` goes from an exposure and a driver to a `Risk`: an `Experiment` of the pipeline's rows, and a
method of `estimators`, which know points of normal space and scores alone.
"""

from bridgegen.jobs.risk.result import Finding, Risk
from bridgegen.jobs.risk.risk import RiskCallbacks, estimate_risk

__all__ = ["Finding", "Risk", "RiskCallbacks", "estimate_risk"]
