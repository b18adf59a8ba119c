"""Recorded traffic: readers, cleaning, lanes, events, conflicts, and scenarios made of them.

`excerpt.py` makes a rollout of recorded traffic, so that every analysis applies to it. Imports
`search` and below.
"""
