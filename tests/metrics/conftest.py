from collections.abc import Callable

import numpy as np
import pytest

from bridgegen.simulation.rollout import Rollout

STATES = ("x", "y", "h", "v", "a", "offset")


def make_rollout(n_steps=None, status=None, time_step=0.05, box=(4.0, 2.0, 0.0), **states):
    """A rollout from any states, which broadcast to (N, E, T); the others are 0."""
    given = np.broadcast_shapes(*(np.shape(value) for value in states.values()))
    shape = (1,) * (3 - len(given)) + given
    n, e, t = shape
    arrays = {
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
    )


def take_rows(rollout, rows):
    """The scenarios of some rows as a rollout of their own."""
    arrays = {name: getattr(rollout, name)[rows] for name in (*STATES, "n_steps", "status")}
    return Rollout(rollout.time_step, rollout.names, rollout.box, **arrays)


def drive_around(n=12, e=3, t=50, seed=0, within=15.0):
    """Vehicles that turn, stop and meet in a small place; every metric has something to find."""
    rng = np.random.default_rng(seed)
    time = 0.05 * np.arange(t)
    v = np.abs(rng.uniform(0, 14, (n, e, 1)) + rng.uniform(-6, 3, (n, e, 1)) * time)
    v[rng.random((n, e)) < 0.15] = 0.0
    turn = rng.uniform(-0.6, 0.6, (n, e, 1)) * (rng.random((n, e, 1)) < 0.6)
    h = rng.uniform(-4, 4, (n, e, 1)) + turn * time
    return make_rollout(
        box=np.column_stack([rng.uniform(3, 9, e), rng.uniform(1, 3, e), rng.uniform(0, 2, e)]),
        x=rng.uniform(-within, within, (n, e, 1)) + np.cumsum(0.05 * v * np.cos(h), axis=-1),
        y=rng.uniform(-within, within, (n, e, 1)) + np.cumsum(0.05 * v * np.sin(h), axis=-1),
        h=h,
        v=v,
        a=6 * np.sin(rng.uniform(0.5, 8, (n, e, 1)) * time + rng.uniform(0, 6, (n, e, 1))),
        offset=rng.normal(0, 0.5, (n, e, t)),
        n_steps=rng.integers(1, t + 1, n),
    )


@pytest.fixture(scope="session")
def rollout_of() -> Callable[..., Rollout]:
    return make_rollout


@pytest.fixture(scope="session")
def rows_of() -> Callable[..., Rollout]:
    return take_rows


@pytest.fixture(scope="session")
def driven() -> Callable[..., Rollout]:
    return drive_around
