"""Packs by regulation: folders of logical scenarios, or tables of clauses; YAML only."""
