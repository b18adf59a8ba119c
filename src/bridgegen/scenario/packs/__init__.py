"""Packs of logical scenarios, a folder of YAML files each, by regulation; data only."""
