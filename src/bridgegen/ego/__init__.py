"""Systems under test: the drivers that an ego can have, by name."""

from bridgegen.ego.drivers import DRIVERS, TRAJECTORY, Driver, get

__all__ = ["DRIVERS", "TRAJECTORY", "Driver", "get"]
