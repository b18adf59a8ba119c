"""Compares two rollouts of one scenario by two simulators: where they diverge, and what differs.

One is *here*, the other *there*; every difference is there − here. If their time steps differ, the
states of the finer one are interpolated at the instants of the coarser one.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bridgegen.assess.metrics.distances import first_closest
from bridgegen.base.arrays import Bool, Float
from bridgegen.results.confirmation.differences import (
    DIVERGED,
    SLIGHT,
    TRACE,
    Approach,
    BoxSizes,
    Comparison,
    Contact,
    Divergence,
    EntityDivergence,
    EventTimes,
    LightTimes,
    Offset,
    Track,
)
from bridgegen.simulation.rollout import Rollout

SAME_BOX = 1e-3
"""Difference below which boxes are equal [m]."""

STANDS = 1e-3
"""Movement in a step below which an entity has no direction of travel [m]."""

_EPSILON = 1e-6  # of times [s]: they are multiples of a step


@dataclass(frozen=True)
class _States:
    """The states of one entity at the K compared instants, ``(K,)`` each."""

    x: Float
    y: Float
    h: Float
    v: Float
    present: Bool


@dataclass(frozen=True)
class _OffBy:
    """How an entity differs at an instant; see `EntityDivergence`."""

    gap: float | None = None
    along: float | None = None
    across: float | None = None
    speed: float | None = None
    turn: float | None = None
    only: str | None = None


def compare(here: Rollout, there: Rollout, i: int = 0, j: int = 0, partner: str = "") -> Comparison:
    """Compare row i of one rollout with row j of another.

    Args:
        here: the reference.
        there: the other rollout; the egos are the first entities, other entities are matched by
            their names.
        i: a row of ``here`` that has not failed.
        j: a row of ``there`` that has not failed.
        partner: the entity whose closest approach to the ego is reported; the closest by default.
    """
    here, there = here.as_driven(), there.as_driven()
    times = _instants(here, there, i, j)
    step = max(here.time_step, there.time_step)
    bodies = _shared(here, there)
    known, met = {e for e, _ in bodies}, {f for _, f in bodies}
    pairs = [
        (here.names[e], _states(here, i, e, times), _states(there, j, f, times)) for e, f in bodies
    ]
    partings = [_parting(name, a, b, times) for name, a, b in pairs]
    parted = sorted(filter(None, partings), key=lambda parting: parting.time)
    closest = closest_approach(here, i, partner)
    return Comparison(
        step=step,
        ends=(_end(here, i), _end(there, j)),
        contacts=(first_contact(here, i), first_contact(there, j)),
        partings=tuple(parted),
        offsets=_offsets(pairs, times, parted[0]) if parted else (),
        events=_events(here, there, i, j, step),
        lights=_lights(here, there, i, j, times),
        boxes=_boxes(here, there, bodies),
        only_here=tuple(name for e, name in enumerate(here.names) if e not in known),
        only_there=tuple(name for f, name in enumerate(there.names) if f not in met),
        closest=closest,
        diverged=_diverged(pairs, times, closest) if closest else (),
    )


def tracks(here: Rollout, there: Rollout, i: int = 0, j: int = 0) -> tuple[Track, ...]:
    """Return the tracks there of the entities that deviate by more than TRACE, from then on.

    Args:
        here: see ``compare``, as for the following.
        there: see ``compare``.
        i: see ``compare``.
        j: see ``compare``.
    """
    here, there = here.as_driven(), there.as_driven()
    n = min(int(here.n_steps[i]), int((_end(there, j) + _EPSILON) / here.time_step) + 1)
    times = np.arange(n, dtype=np.float64) * here.time_step
    found = []
    for e, f in _shared(here, there):
        a, b = _states(here, i, e, times), _states(there, j, f, times)
        off = np.flatnonzero(_apart(a, b) | (a.present != b.present))
        if off.size:
            k = int(off[0])
            x, y = (np.where(b.present, array, np.nan)[k:] for array in (b.x, b.y))
            found.append(Track(here.names[e], k, x, y, b.h[k:]))
    return tuple(found)


def _instants(here: Rollout, there: Rollout, i: int, j: int) -> Float:
    """Return the instants of both rollouts [s], at the coarser time step."""
    # The coarser instants: interpolating the coarse one between them would invent states that no
    # simulator has computed.
    coarse, row = (there, j) if there.time_step > here.time_step else (here, i)
    end = min(_end(here, i), _end(there, j))
    n = min(int(coarse.n_steps[row]), int((end + _EPSILON) / coarse.time_step) + 1)
    times: Float = np.arange(n, dtype=np.float64) * coarse.time_step
    return times


def _end(rollout: Rollout, row: int) -> float:
    return float((rollout.n_steps[row] - 1) * rollout.time_step)


def _shared(here: Rollout, there: Rollout) -> list[tuple[int, int]]:
    """Return the numbers, here and there, of shared entities; the egos' names may differ."""
    others = _paired(here.names[1:], there.names[1:])
    # The ego is the first entity in each simulator, and often has a name of the simulator's own
    # ("hero").
    return [(0, 0), *((e + 1, f + 1) for e, f in others)]


def _paired(ours: Sequence[str], theirs: Sequence[str]) -> list[tuple[int, int]]:
    """Return the positions of equal names; duplicates are matched in order."""
    places: dict[str, list[int]] = {}
    for f, name in enumerate(theirs):
        places.setdefault(name, []).append(f)
    return [(e, places[name].pop(0)) for e, name in enumerate(ours) if places.get(name)]


def _states(rollout: Rollout, row: int, entity: int, times: Float) -> _States:
    """Return an entity's states at given instants, interpolated between those of the rollout."""
    at = times / rollout.time_step
    before = np.minimum(np.floor(at + _EPSILON).astype(np.int64), int(rollout.n_steps[row]) - 1)
    rest = np.where(at - before > _EPSILON, at - before, 0.0)
    after = np.minimum(before + 1, int(rollout.n_steps[row]) - 1)

    def of(array: Float) -> Float:
        item = array[row, entity]
        if not rest.any():
            exact: Float = item[before]
            return exact
        between: Float = item[before] + rest * (item[after] - item[before])
        return between

    present = np.ones(len(times), dtype=np.bool_)
    if rollout.present.size:
        present = rollout.present[row, entity][before]
    return _States(of(rollout.x), of(rollout.y), of(rollout.h), of(rollout.v), present)


def _gap(a: _States, b: _States) -> Float:
    gap: Float = np.where(a.present & b.present, np.hypot(b.x - a.x, b.y - a.y), 0.0)
    return gap


def _apart(a: _States, b: _States) -> Bool:
    apart: Bool = _gap(a, b) > TRACE
    return apart


def _lasting(differs: Bool) -> Bool:
    """Return where something differs at an instant and at the one before."""
    lasting: Bool = differs.copy()
    lasting[0] = False
    # For two instants: simulators differ by one in when an event begins, which is their rule and no
    # divergence.
    lasting[1:] &= differs[:-1]
    return lasting


def _parting(entity: str, a: _States, b: _States, times: Float) -> EntityDivergence | None:
    gap, alone = _gap(a, b), a.present != b.present
    off = np.flatnonzero((gap > DIVERGED) | _lasting(alone))
    if not off.size:
        return None
    k = int(off[0])
    trace = np.flatnonzero(~((gap > TRACE) | alone)[: k + 1])  # where it did not deviate yet
    since = float(times[trace[-1] + 1 if trace.size else 0])
    off_by = _off_by(a, b, k)
    return EntityDivergence(
        entity,
        float(times[k]),
        gap=off_by.gap,
        along=off_by.along,
        across=off_by.across,
        speed=off_by.speed,
        turn=off_by.turn,
        since=since,
        only=off_by.only,
    )


def _diverged(
    pairs: Sequence[tuple[str, _States, _States]], times: Float, closest: Approach
) -> tuple[Divergence, ...]:
    """Return the entities that deviate by more than TRACE up to the closest approach, in order."""
    n = int(np.searchsorted(times, closest.time + _EPSILON))
    found = []
    for name, a, b in pairs:
        gap, alone = _gap(a, b)[:n], _lasting(a.present != b.present)[:n]
        off = np.flatnonzero((gap > TRACE) | alone)
        if not off.size:
            continue
        k = int(np.flatnonzero(alone)[0] if alone.any() else gap.argmax())
        off_by = _off_by(a, b, k)
        found.append(
            Divergence(
                name,
                since=float(times[off[0]]),
                time=float(times[k]),
                gap=off_by.gap,
                along=off_by.along,
                across=off_by.across,
                speed=off_by.speed,
                turn=off_by.turn,
                only=off_by.only,
            )
        )
    return tuple(sorted(found, key=lambda divergence: divergence.since))


def _off_by(a: _States, b: _States, k: int) -> _OffBy:
    """Return how an entity differs at an instant."""
    if a.present[k] != b.present[k]:
        return _OffBy(only="here" if a.present[k] else "there")
    dx, dy = float(b.x[k] - a.x[k]), float(b.y[k] - a.y[k])
    cos, sin = float(np.cos(a.h[k])), float(np.sin(a.h[k]))
    return _OffBy(
        gap=float(_gap(a, b)[k]),
        along=dx * cos + dy * sin,
        across=dy * cos - dx * sin,
        speed=float(b.v[k] - a.v[k]),
        turn=_turn(a, b, k),
    )


def _offsets(
    pairs: Sequence[tuple[str, _States, _States]], times: Float, first: EntityDivergence
) -> tuple[Offset, ...]:
    """Return the deviations of other entities when the first one diverged, largest first."""
    k = int(np.searchsorted(times, first.time - _EPSILON))
    gaps = [(name, float(_gap(a, b)[k])) for name, a, b in pairs if name != first.entity]
    off = [Offset(name, gap) for name, gap in gaps if gap > SLIGHT]
    return tuple(sorted(off, key=lambda offset: -offset.gap))


def _turn(a: _States, b: _States, k: int) -> float | None:
    """Return the angle between two directions of travel at an instant; None if one stands."""
    if k == 0 or not (a.present[k - 1] and b.present[k - 1]):
        return None
    (ax, ay), (bx, by) = ((float(s.x[k] - s.x[k - 1]), float(s.y[k] - s.y[k - 1])) for s in (a, b))
    if min(math.hypot(ax, ay), math.hypot(bx, by)) < STANDS:
        return None
    return math.atan2(ax * by - ay * bx, ax * bx + ay * by)


def first_contact(rollout: Rollout, row: int) -> Contact | None:
    """Return the ego's first contact in a row that has not failed, or None."""
    distance = rollout.distance[row, :, : rollout.n_steps[row]]
    instants = np.flatnonzero((distance <= 0.0).any(axis=0))
    if not instants.size:
        return None
    k = int(instants[0])
    return Contact(k * rollout.time_step, rollout.names[int(distance[:, k].argmin())])


def closest_approach(rollout: Rollout, row: int, partner: str = "") -> Approach | None:
    """Return the ego's closest approach in a row that has not failed; None if it is alone.

    Args:
        rollout: with the ego first.
        row: of it.
        partner: the other entity; the closest one if it does not take part.
    """
    distance = rollout.distance[row, :, : rollout.n_steps[row]]
    other = rollout.names.index(partner) if partner in rollout.names[1:] else None
    distance = distance if other is None else distance[other : other + 1]
    least = distance.min(axis=0)
    if not np.isfinite(least).any():
        return None
    k = first_closest(least)
    e = int(distance[:, k].argmin()) if other is None else other
    return Approach(k * rollout.time_step, rollout.names[e], float(least[k]))


def _events(here: Rollout, there: Rollout, i: int, j: int, step: float) -> tuple[EventTimes, ...]:
    end = min(_end(here, i), _end(there, j))
    found = []
    for u, w in _paired(here.event_names, there.event_names):
        a, b = _began(here, i, u), _began(there, j, w)
        if a is not None and b is not None:
            differs = abs(b - a) > step + _EPSILON
        else:  # an event after the end of the other rollout is no difference
            begun = [value for value in (a, b) if value is not None]
            differs = any(value < end - step - _EPSILON for value in begun)
        if differs:
            found.append(EventTimes(here.event_names[u], a, b))
    return tuple(sorted(found, key=lambda times: times.first))


def _began(rollout: Rollout, row: int, event: int) -> float | None:
    k = int(rollout.began[row, event])
    return None if k < 0 else k * rollout.time_step


def _lights(here: Rollout, there: Rollout, i: int, j: int, times: Float) -> tuple[LightTimes, ...]:
    found = []
    for s, w in _paired(here.light_names, there.light_names):
        a, b = _shown(here, i, s, times), _shown(there, j, w, times)
        lasting = np.flatnonzero(_lasting(a != b))
        if lasting.size:
            k = int(lasting[0]) - 1
            found.append(LightTimes(here.light_names[s], float(times[k]), int(a[k]), int(b[k])))
    return tuple(sorted(found, key=lambda light_times: light_times.time))


def _shown(rollout: Rollout, row: int, light: int, times: Float) -> npt.NDArray[np.int8]:
    at = np.floor(times / rollout.time_step + _EPSILON).astype(np.int64)
    states: npt.NDArray[np.int8] = rollout.lights[row, light][at]
    return states


def _boxes(
    here: Rollout, there: Rollout, bodies: Sequence[tuple[int, int]]
) -> tuple[BoxSizes, ...]:
    found = []
    for e, f in bodies:
        if np.abs(here.box[e] - there.box[f]).max() > SAME_BOX:
            (a, b, c), (p, q, r) = here.box[e].tolist(), there.box[f].tolist()
            found.append(BoxSizes(here.names[e], (a, b, c), (p, q, r)))
    return tuple(found)
