"""A benchmark of drivers: what a search finds of each, in the scenarios that it is made for."""

from bridgegen.jobs.benchmark.benchmark import Benchmark, BenchmarkCallbacks, benchmark_planners

__all__ = ["Benchmark", "BenchmarkCallbacks", "benchmark_planners"]
