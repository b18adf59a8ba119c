"""The embedded simulator: a storyboard and roads are compiled once, then rolled out N times."""
