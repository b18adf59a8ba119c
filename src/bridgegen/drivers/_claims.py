"""Why one of two participants goes first: the reasons of a claim (`right_of_way.claim`)."""

BY_MAP, BY_SIGNS, FROM_THE_RIGHT, ONCOMING, SIREN, OFF_ROAD = 1, 2, 3, 4, 5, 6
"""The junction's priorities, signs, priority to the right, the rule that a left turn waits for
oncoming traffic, that all give way to an emergency vehicle on a call, or that who comes from off
the road gives way to all on it."""
