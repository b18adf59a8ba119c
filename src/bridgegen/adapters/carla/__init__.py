"""CARLA, reached over the network: its bodies, its light and its weather round our storyboard."""
