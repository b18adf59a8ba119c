"""A compiled driver of one's own: the driver of my_driver.py, one scenario at a time.

bridgegen validate docs/examples/my_compiled_driver.py:drive
bridgegen search cut-in --ego docs/examples/my_compiled_driver.py:drive
"""

import math

from bridgegen.drivers.compiled import compiled_driver


@compiled_driver()
def drive(scene, ego, route, tracks, memory):
    cosine, sine = math.cos(ego.h), math.sin(ego.h)
    # Steer through the point of the route six metres ahead (pure pursuit).
    dx, dy = route[3].x - ego.x, route[3].y - ego.y
    curvature = 2.0 * (dy * cosine - dx * sine) / max(dx * dx + dy * dy, 1.0)
    # Hold the speed, unless somebody is less than two seconds ahead.
    for track in tracks:
        tx, ty = track.x - ego.x, track.y - ego.y
        ahead, beside = tx * cosine + ty * sine, ty * cosine - tx * sine
        if track.state >= 2.0 and abs(beside) < 2.0 and 0.0 < ahead < 2.0 * ego.v:
            return -5.0, curvature
    comfort = min(2.0, scene.max_acceleration)
    return min(max(ego.target_speed - ego.v, -2.0), comfort), curvature
