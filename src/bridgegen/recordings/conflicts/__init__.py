"""Conflicts in recorded traffic, by the conflict analysis of a search: `find.conflicts_of`."""
