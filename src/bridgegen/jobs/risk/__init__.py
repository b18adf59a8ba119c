"""How likely harm is: probabilities of rare events with intervals, and rates.

`risk` goes from an exposure and a driver to a `result.Risk`: an `Experiment` of the pipeline's
rows, and a method of `estimators`, which know points of normal space and scores alone. Nothing is
imported here, so that these load without a simulator.
"""
