"""Repairs: the tunable numbers of a driver are set so that what a search finds is mended."""
