"""The preventability map: which scenarios of a grid a driver avoids, and which could be avoided."""

from bridgegen.jobs.preventability.classes import CellClass
from bridgegen.jobs.preventability.grid import GridAxis, read_axis
from bridgegen.jobs.preventability.preventability import map_preventability
from bridgegen.jobs.preventability.result import PreventabilityMap

__all__ = ["CellClass", "GridAxis", "PreventabilityMap", "map_preventability", "read_axis"]
