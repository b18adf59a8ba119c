"""Compiled drivers of a user's own, good and bad; the good ones drive as those in drivers.py."""

import math

from bridgegen.drivers.compiled import compiled_driver

LIMIT = 7.5


@compiled_driver()
def cruises(scene, ego, route, tracks, memory):
    return min(max(ego.target_speed - ego.v, -3.0), 2.0), 0.0


@compiled_driver()
def looks_ahead(scene, ego, route, tracks, memory):
    dx, dy = route[3].x - ego.x, route[3].y - ego.y
    cosine, sine = math.cos(ego.h), math.sin(ego.h)
    curvature = 2.0 * (dy * cosine - dx * sine) / max(dx * dx + dy * dy, 1.0)
    near = False
    for track in tracks:
        tx, ty = track.x - ego.x, track.y - ego.y
        if track.state >= 2.0 and tx * cosine + ty * sine > 0.0:
            near = near or math.hypot(tx, ty) < 2.0 * ego.v
    if near:
        return -6.0, curvature
    return min(max(ego.target_speed - ego.v, -3.0), 2.0), curvature


@compiled_driver(memory=2)
def counts(scene, ego, route, tracks, memory):
    """Brakes after 2 s by its own count."""
    memory[0] += scene.time_step
    memory[1] += 1.0
    return (-1.0 if memory[0] > 2.02 else 0.0), 0.0 * memory[1]


@compiled_driver()
def meddles(scene, ego, route, tracks, memory):
    """Cruises, and writes over all that it is told."""
    demanded = min(max(ego.target_speed - ego.v, -3.0), 2.0)
    ego.v = 1000.0
    ego.target_speed = 0.0
    scene.time_step = 7.0
    for track in tracks:
        track.x = 0.0
    for point in route:
        point.x = 0.0
    return demanded, 0.0


@compiled_driver()
def raises_fast(scene, ego, route, tracks, memory):
    if ego.target_speed > LIMIT and ego.time > 1.0:
        raise ValueError("too fast for me")
    return min(max(ego.target_speed - ego.v, -3.0), 2.0), 0.0


@compiled_driver()
def reads_beyond_fast(scene, ego, route, tracks, memory):
    last = 1000 if ego.target_speed > LIMIT and ego.time > 1.0 else 0
    return min(max(ego.target_speed - ego.v, -3.0), 2.0), 0.0 * route[last].curvature


@compiled_driver()
def hangs_fast(scene, ego, route, tracks, memory):
    x = 1.0
    while x > 0.0 and ego.target_speed > LIMIT and ego.time > 1.0:
        x += math.sin(x) ** 2
    return min(max(ego.target_speed - ego.v, -3.0), 2.0), 0.0


@compiled_driver()
def nan_fast(scene, ego, route, tracks, memory):
    fast = ego.target_speed > LIMIT and ego.time > 1.0
    return (math.nan if fast else min(max(ego.target_speed - ego.v, -3.0), 2.0)), 0.0


@compiled_driver()
def nan(scene, ego, route, tracks, memory):
    return math.nan, 0.0


@compiled_driver()
def misspelt(scene, ego, route, tracks, memory):
    gap = 1.0
    return gap, ego.curvatur


@compiled_driver()
def answers_one_number(scene, ego, route, tracks, memory):
    return 1.0


def not_a_driver(scene, ego, route, tracks, memory):
    return 0.0, 0.0
