"""Safety cases of runs: claims with evidence in Goal Structuring Notation."""
