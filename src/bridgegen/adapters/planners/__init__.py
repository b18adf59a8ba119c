"""Planners that others wrote, as drivers: one small file each, which imports its planner late."""
