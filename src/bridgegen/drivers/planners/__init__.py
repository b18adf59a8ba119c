"""Planners of others as drivers: what an adapter declares, and the table of those installed."""
