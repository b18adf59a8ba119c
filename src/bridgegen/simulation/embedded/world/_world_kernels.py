"""What concerns all: weather, time of day, parameters and variables, and traffic lights."""

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

# --- Traffic lights: the phases that controllers take them through, again and again ---


# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.


FIRST, LAST, DELAY, REFERENCE = range(4)  # columns of Plan.controllers
DURATION, CHANGE, CHANGE_END = range(3)  # columns of Plan.phases
SAME_TIME = 1e-9  # s


@kernel
def start_controllers(controllers, phases, changes, slots, phase_now, phase_until, lights):
    """Put every controller into the phase that it is in at the start.

    A delay to another controller shifts its cycle: its first phase begins virtually so much later
    than the other one's.
    """
    for c in range(controllers.shape[0]):
        first, last = controllers[c, FIRST], controllers[c, LAST]
        late, other = slots[controllers[c, DELAY]], controllers[c, REFERENCE]
        for _ in range(controllers.shape[0]):  # delays add up along references
            if other < 0:
                break
            late += slots[controllers[other, DELAY]]
            other = controllers[other, REFERENCE]
        cycle = 0.0
        for i in range(first, last):
            cycle += max(slots[phases[i, DURATION]], 0.0)
        passed = 0.0
        if cycle > 0.0:
            passed = -late - cycle * (-late // cycle)
        phase_now[c] = -1
        for i in range(first, last):
            lasts = max(slots[phases[i, DURATION]], 0.0)
            if passed < lasts or i == last - 1:
                enter_phase(c, i, lasts - passed, phases, changes, phase_now, phase_until, lights)
                break
            passed -= lasts


@kernel
def enter_phase(c, i, until, phases, changes, phase_now, phase_until, lights):
    """Put controller c into phase i, until a time [s]."""
    phase_now[c], phase_until[c] = i, until
    for j in range(phases[i, CHANGE], phases[i, CHANGE_END]):
        lights[changes[j, 0]] = changes[j, 1]


@kernel
def run_controllers(now, controllers, phases, changes, slots, phase_now, phase_until, lights):
    """Take every controller to its next phase where the present one is over."""
    for c in range(controllers.shape[0]):
        first, last = controllers[c, FIRST], controllers[c, LAST]
        # Phases may last 0 s, and a step may be longer than a phase; a whole cycle of phases
        # without a duration ends the loop.
        for _ in range(last - first):
            i = phase_now[c]
            if i < 0 or now < phase_until[c] - SAME_TIME:
                break
            i = first if i + 1 == last else i + 1
            # From when the last phase was over, not from now: else each cycle would be later by a
            # part of a step.
            until = phase_until[c] + max(slots[phases[i, DURATION]], 0.0)
            enter_phase(c, i, until, phases, changes, phase_now, phase_until, lights)


# --- Actions that concern all: weather, time of day, lights, parameters and variables ---


# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.


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
            which,
            phase,
            until,
            plan.phases,
            plan.changes,
            state.phase_now,
            state.phase_until,
            state.lights,
        )
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
