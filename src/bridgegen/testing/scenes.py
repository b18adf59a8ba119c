"""Rollouts without a simulator: made by hand, or by chance."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float, Int
from bridgegen.simulation.rollout import Rollout

STATES = ("x", "y", "h", "v", "a", "offset")


def make_rollout(
    n_steps: npt.ArrayLike | None = None,
    status: npt.ArrayLike | None = None,
    time_step: float = 0.05,
    box: npt.ArrayLike = (4.0, 2.0, 0.0),
    kinds: npt.ArrayLike | None = None,
    light_names: Sequence[str] = (),
    lights: npt.ArrayLike | None = None,
    detections: npt.ArrayLike | None = None,
    stop_lines: npt.ArrayLike | None = None,
    stop_lights: Sequence[int] = (),
    **states: npt.ArrayLike,
) -> Rollout:
    """Return a rollout made by hand.

    Args:
        n_steps: ``(N,)`` instants before the padding; all by default.
        status: ``(N,)``, 0 of a scenario that ran, as by default.
        time_step: [s].
        box: ``(3,)`` or ``(E, 3)`` length, width, and how far the centre is ahead of the reference
            point [m].
        kinds: ``(E,)``, see `bridgegen.drivers.kinds`.
        light_names: of L traffic lights.
        lights: ``(N, L, T)`` their states.
        detections: ``(N, E, T, 8)``.
        stop_lines: ``(N, S, 3)`` x, y, heading.
        stop_lights: ``(S,)`` the light of each stop line.
        **states: x, y, h, v, a, offset, which broadcast to ``(N, E, T)``; the others are 0.
    """
    given = np.broadcast_shapes(*(np.shape(value) for value in states.values()))
    shape = (1,) * (3 - len(given)) + given
    n, e, t = shape
    arrays: dict[str, Any] = {
        name: np.broadcast_to(np.asarray(states.get(name, 0.0), dtype=float), shape).copy()
        for name in STATES
    }
    return Rollout(
        time_step=time_step,
        names=("ego", *(f"bv{j}" for j in range(1, e))),
        box=np.broadcast_to(np.asarray(box, dtype=float), (e, 3)).copy(),
        **arrays,
        n_steps=np.full(n, t) if n_steps is None else np.asarray(n_steps, dtype=np.int64),
        status=np.zeros(n, np.int8) if status is None else np.asarray(status, dtype=np.int8),
        light_names=tuple(light_names),
        lights=np.zeros((n, 0, t), np.int8) if lights is None else np.asarray(lights, np.int8),
        kinds=np.zeros(e, np.int64) if kinds is None else np.asarray(kinds, np.int64),
        detections=np.zeros((0, 0, 0, 8)) if detections is None else np.array(detections, float),
        stop_lines=np.zeros((n, 0, 3)) if stop_lines is None else np.array(stop_lines, float),
        stop_lights=np.asarray(stop_lights, dtype=np.int64),
        stop_entities=np.zeros(len(stop_lights), dtype=np.int64),
    )


def drive_around(
    n: int = 12, e: int = 3, t: int = 50, seed: int = 0, within: float = 15.0
) -> Rollout:
    """Return vehicles that turn, stop and meet in a small place; most metrics find something.

    The ego sees most of the others, now and then as something else, and has two stop lines ahead.
    """
    rng = np.random.default_rng(seed)
    time = 0.05 * np.arange(t)
    v = np.abs(rng.uniform(0, 14, (n, e, 1)) + rng.uniform(-6, 3, (n, e, 1)) * time)
    v[rng.random((n, e)) < 0.15] = 0.0
    turn = rng.uniform(-0.6, 0.6, (n, e, 1)) * (rng.random((n, e, 1)) < 0.6)
    h = rng.uniform(-4, 4, (n, e, 1)) + turn * time
    moved = make_rollout(
        box=np.column_stack([rng.uniform(3, 9, e), rng.uniform(1, 3, e), rng.uniform(0, 2, e)]),
        x=rng.uniform(-within, within, (n, e, 1)) + np.cumsum(0.05 * v * np.cos(h), axis=-1),
        y=rng.uniform(-within, within, (n, e, 1)) + np.cumsum(0.05 * v * np.sin(h), axis=-1),
        h=h,
        v=v,
        a=6 * np.sin(rng.uniform(0.5, 8, (n, e, 1)) * time + rng.uniform(0, 6, (n, e, 1))),
        offset=rng.normal(0, 0.5, (n, e, t)),
        n_steps=rng.integers(1, t + 1, n),
    )
    kinds = rng.integers(0, 8, e)
    front = moved.x[:, 0, t // 2], moved.y[:, 0, t // 2], moved.h[:, 0, t // 2]
    aside = rng.normal(0, 2, (n, 2))
    return replace(
        moved,
        kinds=kinds,
        detections=sight(moved, kinds, rng),
        light_names=("one", "two", "three"),
        lights=np.repeat(rng.integers(0, 5, (n, 3, 1 + t // 10)), 10, axis=2)[:, :, :t].astype(
            np.int8
        ),
        stop_lines=np.stack(
            [
                front[0][:, None] - aside * np.sin(front[2])[:, None],
                front[1][:, None] + aside * np.cos(front[2])[:, None],
                front[2][:, None] + rng.normal(0, 0.2, (n, 2)),
            ],
            axis=-1,
        ),
        stop_lights=np.array([2, 0]),
        stop_entities=np.array([0, 0]),
    )


def sight(rollout: Rollout, kinds: Int, rng: np.random.Generator) -> Float:
    """Return what sensors might see: every other instant, with errors of all sorts."""
    shape = rollout.x.shape
    ahead = rollout.box[:, 2, None]
    noise = rng.normal(0, 0.6, (8, *shape))
    out = np.zeros((*shape, 8))
    out[..., 0] = rng.integers(0, 4, shape)
    out[..., 0::2, 0] = -1
    out[..., 1] = rollout.x + ahead * np.cos(rollout.h) + noise[1]
    out[..., 2] = rollout.y + ahead * np.sin(rollout.h) + noise[2]
    out[..., 3] = rollout.h + 0.3 * noise[3]
    out[..., 4] = rollout.box[:, 0, None] * (1 + 0.2 * np.abs(noise[4]))
    out[..., 5] = rollout.box[:, 1, None] * (1 + 0.2 * np.abs(noise[5]))
    out[..., 6] = np.round(rng.random(shape), 1)  # some are equal
    out[..., 7] = np.where(rng.random(shape) < 0.2, rng.integers(0, 8, shape), kinds[:, None])
    out[:, 0] = 0.0
    return out


def scene_moved(scene: Rollout, turn: float, dx: float, dy: float) -> Rollout:
    """Return the whole scene, turned about the origin and moved."""
    c, s = np.cos(turn), np.sin(turn)

    def place(x: Float, y: Float) -> tuple[Float, Float]:
        return x * c - y * s + dx, x * s + y * c + dy

    x, y = place(scene.x, scene.y)
    detections, lines = scene.detections.copy(), scene.stop_lines.copy()
    detections[:, 1:, :, 1], detections[:, 1:, :, 2] = place(
        scene.detections[:, 1:, :, 1], scene.detections[:, 1:, :, 2]
    )
    detections[:, 1:, :, 3] += turn
    lines[..., 0], lines[..., 1] = place(scene.stop_lines[..., 0], scene.stop_lines[..., 1])
    lines[..., 2] += turn
    return replace(scene, x=x, y=y, h=scene.h + turn, detections=detections, stop_lines=lines)
