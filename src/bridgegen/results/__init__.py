"""Where results are kept: evaluations of a run in SQLite, and records of confirmations.

Imports `engine` and below.
"""
