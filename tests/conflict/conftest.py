"""Rollouts of bodies that drive what a test says; every box is 4 m by 2 m unless it says more."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from bridgegen.drivers.kinds import CAR
from bridgegen.simulation.rollout import Rollout

DT = 0.05


def drive(x=0.0, y=0.0, h=0.0, v=0.0, t=6.0, slide=0.0):
    """The track of a body from (x, y): headings [rad] and speeds [m/s], constant or per instant.

    ``slide`` is a velocity to its left [m/s] that its speed does not show.
    """
    n = round(t / DT) + 1
    h, v, slide = (np.broadcast_to(np.asarray(each, float), (n,)) for each in (h, v, slide))
    mean_v, mean_h = 0.5 * (v[1:] + v[:-1]), 0.5 * (h[1:] + h[:-1])
    mean_slide = 0.5 * (slide[1:] + slide[:-1])
    dx = mean_v * np.cos(mean_h) - mean_slide * np.sin(mean_h)
    dy = mean_v * np.sin(mean_h) + mean_slide * np.cos(mean_h)
    return {
        "x": x + DT * np.concatenate([[0.0], np.cumsum(dx)]),
        "y": y + DT * np.concatenate([[0.0], np.cumsum(dy)]),
        "h": h,
        "v": v,
        "a": np.append(np.diff(v) / DT, 0.0),
        "offset": np.zeros(n),
    }


def meet(*tracks, kinds=None, boxes=None, claims=None, n_steps=None, **more):
    """One scenario of bodies that drive these tracks; the first is the ego.

    ``claims`` are the ego's against each of the others, as `right_of_way.claim` has them.
    """
    e, t = len(tracks), len(tracks[0]["x"])
    states = {
        name: np.array([[track[name] for track in tracks]])
        for name in ("x", "y", "h", "v", "a", "offset")
    }
    if claims is not None:
        table = np.zeros((1, e, e), np.int64)
        table[0, 0, 1:], table[0, 1:, 0] = claims, -np.asarray(claims)
        more["claims"] = table
    return Rollout(
        time_step=DT,
        names=("ego", "bv", *(f"bv{j}" for j in range(2, e)))[:e],
        box=np.broadcast_to(np.asarray(boxes or (4.0, 2.0, 0.0), float), (e, 3)).copy(),
        **states,
        n_steps=np.array([n_steps or t]),
        status=np.zeros(1, np.int8),
        kinds=np.array(kinds or [CAR] * e),
        **more,
    )


def seconds(*pieces):
    """A course of values per instant, linear between (time [s], value) pairs."""
    times, values = zip(*pieces, strict=True)
    n = round(times[-1] / DT) + 1
    return np.interp(DT * np.arange(n), times, values)


@pytest.fixture(scope="session")
def track() -> Callable[..., Any]:
    return drive


@pytest.fixture(scope="session")
def meeting() -> Callable[..., Rollout]:
    return meet


@pytest.fixture(scope="session")
def course() -> Callable[..., Any]:
    return seconds
