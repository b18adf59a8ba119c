"""Other people's software, found by entry points: the simulator CARLA, and planners.

No other room imports from here, so what is added here is one folder and one line of
pyproject.toml. Imports `engine` and below.
"""
