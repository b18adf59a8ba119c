"""A campaign: search, hand over, report; from Python `run_search` and `resume` return a `Run`."""

from bridgegen.campaign.campaign import Watch, resume, run_search
from bridgegen.campaign.run import Run

__all__ = ["Run", "Watch", "resume", "run_search"]
