"""The logical scenarios that ship, as YAML, and the fragments that they include; data only."""
