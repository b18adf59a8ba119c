"""Exposure: how often a scenario is met on the road, and with which values of its parameters."""
