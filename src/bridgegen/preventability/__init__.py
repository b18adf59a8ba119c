"""The preventability map: which scenarios of a grid a driver avoids, and which could be avoided."""

from bridgegen.preventability.classes import CellClass
from bridgegen.preventability.grid import GridAxis, read_axis
from bridgegen.preventability.preventability import map_preventability
from bridgegen.preventability.result import PreventabilityMap

__all__ = ["CellClass", "GridAxis", "PreventabilityMap", "map_preventability", "read_axis"]
