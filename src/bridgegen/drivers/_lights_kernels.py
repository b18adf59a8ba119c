"""Traffic lights and stop signs: where to stop, or to pass at yellow if stopping is impossible."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel
from bridgegen.drivers._following_kernels import STOP_MARGIN, stop_for

RED, RED_YELLOW, YELLOW = 1, 2, 3
"""Codes of a traffic light's states, as in `Rollout.lights`."""

YELLOW_DECELERATION = 3.0  # m/s²; a driver that needs more at yellow onset passes; source: ITE,
# Traffic Signal Timing Manual, 3.0 m/s² (10 ft/s²)
COMMITTED = 8.0  # m/s²; a driver that would need more for a red light can no longer stop
BRAKE_FROM = 1.5  # m/s²; it brakes for a light once stopping needs this much


HALTED = 0.3  # m/s, below which it has come to a halt


@kernel
def stop_at_signs(stations, s, front, v, halted):
    """Return (acceleration [m/s²] that stop signs require or +inf, where it last halted [m]).

    ``stations`` are those of their lines on the ego's route [m]; at ``halted`` and before, it has
    stopped already.
    """
    for i in range(stations.shape[0]):
        distance = stations[i] - s - front
        if stations[i] <= halted or distance < 0.0:
            continue
        if v < HALTED and distance < STOP_MARGIN + 1.0:
            return math.inf, stations[i]
        return stop_for(distance, v), halted
    return math.inf, halted


@kernel
def stop_at_lights(stations, states, s, front, v, sight, stopping):
    """Return (acceleration [m/s²] that the lights require or +inf, the one it stops for or -1).

    ``stations`` are those of the stop lines on the ego's route [m], +inf where a light is not on
    it; ``sight`` is how far a light is seen [m]; ``stopping`` is the light for which it decided
    to stop at an earlier instant, -1 if none: at yellow it decides once.
    """
    asked, chosen = math.inf, -1
    for i in range(stations.shape[0]):
        distance = stations[i] - s - front
        if not 0.0 <= distance <= sight:
            continue
        state = states[i]
        if state != RED and state != RED_YELLOW and state != YELLOW:
            continue
        needed = v * v / (2.0 * max(distance - STOP_MARGIN, 0.1))
        at_line = v * v / (2.0 * max(distance, 0.1))
        if state == YELLOW and stopping != i and at_line > YELLOW_DECELERATION:
            continue
        if at_line > COMMITTED and v > 1.0:
            continue
        chosen = i
        if needed >= BRAKE_FROM or distance < STOP_MARGIN + 0.5:
            # Close to the line gently: never harder than stopping at the line itself needs + 1.
            asked = min(asked, -min(max(needed, BRAKE_FROM), at_line + 1.0))
    return asked, chosen
