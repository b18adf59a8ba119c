"""The user's own drivers in the simulator: in Python, in lock-step; or compiled."""

from bridgegen.simulation.embedded.own_drivers.own_driver import OwnDriver
from bridgegen.simulation.embedded.own_drivers.shared_arrays import Layout, SharedArrays, seen

__all__ = ["Layout", "OwnDriver", "SharedArrays", "seen"]
