"""What a vehicle's lamps tell others: indicators and brake lights, as bits of a number.

Indicators are as the storyboard says. Brake lights light by themselves, unless it has switched
them.
"""

LEFT, RIGHT, BRAKE = 1, 2, 4
"""What shows; both indicators are hazard lights, which tell of no change of lane."""

SWITCHED = 8
"""Besides ``BRAKE``: brake lights are as the storyboard has switched them."""

BLUE = 16
"""The blue lights of an emergency vehicle on a call; drivers know of them by its siren."""

HAZARD = LEFT | RIGHT

BRAKE_LIGHTS_FROM = 1.3
"""[m/s²] The deceleration from which brake lights must be lit.

Source: UN R13-H, 5.2.22: not below 0.7 m/s², always above 1.3 m/s²."""
