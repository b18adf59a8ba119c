"""The preventability map: which scenarios of a grid a driver avoids, and which could be avoided.

Nothing is imported here, so that its options load without a simulator.
"""
