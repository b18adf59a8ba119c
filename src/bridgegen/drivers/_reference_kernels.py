"""The reference ego: sensors → tracks → prediction → planning → control.

Each stage is a kernel file of its own; this one joins them. The planner sees tracks only, and plans
ten times a second; control acts at every instant. The driver's state between two instants is
``mind`` ``(MIND,)``, zeros before the first.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers import _control_kernels as control
from bridgegen.drivers._caution_kernels import careful_speed
from bridgegen.drivers._emergency_kernels import must_brake
from bridgegen.drivers._following_kernels import (
    COMFORT_ACCELERATION,
    COMFORT_DECELERATION,
    keep_distance,
)
from bridgegen.drivers._gap_kernels import (
    await_gap,
    is_other_lanes,
    leads_on,
    without_joining,
)
from bridgegen.drivers._ghost_kernels import haunt
from bridgegen.drivers._lane_change_kernels import BEFORE, LAST, change_lane, look_back, shift_of
from bridgegen.drivers._lights_kernels import stop_at_lights, stop_at_signs
from bridgegen.drivers._odd_kernels import stopping_for
from bridgegen.drivers._path_kernels import LENGTH as SHOULDER_LENGTH
from bridgegen.drivers._path_kernels import UNSHIFTED, pursue_beside, shift_speed
from bridgegen.drivers._perception_kernels import perceive
from bridgegen.drivers._prediction_kernels import predict, predict_truly
from bridgegen.drivers._route_follower_kernels import hold_speed, keep_to_route, preview
from bridgegen.drivers._sight_kernels import LIGHT, REAR, WALKER, column_of, seen_in
from bridgegen.drivers._speed_kernels import (
    FAST_ROAD,
    LIMIT,
    bend_speed,
    limit_speed,
    scan_length,
    sight_speed,
)
from bridgegen.drivers._surroundings_kernels import BEHIND, NEAR, surround
from bridgegen.drivers._tracking_kernels import settings
from bridgegen.drivers._weather_columns import FRICTION
from bridgegen.drivers._yielding_kernels import yield_to_all

PLANNED, NEXT_PLAN, STOPS_FOR = control.SIZE, control.SIZE + 1, control.SIZE + 2
"""Planned acceleration [m/s²], time of the next plan [s], 1 + the light that it stops for."""

HALTED = LAST
"""Station of the stop sign at which it halted last [m]."""

MIND = LAST + 4

# As often as the sensors take a frame; control acts at every instant.
CYCLE = 0.1  # s, between two plans
PLANNING_REACH = 30.0  # m, how far it looks at least …
PLANNING_TIME = 6.0  # s, … and how far in time, at the present speed


@kernel
def reach_of(v):
    """Return how far ahead on its route [m] the planner considers other participants."""
    return max(PLANNING_REACH + PLANNING_TIME * v, scan_length(v))


@kernel
def plan(path, bends, road, drops, n, road_n, ds, s, v, body, target, friction_limit, seen,
         light_seen, in_town, around, tracks, passages, n_passages, crosswalks, stop_stations,
         halts, lights, elapsed, keeps_lane, waits, mind):  # fmt: skip
    """Return the acceleration [m/s²] that the planner wants.

    Args:
        path: the ego's route, ``(n, 6)``.
        bends: ``(n,)``, see `bend_speed`.
        road: the road along it, ``(n, ROAD)``, see `bridgegen.drivers.scene.road_along`.
        drops: ``(n,)``, see `limit_speed`.
        n: its samples.
        road_n: those of ``road``; 0 where the map has no data along this route.
        ds: between two of them [m].
        s: the ego's station on it [m].
        v: its speed [m/s].
        body: its row of bodies.
        target: the speed that the storyboard asks for [m/s].
        friction_limit: [m/s²].
        seen: how far it sees a pedestrian or vehicle [m].
        light_seen: how far it sees a light [m].
        in_town: whether people may walk here.
        around: the other participants, relative to the route.
        tracks: the other participants, in the world.
        passages: their predicted passages.
        n_passages: how many passages there are.
        crosswalks: that the route leads over.
        stop_stations: of the stop lines of lights, +inf where not on the route [m].
        halts: stations of the lines of stop signs [m].
        lights: their states.
        elapsed: since the last plan [s].
        keeps_lane: whether it changes lanes no more.
        waits: the acceleration that waiting for a gap asks for [m/s²]; NaN where the route changes
            no lanes. Where it does, nobody is passed.
        mind: see above.
    """
    front, rear, half_width = body[2] + 0.5 * body[0], 0.5 * body[0] - body[2], 0.5 * body[1]
    speed = bend_speed(path, bends, n, ds, s, v, target, friction_limit)
    speed = min(speed, sight_speed(seen, friction_limit))
    # Lights, limits and ways of others are known along the first route only; on another one it goes
    # by sight.
    if road_n == 0:
        crosswalks, stop_stations, halts = crosswalks[:0], stop_stations[:0], halts[:0]
    else:
        speed = min(speed, limit_speed(road, drops, road_n, ds, s, v))
    asked = waits
    if math.isnan(waits):
        asked = math.inf
    if road_n > 0 and math.isnan(waits) and not keeps_lane:
        asked = change_lane(
            road, road_n, ds, s, v, speed, front, rear, half_width, around, tracks, passages,
            n_passages, crosswalks, stop_stations, seen, friction_limit, elapsed, mind,
        )  # fmt: skip
    # After the lane change, which may have begun a shift: following, caution and emergency braking
    # use the ego's future place beside its route.
    shift = shift_of(mind) if road_n > 0 else UNSHIFTED
    careful = careful_speed(
        around, tracks, crosswalks, s, front, half_width, shift, in_town, friction_limit
    )
    speed = min(speed, careful, shift_speed(shift, s, friction_limit))
    wanted = min(max(hold_speed(v, speed), -2.0 * COMFORT_DECELERATION), COMFORT_ACCELERATION)
    wanted = min(wanted, asked)
    asked, stops_for = stop_at_lights(
        stop_stations, lights, s, front, v, light_seen, int(mind[STOPS_FOR]) - 1
    )
    mind[STOPS_FOR] = stops_for + 1.0
    wanted = min(wanted, asked)
    asked, mind[HALTED] = stop_at_signs(halts, s, front, v, mind[HALTED])
    wanted = min(wanted, asked)
    wanted = min(wanted, keep_distance(around, tracks, s, front, rear, half_width, shift, v))
    wanted = min(
        wanted,
        yield_to_all(s, v, speed, front, rear, shift, friction_limit, passages, n_passages),
    )
    # Last, and without regard to all that is wanted: full braking for an imminent contact.
    if must_brake(path, n, ds, s, v, body, shift, around, tracks, friction_limit):
        wanted = -friction_limit
    return max(wanted, -friction_limit)


@kernel
def drive(k, plan_, roads, state, record):
    """Return what the driver demands at instant k: acceleration [m/s²] and curvature [1/m].

    Args:
        k: the instant.
        plan_: the compiled storyboard, see ``simulation.embedded._memory_kernels``.
        roads: the row's, of the same.
        state: the row's.
        record: the row's.
    """
    s, v, mind = state.station[0], record.v[0, k], state.mind
    friction_limit = state.weather[FRICTION]
    curvature = keep_to_route(k, roads, state, record)
    perceive(
        k, plan_.dt, state.key[0], plan_.ideal_perception, state.visible, record.x, record.y,
        record.h, record.v, plan_.bodies, plan_.kinds, state.lamps, state.weather,
        settings(plan_.tracker, state.slots), state.sensors, state.tracks, record.detections,
    )  # fmt: skip
    haunt(k, plan_, roads, state, record)
    if state.shoulder[SHOULDER_LENGTH] > 0.0:  # it plans for where it will be
        for i in range(4):  # a slice would be copied first
            mind[BEFORE + i] = state.shoulder[i]
    # By time, not by instants: so it plans as often at any step up to `CYCLE`.
    if k * plan_.dt > mind[NEXT_PLAN] - 1e-6:
        mind[NEXT_PLAN] += max(CYCLE, plan_.dt)
        waits, turns = math.nan, roads.changes.shape[0] > 0
        if turns:
            waits = await_gap(k, max(CYCLE, plan_.dt), True, plan_, roads, state, record)
        p = state.on[0]
        # The map's data are known along the first route only; on another one it drives on sight.
        known = leads_on(roads.changes, p)
        path, n, ds = roads.paths[p], roads.counts[p], roads.steps[p]
        road_n = min(n, roads.counts[0]) if known else 0
        body, ahead = plan_.bodies[0], reach_of(v)
        elapsed, behind = max(CYCLE, plan_.dt), look_back(mind, BEHIND)
        surround(path, n, ds, s, behind, ahead, elapsed, state.tracks, state.around)
        if turns:
            for e in range(1, state.around.shape[0]):
                if is_other_lanes(e, v, body[2] + 0.5 * body[0], roads, state):
                    state.around[e, NEAR] = 0.0
        if plan_.ideal_prediction and known:
            count = predict_truly(
                path, n, ds, s, ahead, body[1], state.tracks, state.around, roads.paths,
                roads.counts, roads.steps, roads.zones, roads.path_ranks, state.station, state.on,
                state.to, state.foot, state.passages,
            )  # fmt: skip
        else:
            count = predict(
                path, n, ds, s, ahead, body[1], state.tracks, state.around, known,
                roads.hypotheses, roads.hypothesis_counts, roads.hypothesis_steps,
                roads.hypothesis_zones, roads.hypothesis_ranks, roads.hypothesis_first, state.feet,
                state.passages,
            )  # fmt: skip
        if turns:
            count = without_joining(state.passages, count, roads.changes, state.beside)
        in_town = road_n > 0 and roads.road[min(int(s / ds), road_n - 1), LIMIT] <= FAST_ROAD
        seen = light_seen = math.inf
        if not plan_.ideal_perception:
            cosine, sine = elementary.cos(record.h[0, k]), elementary.sin(record.h[0, k])
            column, share = column_of(state.weather, cosine, sine)
            seen = seen_in(state.weather, WALKER if in_town else REAR, column, share)
            light_seen = seen_in(state.weather, LIGHT, column, share)
        mind[PLANNED] = plan(
            path, roads.bends[p], roads.road, roads.drops, n, road_n, ds, s, v, body,
            state.command[0], friction_limit, seen, light_seen, in_town, state.around,
            state.tracks, state.passages, count, roads.crosswalks, roads.stops, roads.halts,
            state.lights, elapsed, stopping_for(k, plan_, state) >= 0.0, waits, mind,
        )  # fmt: skip
    on = state.on[0]
    if shift_of(mind) != UNSHIFTED and leads_on(roads.changes, on):
        curvature = pursue_beside(
            roads.paths[on],
            roads.counts[on],
            roads.steps[on],
            s,
            shift_of(mind),
            record.x[0, k],
            record.y[0, k],
            record.h[0, k],
            preview(v),
        )
    # A vehicle with dynamics has lags of its own; with both they would count twice.
    lags = plan_.moves_chassis == 0
    return control.actuate(mind, mind[PLANNED], curvature, plan_.dt, plan_.ideal_control, lags)
