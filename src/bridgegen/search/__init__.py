"""How the next row is chosen, and what was found: algorithms, surrogates, triage, regions.

An algorithm is one file of `algorithms`. Imports `results` and below.
"""
