"""A part of recorded traffic as a rollout: one participant is the ego, and the analyses apply."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.recordings.readers.states import centre_ahead
from bridgegen.recordings.readers.table import RecordedTraffic
from bridgegen.simulation.rollout import Rollout

# Of WOMD's sample, both near misses that were found at first were fragments of less than 1 s:
# velocities of 10 states are worth little.
LONG_ENOUGH = 1.0
"""Time for which a participant must be recorded [s]; with less it is a fragment."""
# A body that stands must not be turned round by −0.01 m/s: its predicted path led backwards, and a
# car that braked to a stop 0.4 m before another was in no conflict.
REVERSES = 0.3
"""Backward speed below which motion is noise of a body that stands [m/s]."""


@dataclass(frozen=True)
class Clock:
    """The instants of a cleaned recording, which all its participants share.

    Attributes:
        instant: ``(S,)`` int64, of each state; instant k is at k · time_step.
        begin: ``(P,)`` int64, first instant of each participant.
        end: ``(P,)`` int64, last one.
        is_whole: ``(P,)`` bool: there for `LONG_ENOUGH`; else it is a fragment, whose motion is not
            known well.
    """

    instant: Int
    begin: Int
    end: Int
    is_whole: Bool


def clock_of(traffic: RecordedTraffic) -> Clock:
    """Return the instants of a cleaned recording."""
    instant = np.rint(traffic.time / traffic.facts.time_step).astype(np.int64)
    begin, end = instant[traffic.first[:-1]], instant[traffic.first[1:] - 1]
    is_whole = (end - begin) * traffic.facts.time_step >= LONG_ENOUGH
    return Clock(instant, begin, end, is_whole)


def path_speeds(
    traffic: RecordedTraffic, clock: Clock, who: Sequence[int], begin: int, end: int
) -> Float:
    """Return how fast the rear axles of some participants go, ``(E, T)`` [m/s], ≥ 0.

    That is their velocity, and what turning adds: of a body that drives as its wheels roll its
    forward speed, of one that slides sideways more. Where one is absent, it is 0.
    """
    found = np.zeros((len(who), end - begin + 1))
    for e, p in enumerate(who):
        first, last = max(begin, int(clock.begin[p])), min(end, int(clock.end[p]))
        at = np.arange(first, last + 1) - clock.begin[p] + traffic.first[p]
        h = np.unwrap(traffic.heading[at])
        turning = np.gradient(h, traffic.facts.time_step) if len(at) > 1 else np.zeros(len(at))
        ahead = centre_ahead(int(traffic.kind[p]), float(traffic.length[p]))
        cosine, sine = np.cos(h), np.sin(h)
        along = traffic.vx[at] * cosine + traffic.vy[at] * sine
        across = traffic.vy[at] * cosine - traffic.vx[at] * sine - ahead * turning
        found[e, first - begin : last - begin + 1] = np.hypot(along, across)
    return found


def excerpt(
    traffic: RecordedTraffic, clock: Clock, ego: int, others: Sequence[int], begin: int, end: int
) -> Rollout:
    """Return what some participants did, as a rollout with N = 1 that begins at time 0.

    A position becomes that of the rear axle, which the usual body of the kind puts at its place.
    Who is absent for a while stands where it was last, or will be first, and is not present.

    Args:
        traffic: cleaned.
        clock: its own.
        ego: the participant that is the ego; it is there from ``begin`` to ``end``.
        others: the other participants.
        begin: first instant.
        end: last instant.
    """
    who = (ego, *others)
    count = end - begin + 1
    states = np.empty((6, 1, len(who), count))
    present = np.ones((1, len(who), count), np.bool_)
    box = np.empty((len(who), 3))
    wanted = np.arange(begin, end + 1)
    for e, p in enumerate(who):
        # Arrays of a rollout have all instants; who is absent needs a place in them, and `present`
        # says that it is none.
        kept = np.clip(wanted, clock.begin[p], clock.end[p])
        present[0, e] = kept == wanted
        at = kept - clock.begin[p] + traffic.first[p]
        h = np.unwrap(traffic.heading[at])
        ahead = centre_ahead(int(traffic.kind[p]), float(traffic.length[p]))
        box[e] = traffic.length[p], traffic.width[p], ahead
        cosine, sine = np.cos(h), np.sin(h)
        # The component along the heading: the norm of a noisy velocity of who stands is 0.6 m/s,
        # its component 0.
        v = traffic.vx[at] * cosine + traffic.vy[at] * sine
        states[:, 0, e] = (
            traffic.x[at] - ahead * cosine,
            traffic.y[at] - ahead * sine,
            h,
            np.where((v < 0.0) & (v > -REVERSES), 0.0, v),
            traffic.acceleration[at],
            np.zeros(count),
        )
    x, y, h, v, a, offset = states
    return Rollout(
        time_step=traffic.facts.time_step,
        names=tuple(traffic.names[p] for p in who),
        box=box,
        x=x,
        y=y,
        h=h,
        v=v,
        a=a,
        offset=offset,
        n_steps=np.array([count]),
        status=np.zeros(1, np.int8),
        kinds=traffic.kind[list(who)],
        present=present if not present.all() else np.zeros((0, 0, 0), np.bool_),
    )
