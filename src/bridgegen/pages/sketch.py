"""A bird's-eye sketch of one concrete scenario as SVG: starts and closest approach."""

from collections.abc import Iterator

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.engine.runner import Runner
from bridgegen.pages.birdseye import GROUND, MOVES, PLAYERS, Camera, View, centre_of
from bridgegen.pages.scenery import Scenery, bodies, lamps
from bridgegen.pages.svg import SvgDraw
from bridgegen.scenario.participants import drawing_of

WIDTH, HEIGHT = 960, 430
"""Size of the picture in pixels."""

_REACH = (34.0, 95.0)  # m, half of the picture's width: minimum, maximum
_AFTER = 2.0  # s, length of the drawn paths beyond the closest approach
_EVERY = 4  # instants from one point of a path to the next


def sketch(runner: Runner, x: Float | None = None) -> str:
    """Return the picture of one row of a scenario.

    Args:
        runner: of the scenario and its ego.
        x: ``(len(space.names),)``; by default the row of the defaults.

    Returns:
        SVG of `WIDTH` by `HEIGHT` pixels: every body at the closest approach, its path until
        shortly afterwards, and as a dashed outline its start.
    """
    x = runner.space.row({}) if x is None else x
    rollout = runner.run(x[np.newaxis]).as_driven()
    road = Scenery(runner).road(x)
    n = int(rollout.n_steps[0])
    distance = rollout.distance[0].min(axis=0)[:n]
    closest = int(distance.argmin()) if np.isfinite(distance).any() else n - 1
    last = min(n - 1, closest + round(_AFTER / rollout.time_step))
    entities = bodies(rollout, runner.bodies(x))
    where = np.stack([rollout.x[0], rollout.y[0], rollout.h[0]], axis=-1)  # (E, T, 3)
    there = rollout.present[0] if rollout.present.size else np.ones(where.shape[:2], np.bool_)
    moving = [e == 0 or bool((rollout.v[0, e, :n] > MOVES).any()) for e in range(len(entities))]
    seen = there & np.array(moving)[:, np.newaxis]
    draw = SvgDraw((WIDTH, HEIGHT), GROUND)
    view = View(draw, _camera(where[:, : last + 1][seen[:, : last + 1]], where[0, closest]), 1.2)
    view.road(road.outlines)
    view.lamps(lamps(rollout, 0, road.lights), closest)
    colours = [PLAYERS[0 if e == 0 else (e - 1) % 3 + 1] for e in range(len(entities))]
    for e in np.flatnonzero(moving).tolist():
        for first, end in _stays(there[e, : last + 1]):
            view.start(entities[e], where[e, first], colours[e])
            path = centre_of(entities[e], where[e, [*range(first, end, _EVERY), end]])
            view.trail(path, colours[e], max(1, round(1.0 / rollout.time_step / _EVERY)))
            view.arrow(path[-1], float(where[e, end, 2]), colours[e])
    shown = np.flatnonzero(there[:, closest]).tolist()
    for e in shown:
        view.body(entities[e], where[e, closest], colours[e])
    view.scale_bar()
    view.labels(
        [view.corners(entities[e], where[e, closest]) for e in shown],
        [
            (number, entities[e].name, colours[e])
            for number, e in enumerate(shown)
            if drawing_of(entities[e].type).shape not in ("cone", "sign")
        ],
    )
    return draw.svg(title=f"{runner.scenario.title}, seen from above")


def _stays(there: Bool) -> Iterator[tuple[int, int]]:
    """Yield the first and the last instant of each interval in which a body is present."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], there, [False]]).astype(np.int8)))
    yield from ((first, end - 1) for first, end in edges.reshape(-1, 2).tolist())


def _camera(where: Float, ego: Float) -> Camera:
    """Return the view that holds poses (·, 3); of long paths, the stretch about the ego's."""
    points = where[:, :2]
    low, high = points.min(axis=0), points.max(axis=0)
    half = 0.5 * (high - low) + 8.0
    reach = max(half[0], half[1] * WIDTH / HEIGHT)
    middle = 0.5 * (low + high)
    if reach > _REACH[1]:
        middle = ego[:2]
    reach = min(max(reach, _REACH[0]), _REACH[1])
    return Camera(float(middle[0]), float(middle[1]), WIDTH / 2.0 / reach, (WIDTH / 2, HEIGHT / 2))
