"""The user's own drivers in the simulator: in Python, in lock-step; or compiled."""

from bridgegen.simulation.embedded.user_drivers.shared_arrays import Layout, SharedArrays, seen
from bridgegen.simulation.embedded.user_drivers.user_driver import OwnDriver

__all__ = ["Layout", "OwnDriver", "SharedArrays", "seen"]
