"""Estimators of the probability of rare events, one file each."""
