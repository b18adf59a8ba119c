"""Drivers of the scenario cut-in that pass what is published, and fail just beside it."""

import math

from bridgegen.drivers.compiled import compiled_driver
from bridgegen.jobs.suite.rows import rows_of
from bridgegen.scenario.language.reader import load

_SCENARIO = load("cut-in")
_SPACE = _SCENARIO.space()
_GAP = _SPACE.index("gap")
PUBLISHED = tuple(rows_of(_SCENARIO, _SPACE, 100, 0).X[:, _GAP].tolist())
"""The gap at the start in each published variation [m]."""


def _driver(nearest, farthest):
    """Return a driver that is blind where the gap is so far from every published one [m]."""

    @compiled_driver(memory=1)
    def drive(scene, ego, route, tracks, memory):
        cosine, sine = math.cos(ego.h), math.sin(ego.h)
        dx, dy = route[3].x - ego.x, route[3].y - ego.y
        curvature = 2.0 * (dy * cosine - dx * sine) / max(dx * dx + dy * dy, 1.0)
        gap = 1e9
        for track in tracks:
            tx, ty = track.x - ego.x, track.y - ego.y
            ahead, beside = tx * cosine + ty * sine, ty * cosine - tx * sine
            if track.state >= 1.0 and abs(beside) < 6.0 and ahead > 0.0:
                gap = min(gap, ahead - scene.centre)
        if memory[0] == 0.0:
            off = 1e9
            for published in PUBLISHED:
                off = min(off, abs(gap - published))
            memory[0] = 1.0 if nearest < off < farthest else -1.0
        if gap < 5.0 + 2.5 * ego.v and memory[0] < 0.0:
            return -7.0, curvature
        return min(max(ego.target_speed - ego.v, -2.0), 2.0), curvature

    return drive


careful = _driver(1e9, 1e9)
knows_the_grid = _driver(0.01, 1e9)
fails_beside_it = _driver(0.01, 0.05)
