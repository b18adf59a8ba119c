"""Pass/fail criteria for the results of a run, a confirmation or a scenario file."""
