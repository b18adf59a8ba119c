"""Traffic lights: the phases that controllers take them through, again and again."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.base.compiled import kernel

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
        for _ in range(last - first):
            i = phase_now[c]
            if i < 0 or now < phase_until[c] - SAME_TIME:
                break
            i = first if i + 1 == last else i + 1
            until = phase_until[c] + max(slots[phases[i, DURATION]], 0.0)
            enter_phase(c, i, until, phases, changes, phase_now, phase_until, lights)
