"""Vehicles with dynamics: what the ego's body is instead of a kinematic bicycle, by option."""
