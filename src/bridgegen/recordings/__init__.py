"""Recorded traffic: readers, cleaning, lanes, events, conflicts, and scenarios made of them.

`excerpt.py` makes a rollout of recorded traffic, so that every analysis applies to it. Imports
`search` and below.
"""

TIME_STEP = 0.05
"""Default time step to which recordings are resampled [s]."""
