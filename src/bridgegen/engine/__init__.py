"""How a row becomes a result: options, runner, pipeline, counterfactual trials, replays, workers.

`runner.py` makes rollouts of rows, `pipeline.py` evaluations. Imports `assess` and below.
"""
