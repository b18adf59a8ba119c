"""Where recorded traffic is on lanes: `find.locate` is the way in."""
