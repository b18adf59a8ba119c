"""Comparisons of algorithms: a grid of runs, what is measured of them, and how sure that is."""

from bridgegen.comparison.comparison import ComparisonCallbacks, compare
from bridgegen.comparison.result import Comparison

__all__ = ["Comparison", "ComparisonCallbacks", "compare"]
