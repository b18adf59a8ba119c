"""What the participants' behaviour brought about in a rollout: collisions.

Paper, Section III-B: layer 4 brings about layer 3; for queues see `bridgegen.simulation.queues`.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Bool, Float
from bridgegen.simulation.boxes import box_distance
from bridgegen.simulation.rollout import Rollout

MERGE_WITHIN = 5.0
"""Time within which contacts of the same two are one accident [s], as in the metric n_collision."""


@dataclass(frozen=True)
class Accident:
    """A collision.

    Attributes:
        time: of its first instant [s].
        x: of the middle of the overlap then [m].
        y: [m].
        who: the two, in the rollout's order.
    """

    time: float
    x: float
    y: float
    who: tuple[str, str]


def accidents(rollout: Rollout, row: int, standing: Iterable[str] = ()) -> tuple[Accident, ...]:
    """Return the collisions of any two entities, in the order of time.

    Args:
        rollout: N scenarios.
        row: which of them; it must not have failed.
        standing: names of entities that are part of the road; two such do not collide.
    """
    still = set(standing)
    e = rollout.shape[1]
    order = sorted(range(e), key=lambda k: rollout.names[k] in still)
    moving = sum(name not in still for name in rollout.names)
    steps = int(rollout.n_steps[row])
    within = round(MERGE_WITHIN / rollout.time_step)
    found: list[Accident] = []
    for k in range(min(moving, e - 1)):
        rest = order[k:]
        x, y, h = (array[[row]][:, rest, :steps] for array in (rollout.x, rollout.y, rollout.h))
        gaps = box_distance(rollout.box[rest], x, y, h, np.array([steps]))[0, 1:]
        contact = gaps <= 0.0
        for i, other in enumerate(rest[1:]):
            if rollout.coupled(rest[0], other):
                contact[i] = False
        if rollout.present.size:
            there = rollout.present[row, rest, :steps]
            contact &= there[:1] & there[1:]
        for other, first in _beginnings(contact, within):
            a, b = sorted((rest[0], rest[1 + other]))
            px, py = _middle(_corners(rollout, row, a, first), _corners(rollout, row, b, first))
            who = (rollout.names[a], rollout.names[b])
            found.append(Accident(round(first * rollout.time_step, 9), px, py, who))
    return tuple(sorted(found, key=lambda accident: (accident.time, accident.who)))


def _beginnings(contact: Bool, within: int) -> list[tuple[int, int]]:
    """Return row and first step of each contact that none precedes within some steps.

    Args:
        contact: ``(K, T)`` bool.
        within: that many steps.
    """
    steps = np.arange(contact.shape[1])
    last = np.maximum.accumulate(np.where(contact, steps, -within - 1), axis=1)
    before = np.full_like(last, -within - 1)
    before[:, 1:] = last[:, :-1]
    rows, first = np.nonzero(contact & (steps - before > within))
    return list(zip(rows.tolist(), first.tolist(), strict=True))


def _corners(rollout: Rollout, row: int, entity: int, step: int) -> Float:
    """Return the corners of an entity's box, counter-clockwise; ``(4, 2)`` float64 [m]."""
    length, width, ahead = rollout.box[entity]
    h = float(rollout.h[row, entity, step])
    along, across = np.array([1, -1, -1, 1]), np.array([1, 1, -1, -1])
    u, v = ahead + 0.5 * length * along, 0.5 * width * across
    x = rollout.x[row, entity, step] + u * elementary.cos(h) - v * elementary.sin(h)
    y = rollout.y[row, entity, step] + u * elementary.sin(h) + v * elementary.cos(h)
    return np.column_stack([x, y])


def _middle(array: Float, other: Float) -> tuple[float, float]:
    """Return the mean corner of where two boxes overlap; of boxes that touch, of where they do."""
    overlap = [tuple(point) for point in array.tolist()]
    for a, b in zip(other.tolist(), np.roll(other, -1, axis=0).tolist(), strict=True):
        overlap = list(_left_of(overlap, a, b))
    # where they touch along a side, its ends come twice
    overlap = list({(round(x, 6), round(y, 6)): (x, y) for x, y in overlap}.values())
    corners = np.array(overlap) if overlap else np.array([array.mean(axis=0), other.mean(axis=0)])
    x, y = corners.mean(axis=0).tolist()
    return x, y


def _left_of(
    polygon: Sequence[tuple[float, ...]], a: Sequence[float], b: Sequence[float]
) -> Iterator[tuple[float, float]]:
    """Yield the corners of a polygon's part left of a line (Sutherland and Hodgman, 1974)."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    sides = [dx * (y - a[1]) - dy * (x - a[0]) for x, y in polygon]
    slack = 1e-9 * (dx * dx + dy * dy)
    for k, (x, y) in enumerate(polygon):
        before = k - 1
        if (sides[k] > slack) != (sides[before] > slack) and sides[k] != sides[before]:
            share = sides[before] / (sides[before] - sides[k])
            u, v = polygon[before]
            yield u + share * (x - u), v + share * (y - v)
        if sides[k] >= -slack:
            yield x, y
