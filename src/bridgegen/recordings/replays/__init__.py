"""Recorded events as scenarios: `write.write_replays` is the way in."""
