"""Control: from the planner's demand to the car's motion, with lag and limited jerk.

Pure pursuit steers (`_route_follower_kernels`). Brakes and engine answer late: a command may change
only so fast, and two equal first-order lags stand for dead time and build-up of pressure or torque
together; the steering has one. Ideal control has neither. Tyres and full lock are the bicycle's
(``simulation.embedded._motion_kernels``).
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel

COMMAND, BUILD_UP, APPLIED, BEND = 0, 1, 2, 3
"""Slots of the state: the command, between the two lags, what acts [m/s²]; curvature [1/m]."""

SIZE = 4

LAG = 0.1  # s, of each of the two; together 63 % after 0.21 s. Source: brake lag 0.1 to 0.2 s and
# build-up 0.1 to 0.2 s of cars, Breuer and Bill, Brake Technology Handbook (2008)
STEERING_LAG = 0.1  # s; electric power steering, bandwidth 1.5 to 2 Hz under closed loop
JERK = 5.0  # m/s³, in comfort; source: ISO 15622:2018 (ACC), below 5 m/s
EMERGENCY_JERK = 30.0  # m/s³; full braking within 0.3 s, as UN Regulation No. 152 (AEB) lets it
EMERGENCY_FROM = 4.0  # m/s², a demand to brake harder than ACC may (ISO 15622: 3.5 to 5)


@kernel
def actuate(state, demanded, bend, dt, ideal, lags):
    """Return (acceleration [m/s²], curvature [1/m]) that act from now on for one step.

    A vehicle with actuators of its own has the lags (``lags`` is false then).
    """
    if ideal:
        return demanded, bend
    jerk = EMERGENCY_JERK if demanded < -EMERGENCY_FROM else JERK
    state[COMMAND] += min(max(demanded - state[COMMAND], -jerk * dt), jerk * dt)
    if not lags:
        return state[COMMAND], bend
    # The exact lag over a step, so that it does not depend on the step.
    share = 1.0 - elementary.exp(-dt / LAG)
    state[BUILD_UP] += share * (state[COMMAND] - state[BUILD_UP])
    state[APPLIED] += share * (state[BUILD_UP] - state[APPLIED])
    state[BEND] += (1.0 - elementary.exp(-dt / STEERING_LAG)) * (bend - state[BEND])
    return state[APPLIED], state[BEND]
