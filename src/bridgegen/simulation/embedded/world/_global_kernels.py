"""Actions that concern all: weather, time of day, lights, parameters and variables."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import numpy as np

from bridgegen.base.compiled import kernel
from bridgegen.drivers._weather_kernels import change
from bridgegen.simulation.embedded._codes import (
    DOES,
    LIGHT,
    PASSES,
    PHASE_CHANGE,
    ROW,
    TARGET,
    TIME_CHANGE,
    VALUE_ADD,
    VALUE_MULTIPLY,
    VALUE_SET,
    WEATHER_CHANGE,
    WHOM,
)
from bridgegen.simulation.embedded.world._signal_kernels import DURATION, enter_phase


@kernel
def begin_global(j, k, plan, state):
    """Begin action j, which is over at once."""
    which, kind = plan.actions[j, WHOM], plan.actions[j, DOES]
    value = state.slots[plan.actions[j, TARGET]]
    if kind == WEATHER_CHANGE:
        change(state.weather, plan.weathers, plan.actions[j, ROW], state.slots)
    elif kind == TIME_CHANGE:
        set_clock(value, plan.actions[j, PASSES], k * plan.dt, state.clock)
    elif kind == LIGHT:
        state.lights[which] = np.int8(value)
    elif kind == PHASE_CHANGE:
        phase = plan.actions[j, ROW]
        until = k * plan.dt + max(state.slots[plan.phases[phase, DURATION]], 0.0)
        enter_phase(
            which, phase, until, plan.phases, plan.changes, state.phase_now, state.phase_until,
            state.lights,
        )  # fmt: skip
    elif kind == VALUE_SET:
        state.values[which] = value
    elif kind == VALUE_ADD:
        state.values[which] += value
    elif kind == VALUE_MULTIPLY:
        state.values[which] *= value
    state.action_ended[j] = True


@kernel
def set_clock(seconds, passes, now, clock):
    """Set the time of day to a date [s], from which it passes or not."""
    clock[0], clock[1], clock[2] = seconds, 1.0 if passes else 0.0, now


@kernel
def time_of_day(now, clock):
    """Return the date now [s]; NaN where no environment states one."""
    return clock[0] + clock[1] * (now - clock[2])
