"""Events and near misses in recorded traffic: what was found, its tables and its page."""
