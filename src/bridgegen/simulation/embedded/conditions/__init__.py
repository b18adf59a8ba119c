"""Triggers: what their conditions look at, and which of them hold at an instant."""

from bridgegen.simulation.embedded.conditions._relation_kernels import look_closely
from bridgegen.simulation.embedded.conditions._trigger_kernels import fires, observe, select

__all__ = ["fires", "look_closely", "observe", "select"]
