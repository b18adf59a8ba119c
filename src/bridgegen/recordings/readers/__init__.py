"""Recorded traffic: files of many formats become one table of trajectories, cleaned.

A format is one file with a `Format`, listed in `formats.py`; a writer in
`tests/recordings/writers.py` has it tested.
"""
