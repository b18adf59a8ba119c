"""The operational design domain of an ego: when it is left, and what its driver does then.

``state.transitions`` ``(2,)`` int64 has 1 + the instant at which the domain was left, and at which
the driver demanded that a human takes over; 0: it has not.

The manoeuvre is of the simplest kind: from `PERCEPTION` after the exit the driver demands the
transition, and drives on as before. Nobody takes over. `TRANSITION` after the demand its hazard
lights are switched on, and it brakes to a standstill in the lane that it is on, where it stays; or,
if it is to, on the shoulder to its right. Its driver steers all the time, begins no lane change any
more, and brakes harder where it has to. What clears up meanwhile changes nothing.
"""

import math

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.
from bridgegen.base.compiled import kernel
from bridgegen.drivers._following_kernels import COMFORT_DECELERATION
from bridgegen.drivers._gap_kernels import leads_on
from bridgegen.drivers._path_kernels import AFTER, BEGINS, LENGTH, shift_length
from bridgegen.drivers._weather_columns import FRICTION, WEATHER
from bridgegen.drivers.drivers import DEMAND, EXIT
from bridgegen.drivers.kinds import HAZARD

PERCEPTION = 1.0  # s, until the driver knows that it has left its domain; ours
TRANSITION = 10.0  # s, as for UN R157, whose text on this (5.4.4) was not read
JERK = 1.0  # m/s³, with which the braking builds up; ours
SAME_TIME = 1e-9  # s

COLUMN, LOW, HIGH, GROUP = range(4)
"""Columns of ``Plan.limits``: of the weather, or `WEATHER` and more of the road, between what it
lies, and its group's number."""

STATION, ROAD_TYPE, LANE_MARKING, ASIDE, WIDTH = range(5)
"""Columns of ``Roads.classes``, see `bridgegen.drivers.scene.classes_along`."""

ON_SHOULDER = 2  # value of ``Plan.stops_in_lane``: it stops on the shoulder, where there is one
GENTLE = 0.5  # m/s², it brakes no less on its way to the shoulder, which it may not reach; ours
CENTRED = 0.5  # m beside its route up to which it can leave its lane for the shoulder; ours


@kernel
def is_outside(weather, road_type, lane_marking, limits):
    """Return whether weather and road keep none of the limits of some group.

    Args:
        weather: ``(WEATHER,)``, see ``_weather_columns``.
        road_type: the number of the road's class; NaN, as of ``lane_marking``: unknown, kept.
        lane_marking: 1 if there is one, else 0.
        limits: ``(K, 4)``, see `COLUMN`; those of a group follow each other.
    """
    kept = True
    for i in range(limits.shape[0]):
        if i == 0 or limits[i, GROUP] != limits[i - 1, GROUP]:
            if not kept:
                return True
            kept = False
        column = int(limits[i, COLUMN])
        value = road_type if column == WEATHER else lane_marking
        if column < WEATHER:
            value = weather[column]
        is_unknown = column >= WEATHER and math.isnan(value)
        kept = kept or is_unknown or (limits[i, LOW] <= value and value <= limits[i, HIGH])
    return not kept


@kernel
def class_at(classes, s):
    """Return the row of ``classes`` that holds at a station."""
    row = 0
    while row + 1 < classes.shape[0] and classes[row + 1, STATION] <= s:
        row += 1
    return row


@kernel
def heed_domain(k, demanded, plan, roads, state, record):
    """Note at instant k whether the domain is left; return the acceleration [m/s²] to be had.

    ``demanded`` [m/s²] is what the driver asks for without regard to it.
    """
    if state.transitions[EXIT] == 0:
        # The road counts as known along the first route alone, where the vehicle's front is.
        road_type = lane_marking = math.nan
        if leads_on(roads.changes, state.on[0]):
            front = state.station[0] + plan.bodies[0, 2] + 0.5 * plan.bodies[0, 0]
            here = class_at(roads.classes, front)
            road_type = roads.classes[here, ROAD_TYPE]
            lane_marking = roads.classes[here, LANE_MARKING]
        if is_outside(state.weather, road_type, lane_marking, plan.limits):
            state.transitions[EXIT] = k + 1
    if plan.stops_in_lane == 0 or state.transitions[EXIT] == 0:
        return demanded
    since = (k + 1 - state.transitions[EXIT]) * plan.dt
    if state.transitions[DEMAND] == 0 and since >= PERCEPTION - SAME_TIME:
        state.transitions[DEMAND] = k + 1
    lasts = stopping_for(k, plan, state)
    if lasts < 0.0:
        return demanded
    state.switched[0] |= HAZARD
    braking = min(JERK * lasts, COMFORT_DECELERATION)
    s, v = state.station[0], record.v[0, k]
    if plan.stops_in_lane == ON_SHOULDER and lasts - plan.dt < -SAME_TIME:
        choose_shoulder(s, v, record.offset[0, k], plan.bodies[0], roads, state)
    # It stands no sooner than where it is on the shoulder.
    rest = state.shoulder[BEGINS] + state.shoulder[LENGTH] - s
    if rest > 0.0:
        braking = min(braking, max(v * v / (2.0 * rest), GENTLE))
    return min(demanded, -braking)


@kernel
def choose_shoulder(s, v, offset, body, roads, state):
    """Plan how the ego gets onto the shoulder to its right, if one is there until it stands."""
    if not leads_on(roads.changes, state.on[0]) or abs(offset) > CENTRED or v <= 0.0:
        return
    first = class_at(roads.classes, s)
    aside = roads.classes[first, ASIDE]
    length = shift_length(aside, v, state.weather[FRICTION])
    stopping = v * (v / (2.0 * COMFORT_DECELERATION) + COMFORT_DECELERATION / JERK)
    last = class_at(roads.classes, s + max(length, stopping) + body[0])
    for i in range(first, last + 1):
        if roads.classes[i, WIDTH] < body[1] or roads.classes[i, ASIDE] != aside:
            return
    state.shoulder[AFTER], state.shoulder[BEGINS], state.shoulder[LENGTH] = aside, s, length


@kernel
def stopping_for(k, plan, state):
    """Return for how long [s] the manoeuvre has lasted at instant k; below 0: it has not begun."""
    if plan.stops_in_lane == 0 or state.transitions[DEMAND] == 0:
        return -1.0
    since = (k + 1 - state.transitions[DEMAND]) * plan.dt - TRANSITION
    return since if since < -SAME_TIME else max(since, 0.0)
