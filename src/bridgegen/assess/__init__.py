"""What counts as a failure: metrics, conflicts, pass criteria, objectives and causes of a rollout.

A metric is one file of `metrics`. Imports `simulation` and below.
"""
