"""A campaign: search, hand over, report; from Python `search` and `resume` return a `Run`."""

from bridgegen.campaign.campaign import Interrupted, Watch, resume, search
from bridgegen.campaign.run import Run

__all__ = ["Interrupted", "Run", "Watch", "resume", "search"]
