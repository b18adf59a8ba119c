"""Comparisons of algorithms: a grid of runs, measures of each, and statistical tests."""

from bridgegen.comparison.comparison import ComparisonCallbacks, compare
from bridgegen.comparison.result import Comparison

__all__ = ["Comparison", "ComparisonCallbacks", "compare"]
