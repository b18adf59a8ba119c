"""Comparisons of algorithms: a grid of runs, measures of each, and statistical tests."""

from bridgegen.comparison.comparison import Watch, compare
from bridgegen.comparison.result import Comparison

__all__ = ["Comparison", "Watch", "compare"]
