"""A rollout → its conflicts: contacts, near misses, their type, responsibility, severity."""
