"""A campaign: search, export, report; from Python `run_search` and `resume` return a `Run`."""

from bridgegen.campaign.campaign import SearchCallbacks, resume, run_search
from bridgegen.campaign.run import Run

__all__ = ["Run", "SearchCallbacks", "resume", "run_search"]
