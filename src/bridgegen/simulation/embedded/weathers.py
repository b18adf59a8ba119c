"""The weather of rows as a rollout went through it, from what the storyboard states and did."""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float
from bridgegen.drivers._weather_columns import WEATHER
from bridgegen.simulation.embedded._codes import (
    DOES,
    EVENT,
    EVENT_NUMBER,
    FIRST,
    KIND,
    LAST,
    ROW,
    WEATHER_CHANGE,
)
from bridgegen.simulation.embedded.program import Program
from bridgegen.simulation.rollout import Rollout


def weathers(
    program: Program, values: Mapping[str, npt.ArrayLike], rollout: Rollout, row: int
) -> list[tuple[int, Float]]:
    """Return one row's weather: from which instant on, and ``(WEATHER,)`` as sensors feel it.

    The first is the start's; then one for each event that changes it. Of an event that takes place
    more than once, the last time counts, as the rollout records it.

    Args:
        program: the compiled storyboard.
        values: ``(N,)`` float64 per parameter, as of the rollout.
        rollout: of these N rows.
        row: which of them.
    """
    from bridgegen.drivers._weather_kernels import change, set_clear  # numba is slow to import

    slots = program.fill(values, rollout.shape[0])[row]
    changes = [(0, 0)]
    for j in program.initial.tolist():
        if program.actions[j, DOES] == WEATHER_CHANGE:
            changes.append((0, int(program.actions[j, ROW])))
    for element in program.elements.tolist():
        if element[KIND] != EVENT:
            continue
        began = int(rollout.began[row, element[EVENT_NUMBER]])
        for j in range(element[FIRST], element[LAST]) if began >= 0 else ():
            if program.actions[j, DOES] == WEATHER_CHANGE:
                changes.append((began, int(program.actions[j, ROW])))
    now = np.zeros(WEATHER)
    set_clear(now)
    found: list[tuple[int, Float]] = []
    for k, environment in sorted(changes, key=lambda one: one[0]):
        change(now, program.weathers, environment, slots)
        if found and found[-1][0] == k:
            found.pop()
        found.append((k, now.copy()))
    return found
