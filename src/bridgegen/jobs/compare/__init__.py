"""Comparisons of algorithms: a grid of runs, measures of each, and statistical tests."""

from bridgegen.jobs.compare.comparison import ComparisonCallbacks, compare
from bridgegen.jobs.compare.result import Comparison

__all__ = ["Comparison", "ComparisonCallbacks", "compare"]
