"""Recorded traffic: readers, cleaning, lanes, events, conflicts, and scenarios made of them.

A format is one file of `readers`. Imports `search` and below.
"""
