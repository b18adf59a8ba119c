"""Where entities may be: the lanes of a road network, the ways along them, and places on these."""
