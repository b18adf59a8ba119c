"""Comparisons of algorithms: a grid of runs, measures of each, and statistical tests.

Nothing is imported here, so that its options load without a simulator.
"""
