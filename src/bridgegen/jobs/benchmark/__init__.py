"""A benchmark of drivers: what a search finds of each, in the scenarios that it is made for.

Nothing is imported here, so that its options load without a simulator.
"""
