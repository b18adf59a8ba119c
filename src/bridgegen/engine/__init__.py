"""How a row becomes a result: options, pipeline, counterfactual trials, replays, and the workers.

Start with `pipeline.py`. Imports `assess` and below.
"""
