"""Does a job fail? Criteria held against what a run, or a scenario file, came to."""
