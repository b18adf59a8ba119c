"""Indicators and brake lights: what the storyboard switches, and what shows of it."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.base.compiled import kernel
from bridgegen.drivers.kinds import BRAKE, BRAKE_LIGHTS_FROM, HAZARD, IS_VEHICLE, SWITCHED
from bridgegen.simulation.embedded._codes import IS_LIT, LAMP, WHOM


@kernel
def begin_switch(j, k, plan, roads, state, record):
    """Begin, and end, action j, which switches lamps of an entity on or off."""
    e, lamp = plan.actions[j, WHOM], plan.actions[j, LAMP]
    state.switched[e] &= ~lamp
    if lamp & BRAKE:
        state.switched[e] |= SWITCHED
    if plan.actions[j, IS_LIT]:
        state.switched[e] |= lamp
    state.action_ended[j] = True


@kernel
def show_lamps(k, plan, state, record):
    """Set what lamps show at instant k: what is switched on, and brake lights of who brakes."""
    for e in range(state.lamps.shape[0]):
        shown = state.switched[e] & (HAZARD | BRAKE)
        brakes = k > 0 and record.a[e, k - 1] <= -BRAKE_LIGHTS_FROM
        if brakes and not state.switched[e] & SWITCHED and IS_VEHICLE[plan.kinds[e]]:
            shown |= BRAKE
        state.lamps[e] = shown
        if record.lamps.shape[0] > 0:
            record.lamps[e, k] = shown
