"""Other people's software, found by entry points: CARLA, planners, ScenarioRunner.

No other room imports from here. Imports `jobs` and below.
"""
