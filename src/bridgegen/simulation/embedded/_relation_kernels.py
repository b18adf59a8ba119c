"""What is asked for seldom: relative speeds, accelerations, angles, contacts, distances to places.

One function, for the code of all instants would grow by it.
"""

import math

from bridgegen.compiled import inlined_kernel, kernel
from bridgegen.ego._path_kernels import pose, project
from bridgegen.simulation.embedded._codes import (
    ACCELERATING,
    ANGLE,
    CLOSELY,
    COLLISION,
    COLLISION_WITH_TYPE,
    DISTANCE,
    END_OF_ROAD,
    EQUAL,
    GREATER,
    GREATER_EQUAL,
    LATERAL,
    LESS,
    LESS_EQUAL,
    LIGHT_PHASE,
    LIGHT_STATE,
    LIMIT,
    LONGITUDINAL,
    MEASURE,
    OTHER,
    PATH_SYSTEM,
    PROBE,
    RELATIVE_ANGLE,
    RULE,
    SPEED_DIFFERENCE,
    SYSTEM,
    TIME_OF_DAY,
    TOTAL,
    VALUE,
    WHO,
    WITHIN,
    WORLD_SYSTEM,
)
from bridgegen.simulation.embedded._distance_kernels import apart, borrow_scene, look_ahead
from bridgegen.simulation.embedded._global_kernels import time_of_day

AT_END = 1e-6  # m
SAME_TIME = 1e-6  # s, the rounding of a date
SAME_VALUE = 1e-9  # of any unit, the rounding of what is summed up step by step
SAME_ANGLE = 1e-9  # rad, the rounding of a turn


@kernel
def compare(value, rule, limit):
    """Apply an OpenSCENARIO Rule; what is the limit up to rounding is the limit."""
    if abs(value - limit) <= SAME_VALUE:
        value = limit
    if rule == GREATER:
        return value > limit
    if rule == LESS:
        return value < limit
    if rule == GREATER_EQUAL:
        return value >= limit
    if rule == LESS_EQUAL:
        return value <= limit
    if rule == EQUAL:
        return value == limit
    return value != limit


@kernel
def compare_times(now, rule, limit):
    """Apply a Rule to a time [s], an instant being a multiple of the step up to rounding."""
    if not math.isfinite(now):
        return False
    return compare(limit if abs(now - limit) <= SAME_TIME else now, rule, limit)


@kernel
def look_closely(k, scene):
    """Take down what the probes see at instant k that are seldom asked for."""
    scene = borrow_scene(scene)
    for p in range(scene.probes.shape[0]):
        if scene.probes[p, CLOSELY]:
            scene.observed[p] = look_one(p, k, scene)


@inlined_kernel
def look_one(p, k, scene):
    """Return whether probe p sees at instant k what its condition asks for."""
    kind, e, other = scene.probes[p, PROBE], scene.probes[p, WHO], scene.probes[p, OTHER]
    rule, limit = scene.probes[p, RULE], scene.slots[scene.probes[p, LIMIT]]
    measure = scene.probes[p, MEASURE]
    if kind == VALUE:
        return compare(scene.values[other], rule, limit)
    if kind == TIME_OF_DAY:
        return compare_times(time_of_day(k * scene.dt, scene.clock), rule, limit)
    if kind == LIGHT_STATE:
        return scene.lights[other] == limit
    if kind == LIGHT_PHASE:
        return scene.phase_now[other] == limit
    if kind >= DISTANCE:
        defined, value = look_ahead(p, k, scene)
        return defined and compare(value, rule, limit)
    if kind == COLLISION:
        return touch(e, other, k, scene)
    if kind == COLLISION_WITH_TYPE:
        for i in range(scene.x.shape[0]):
            there = i != e and scene.present[i]
            if there and scene.objects[i] == other and touch(e, i, k, scene):
                return True
        return False
    if kind in (ANGLE, RELATIVE_ANGLE):
        off = angle_of(p, k, scene) - limit
        off -= 2.0 * math.pi * round(off / (2.0 * math.pi))
        return abs(off) <= scene.slots[scene.probes[p, WITHIN]] + SAME_ANGLE
    if kind == END_OF_ROAD:
        path = scene.on[e]
        length = (scene.counts[path] - 1) * scene.steps[path]
        at_end = scene.present[e] and path >= 0 and scene.station[e] >= length - AT_END
        scene.held[p] = scene.held[p] + scene.dt if at_end else -scene.dt
        return at_end and scene.held[p] >= limit - AT_END
    if kind == SPEED_DIFFERENCE:
        turn = scene.h[other, k] - scene.h[e, k]
        along, aside = scene.v[other, k] * math.cos(turn), scene.v[other, k] * math.sin(turn)
        if measure == TOTAL:
            return compare(scene.v[e, k] - scene.v[other, k], rule, limit)
        if measure == LONGITUDINAL:
            return compare(scene.v[e, k] - along, rule, limit)
        return compare(-aside if measure == LATERAL else 0.0, rule, limit)
    if kind == ACCELERATING:
        along, aside = accelerations(e, k, scene)
        if measure == TOTAL:
            return compare(math.hypot(along, aside), rule, limit)
        if measure == LONGITUDINAL:
            return compare(along, rule, limit)
        return compare(aside if measure == LATERAL else 0.0, rule, limit)
    return compare(scene.v[e, k] if measure == LONGITUDINAL else 0.0, rule, limit)  # SPEED


@inlined_kernel
def touch(e, other, k, scene):
    """Return whether the boxes of two entities touch."""
    return (
        apart(
            scene.bodies[e], scene.bodies[other, 0], scene.bodies[other, 1], scene.bodies[other, 2],
            scene.x[other, k] - scene.x[e, k], scene.y[other, k] - scene.y[e, k],
            scene.h[e, k], scene.h[other, k],
        )
        == 0.0
    )  # fmt: skip


@inlined_kernel
def angle_of(p, k, scene):
    """Return the heading that a condition looks at [rad], by the system that it is measured in."""
    e, other, system = scene.probes[p, WHO], scene.probes[p, OTHER], scene.probes[p, SYSTEM]
    if scene.probes[p, PROBE] == RELATIVE_ANGLE:
        return scene.h[other, k] - scene.h[e, k]
    if system == WORLD_SYSTEM:
        return scene.h[e, k]
    path = scene.on[e]
    if system != PATH_SYSTEM or path < 0:
        return 0.0
    table, n, ds = scene.paths[path], scene.counts[path], scene.steps[path]
    s, _ = project(table, n, ds, scene.station[e], scene.x[e, k], scene.y[e, k])
    return scene.h[e, k] - pose(table, n, ds, s)[2]


@inlined_kernel
def accelerations(e, k, scene):
    """Return an entity's acceleration forward and to its left [m/s²], over the last step."""
    if k == 0:
        return 0.0, 0.0
    turn = (scene.h[e, k] - scene.h[e, k - 1]) / scene.dt
    return scene.a[e, k - 1], scene.v[e, k] * turn
