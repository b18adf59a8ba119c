"""Metrics of impact: collisions, and speeds at the ego's first contact."""

import numpy as np

from bridgegen.assess.metrics.metric import (
    Metric,
    distance,
    in_steps,
    recorded,
    shared,
    steps,
    without_failed,
)
from bridgegen.base import elementary
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.simulation.rollout import Rollout

# --- The ego's first contact: what the metrics of its impact share ---


def first_contact(rollout: Rollout) -> tuple[Bool, Int]:
    """Return which entities the ego's first contact is with, and at which instant.

    Returns:
        ``(N, E)`` bool, several where it touches them at the same instant; and ``(N,)``, −1 where
        there is no contact.
    """
    return shared(rollout, _first_contact)


def _first_contact(rollout: Rollout) -> tuple[Bool, Int]:
    n, _, t = rollout.shape
    real = np.arange(t)[np.newaxis, :] < steps(rollout)[:, np.newaxis]
    touching = (distance(rollout) <= 0.0) & real[:, np.newaxis, :]
    anyone: Bool = np.any(touching, axis=1)
    touched: Bool = np.any(anyone, axis=1)
    instant = np.where(touched, anyone.argmax(axis=1), -1)
    return touching[np.arange(n), :, np.maximum(instant, 0)], instant


def at_contact(rollout: Rollout, field: str) -> Float:
    """Return a state of all entities at the first contact; where there is none, at the start.

    Args:
        rollout: N scenarios.
        field: "v", "h".

    Returns:
        ``(N, E)``.
    """
    _, instant = first_contact(rollout)
    state: Float = recorded(rollout, field)[np.arange(len(instant)), :, np.maximum(instant, 0)]
    return state


# --- n_collision: number of the ego's collisions ---


MERGED = 5.0
"""Time after a contact within which another with the same actor is part of it [s]."""


def n_collision(rollout: Rollout, merge_within: float = MERGED) -> Float:
    """Return the number of contacts between the ego's oriented box and another's.

    Args:
        rollout: N scenarios.
        merge_within: [s]; a contact that begins no later than this after the last instant of a
            contact with the same actor is part of it.

    Returns:
        ``(N,)`` float64, whole numbers; NaN where the scenario failed.

    Raises:
        ValueError: ``merge_within`` is not a positive number of seconds.

    Source: paper, Table I.
    """
    from bridgegen.assess.metrics import _kernels

    merge_steps = in_steps("merge_within", merge_within, rollout.time_step)
    out = np.empty(rollout.shape[0])
    _kernels.contacts(distance(rollout), steps(rollout), merge_steps, out)
    return without_failed(rollout, out)


N_COLLISION = Metric(
    name="n_collision",
    unit="count",
    description="collisions of the ego; those with the same actor within 5 s count once",
    sense="larger",
    cap=0.0,
    compute=n_collision,
)


# --- impact_speed: the ego's speed at its first contact ---


def impact_speed(rollout: Rollout) -> Float:
    """Return the ego's speed at the first instant of its first contact.

    Returns:
        ``(N,)`` float64 [m/s], ≥ 0, ahead or in reverse; 0 without a contact, or if it stands; NaN
        where the scenario failed.

    Source: Vimpact of Euro NCAP's Crash Avoidance protocol, Frontal Collisions, 1.1 (2025).
    """
    _, instant = first_contact(rollout)
    speed = np.abs(at_contact(rollout, "v")[:, 0])
    return without_failed(rollout, np.where(instant < 0, 0.0, speed))


IMPACT_SPEED = Metric(
    name="impact_speed",
    unit="m/s",
    description="ego speed at its first contact",
    sense="larger",
    cap=0.0,
    compute=impact_speed,
)


# --- relative_impact_speed: how much faster the ego is than what it touches first ---


def relative_impact_speed(rollout: Rollout) -> Float:
    """Return the ego's speed less the other's speed along the ego's heading, at the first contact.

    Returns:
        ``(N,)`` float64 [m/s], ≥ 0: the ego's own speed if the other crosses at a right angle, the
        sum of both head-on; the largest, if it touches several at once; 0 without a contact, or if
        the other is faster; NaN where the scenario failed.

    Source: Vrel_impact of Euro NCAP's Crash Avoidance protocol, Frontal Collisions, 1.1 (2025).
    """
    touching, _ = first_contact(rollout)
    v, h = (at_contact(rollout, field) for field in ("v", "h"))
    relative = v[:, :1] - v * elementary.cos(h - h[:, :1])
    largest = np.where(touching, relative, 0.0).max(axis=1)
    return without_failed(rollout, np.maximum(largest, 0.0))


RELATIVE_IMPACT_SPEED = Metric(
    name="relative_impact_speed",
    unit="m/s",
    description="ego speed less the other's along the ego's heading, at its first contact",
    sense="larger",
    cap=0.0,
    compute=relative_impact_speed,
)


# --- speed_reduction: how much slower the ego is at its first contact than at the start ---


def speed_reduction(rollout: Rollout) -> Float:
    """Return the ego's speed at the start less that at its first contact.

    Returns:
        ``(N,)`` float64 [m/s]; below 0 if it is faster then; +inf without a contact; NaN where the
        scenario failed.

    Source: Vreduction of Euro NCAP's Crash Avoidance protocol, Frontal Collisions, 1.1 (2025);
    its test speed is the ego's first speed.
    """
    _, instant = first_contact(rollout)
    before, after = recorded(rollout, "v")[:, 0, 0], at_contact(rollout, "v")[:, 0]
    reduction = np.abs(before) - np.abs(after)
    return without_failed(rollout, np.where(instant < 0, np.inf, reduction))


SPEED_REDUCTION = Metric(
    name="speed_reduction",
    unit="m/s",
    description="ego speed at the start less that at its first contact",
    sense="smaller",
    cap=60.0,  # more than any vehicle is fast
    compute=speed_reduction,
)
