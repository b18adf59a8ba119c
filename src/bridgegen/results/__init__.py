"""Where results are kept: evaluations in SQLite, records of confirmations, known failures.

Imports `engine` and below.
"""
