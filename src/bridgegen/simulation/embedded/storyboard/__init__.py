"""Stories, acts, maneuvers, events and actions: their start, execution and end."""

from bridgegen.simulation.embedded.storyboard._start_kernels import start
from bridgegen.simulation.embedded.storyboard._storyboard_kernels import decide, finish

__all__ = ["decide", "finish", "start"]
