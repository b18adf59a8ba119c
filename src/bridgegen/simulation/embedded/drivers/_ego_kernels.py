"""Who moves how: the ego, by its driver or the storyboard; others with a driver; imposed states."""

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import (
    bundled,
    bundled_row,
    call_kernel_at,
    inlined_kernel,
    kernel,
    run_kernel_at,
)
from bridgegen.base.physics import CAREFUL_JERK
from bridgegen.drivers._attentive_kernels import ASKED, LOOK, look, react, see
from bridgegen.drivers._following_kernels import COMFORT_ACCELERATION
from bridgegen.drivers._gap_kernels import leads_on, led_aside
from bridgegen.drivers._path_kernels import project
from bridgegen.drivers._weather_columns import FRICTION
from bridgegen.drivers.drivers import LAWFUL, SCRIPTED
from bridgegen.drivers.kinds import IS_VEHICLE
from bridgegen.simulation.embedded._codes import (
    DOES,
    KEEP_ASIDE,
    LATERALLY,
    LONGITUDINALLY,
    SETS_SPEED,
    STEERS,
)
from bridgegen.simulation.embedded._memory_kernels import (
    N_STEPS,
    STOPS,
)
from bridgegen.simulation.embedded._motion_kernels import SAME_SPEED, STANDS, bicycle, standing
from bridgegen.simulation.embedded.chassis._chassis_columns import SPEED, H, X, Y
from bridgegen.simulation.embedded.motion import (
    ENDS,
    LANDS,
    begin_lane_change,
    is_pointless,
    move_along_path,
    pass_end,
    stop_follow,
    stop_longitudinal,
)
from bridgegen.simulation.embedded.places._place_kernels import end_lateral
from bridgegen.simulation.embedded.places._slope_kernels import slope

# --- The ego: what its driver demands, and what its tyres give ---


# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.


@inlined_kernel
def demand(k, plan, roads, state, record):
    """Return what the driver demands at instant k: acceleration [m/s²] and curvature [1/m].

    The driver is called where its machine code lies (`demands.code_of`); one in Python gives the
    same two numbers.
    """
    # By its address, so that a run compiles its own driver only: with a branch for each of them it
    # compiled six.
    if plan.driver_code == 0:
        return 0.0, 0.0
    return call_kernel_at(plan.driver_code, (k, plan, roads, state, record))


@kernel
def ego_is_through(plan, roads, state):
    """Return whether an ego with a driver is at the end of its route, or of the road."""
    p = state.on[0]
    if plan.is_driven == 0 or state.station[0] < (roads.counts[p] - 1) * roads.steps[p]:
        return False
    return (leads_on(roads.changes, p) and state.route[0] > 0) or roads.follows[p] == ENDS


@inlined_kernel
def move_ego(k, demanded, curvature, plan, roads, state, record):
    """Move the ego on from instant k; return its new x, y [m] and heading [rad]."""
    v, dt, p = record.v[0, k], plan.dt, state.on[0]
    if plan.moves_chassis:
        run_kernel_at(plan.moves_chassis, (k, demanded, curvature, plan, roads, state, record))
        x, y = state.chassis[X], state.chassis[Y]
        h, after = state.chassis[H], state.chassis[SPEED]
        given = (after - v) / dt
    else:
        uphill, aside, press = slope(0, roads, state)
        x, y, h, after, given = bicycle(
            record.x[0, k],
            record.y[0, k],
            record.h[0, k],
            v,
            demanded,
            curvature,
            plan.bodies[0, 3:7],
            press * state.weather[FRICTION],
            uphill,
            aside,
            dt,
        )
    step = 0.5 * (v + after) * dt
    record.a[0, k] = given
    state.travelled[0] += step
    state.stood[0] = standing(state.stood[0], v, after, dt)
    if k < record.x.shape[1] - 1:
        record.x[0, k + 1], record.y[0, k + 1] = x, y
        record.h[0, k + 1], record.v[0, k + 1] = h, after
        state.station[0], record.offset[0, k + 1] = project(
            roads.paths[p], roads.counts[p], roads.steps[p], state.station[0] + step, x, y
        )
        state.aside[0] = record.offset[0, k + 1]
        if roads.changes.shape[0] > 0:
            record.offset[0, k + 1] += led_aside(roads.changes, p, state.station[0])
        at_end = state.station[0] >= (roads.counts[p] - 1) * roads.steps[p]
        # On its first path with a route the end is its goal, and ends the scenario.
        if at_end and (state.route[0] == 0 or not leads_on(roads.changes, p)):
            pass_end(0, 0.0, roads, state)
    return x, y, h


# --- Control of the ego: by its driver, by the storyboard, or by one each for speed and steering --
# ``state.drives`` ``(2,)`` int64 is whether the driver steers and whether it sets the speed. The
# storyboard does the rest, as for any other entity.


# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.


@kernel
def begin_control(j, k, plan, roads, state, record):
    """Begin, and end, action j, by which the ego's driver is switched on or off.

    The storyboard takes over the ego where it is and as fast as it is, on its way's heading. What
    it asked for meanwhile was asked of the driver, and is over.
    """
    lateral, longitudinal = plan.actions[j, STEERS], plan.actions[j, SETS_SPEED]
    state.action_ended[j] = True
    if lateral >= 0 and lateral != state.drives[LATERALLY]:
        state.drives[LATERALLY] = lateral
        end_lateral(0, state)
        running = state.follow_action[0]
        if running >= 0:
            stop_follow(running, k, plan, roads, state, record)
            state.action_ended[running] = True
        p = state.on[0]
        state.aside[0] = state.turn[0] = 0.0
        if lateral == 0 and p >= 0:
            state.station[0], state.aside[0] = project(
                roads.paths[p],
                roads.counts[p],
                roads.steps[p],
                state.station[0],
                record.x[0, k],
                record.y[0, k],
            )
    if longitudinal >= 0 and longitudinal != state.drives[LONGITUDINALLY]:
        state.drives[LONGITUDINALLY] = longitudinal
        running = state.speed_action[0]
        if running >= 0:
            stop_longitudinal(running, plan, state)
            state.action_ended[running] = True
        if longitudinal == 0:
            state.command[0] = state.target[0] = record.v[0, k]


@inlined_kernel
def is_steered(plan, state):
    """Return whether the ego's driver steers it."""
    return plan.is_driven and state.drives[LATERALLY] == 1


@kernel
def move_paced(k, demanded, plan, roads, state, record):
    """Move the ego on along the storyboard's way, as fast as its driver asks for."""
    body, v = plan.bodies[0], record.v[0, k]
    # Drivers do not know the grade, as a vehicle without a map would not; what engine, brakes and
    # tyres can give changes with it.
    uphill, _, press = slope(0, roads, state)
    grip = press * state.weather[FRICTION]
    a = min(max(demanded, -min(body[5], grip) - uphill), min(body[4], grip) - uphill)
    asked, target = state.command[0], state.target[0]
    state.command[0] = min(max(v + a * plan.dt, 0.0), body[3])
    state.mean[0] = math.nan
    move_along_path(0, k, plan, roads, state, record)
    # The storyboard's speed stays what the driver is asked for; it goes at its own only for this
    # step.
    state.command[0], state.target[0] = asked, target


@inlined_kernel
def move_steered(k, demanded, curvature, plan, roads, state, record):
    """Move the ego on from instant k as its driver steers; return its new x, y [m], heading.

    If it has been teleported, it stays there for this instant, at its speed.
    """
    if state.placed[0]:
        move_paced(k, 0.0, plan, roads, state, record)
        return record.x[0, k], record.y[0, k], record.h[0, k]
    if state.drives[LONGITUDINALLY] == 0:
        demanded = (state.command[0] - record.v[0, k]) / plan.dt
    return move_ego(k, demanded, curvature, plan, roads, state, record)


# --- The state of a body by another simulator at an instant, which replaces its own motion ---


# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.


@kernel
def impose(e, k, x, y, h, v, plan, roads, state, record):
    """Put body e where it is at instant k, and take note of how it has moved since the last one.

    It stays on the path that it was on: its station and its offset are its foot's on that path.
    """
    moved_x, moved_y = x - record.x[e, k], y - record.y[e, k]
    if k > 0:
        last_x, last_y = record.x[e, k - 1], record.y[e, k - 1]
        here = elementary.hypot(record.x[e, k] - last_x, record.y[e, k] - last_y)
        state.travelled[e] += elementary.hypot(x - last_x, y - last_y) - here
        record.a[e, k - 1] = (v - record.v[e, k - 1]) / plan.dt
        stands = k
        if v <= STANDS:
            while stands > 0 and record.v[e, stands - 1] <= STANDS:
                stands -= 1
        state.stood[e] = (k - stands) * plan.dt
    before = record.h[e, k - 1] if k > 0 else record.h[e, k]
    # Another simulator's heading jumps by 2π; ours is continuous, since turn rates are differences.
    turns = round((before - h) / (2.0 * math.pi))
    record.x[e, k], record.y[e, k], record.v[e, k] = x, y, v
    record.h[e, k] = h + 2.0 * math.pi * turns
    p = state.on[e]
    if p < 0:
        state.line[e, 0] += moved_x
        state.line[e, 1] += moved_y
        return
    state.station[e], state.aside[e] = project(
        roads.paths[p], roads.counts[p], roads.steps[p], state.station[e], x, y
    )
    if e == 0:
        record.offset[e, k] = state.aside[e]
        if roads.changes.shape[0] > 0:
            record.offset[e, k] += led_aside(roads.changes, p, state.station[e])
    to = state.to[e]
    if to >= 0:
        state.foot[e], _ = project(
            roads.paths[to], roads.counts[to], roads.steps[to], state.foot[e], x, y
        )


@kernel
def impose_rows(k, bodies, imposed, plan, networks, rows, states, records):
    """Impose ``(N, B, 4)`` x, y [m], h [rad], v [m/s] of the bodies ``(B,)`` on rows that run."""
    plan = bundled(plan)
    for i in range(len(rows)):
        if states.ending[i, N_STEPS] == 0:
            roads, state = bundled_row(networks, rows[i]), bundled_row(states, i)
            record = bundled_row(records, i)
            for b in range(len(bodies)):
                x, y, h, v = imposed[i, b]
                impose(bodies[b], k, x, y, h, v, plan, roads, state, record)


@kernel
def take(e, k, driven, roads, state, record):
    """Move entity e on from instant k as its driver has in the rollout whose ego it is.

    ``driven``: its next x, y, h and v; acceleration, metres travelled, and seconds that it stood.
    """
    step = driven[5] - state.travelled[e]
    record.a[e, k], state.travelled[e], state.stood[e] = driven[4], driven[5], driven[6]
    if k == record.x.shape[1] - 1:
        return
    record.x[e, k + 1], record.y[e, k + 1] = driven[0], driven[1]
    record.h[e, k + 1], record.v[e, k + 1] = driven[2], driven[3]
    p = state.on[e]
    if p >= 0:
        path, n, ds = roads.paths[p], roads.counts[p], roads.steps[p]
        s = state.station[e] + step
        state.station[e], state.aside[e] = project(path, n, ds, s, driven[0], driven[1])
        # As of an ego: the end of its first path is its goal if it has a route.
        if state.station[e] >= (n - 1) * ds and (state.route[e] == 0 or p != e):
            pass_end(e, 0.0, roads, state)
    record.offset[e, k + 1] = state.aside[e]


@kernel
def egos_are_through(plan, networks, rows, states, through):
    """Fill ``(N,)`` bool: whether a driven ego is at the end of its route, or of the road."""
    plan = bundled(plan)
    for i in range(len(rows)):
        through[i] = ego_is_through(plan, bundled_row(networks, rows[i]), bundled_row(states, i))


# --- Participants other than the ego that have a driver, which limits their script ---
# The storyboard commands a speed, and when a change of lane begins; the driver
# (`bridgegen.drivers._attentive_kernels`) may slow them, and delay the change. All drivers decide
# by the states at instant k, before any entity moves, so the order of the entities does not
# matter.


# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.


SETTLES = 2.0  # m/s³, with which it releases the accelerator as it catches up with its script; ours


@kernel
def heed(k, plan, roads, state, record):
    """Set ``allowed``: the acceleration [m/s²] that each driver allows from instant k on."""
    every = max(round(LOOK / plan.dt), 1)
    # Every 0.2 s, which costs a quarter of a look at every instant. The reaction time and the jerk
    # count instants.
    if k % every == 0:
        see(
            k, plan.dt, record.x, record.y, record.h, record.v, plan.bodies, state.lamps, state.seen
        )
    for e in range(1, record.x.shape[0]):
        state.allowed[e] = math.inf
        if plan.others[e] == SCRIPTED:
            continue
        p, mind = state.on[e], state.minds[e]
        # Off the lanes, and on a timetable, there is nothing that a driver could follow.
        if not state.present[e] or state.placed[e] or p < 0 or state.follow[e] >= 0:
            mind[:] = 0.0
            mind[ASKED] = math.inf
            continue
        if k % every == 0:
            stop, target = math.inf, state.aside[e]
            if state.waits[e] >= 0 and roads.follows[p] == ENDS:
                stop = (roads.counts[p] - 1) * roads.steps[p]
            j = state.lateral_action[e]
            if j >= 0 and plan.actions[j, DOES] != KEEP_ASIDE:
                target = state.lateral_target[e]
            rules = 1 if IS_VEHICLE[plan.kinds[e]] else 0
            if plan.others[e] == LAWFUL:
                rules = 2 if roads.follows[p] == LANDS else 1
            mind[ASKED] = look(
                e, state.command[e], stop, state.weather[FRICTION], rules, roads.paths,
                roads.counts, roads.steps, state.station, state.on, state.aside, target,
                state.minded, state.seen, state.far, plan.bodies, plan.kinds, roads.meets[e],
                roads.meetings[e], roads.claims[e], roads.lines[e], roads.signs[e], state.lights,
                mind,
            )  # fmt: skip
        state.allowed[e] = react(k, plan.dt, mind[ASKED], mind)


@kernel
def begin_waiting(k, plan, roads, state, record):
    """Begin at instant k the changes of lane that have waited for a gap which is free now."""
    for e in range(1, record.x.shape[0]):
        j = state.waits[e]
        if j < 0 or state.ending[STOPS]:
            continue
        if plan.comes_and_goes and is_pointless(j, plan, state):
            state.action_ended[j] = True
            state.waits[e] = -1
        else:
            begin_lane_change(j, k, plan, roads, state, record)


@kernel
def move_heeding(e, before, k, plan, roads, state, record):
    """Move an entity on from instant k as its driver allows; see ``_travel_kernels``.

    ``before`` [m/s] is the command of the instant before. An entity behind its script catches up at
    a comfortable acceleration at most, and never exceeds the commanded speed. Its acceleration
    changes by `CAREFUL_JERK` at most.
    """
    most, v, body = state.allowed[e], record.v[e, k], plan.bodies[e]
    if v < before - SAME_SPEED:
        most = min(most, COMFORT_ACCELERATION, math.sqrt(2.0 * SETTLES * (before - v)))
    asked = state.command[e]
    if most < math.inf:
        change = CAREFUL_JERK * plan.dt  # it builds up and releases pedals no faster
        now = (v - record.v[e, k - 1]) / plan.dt if k > 0 else 0.0
        now = min(max(now, -body[5]), body[4])  # it may have been put here just now
        most = min(max(most, now - change), now + change)
        uphill, _, press = slope(e, roads, state)
        most = max(most, -min(body[5], press * state.weather[FRICTION]) - uphill)
        state.command[e] = min(asked, max(v + most * plan.dt, 0.0))
        if state.command[e] < asked:
            state.mean[e] = math.nan
    given = state.command[e]
    move_along_path(e, k, plan, roads, state, record)
    if state.command[e] == given:  # its road continues
        state.command[e] = asked
