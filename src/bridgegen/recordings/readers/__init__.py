"""Recorded traffic: files of many formats become one table of trajectories, cleaned."""
