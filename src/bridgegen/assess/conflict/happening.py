"""Did it happen? Which events began, who came near the ego, and whether the ego got along.

A search that finds no failure says nothing if the situation that its scenario is about never
occurs. Docs: docs/conflicts.md, "Did it happen?".
"""

import json
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from statistics import median
from typing import Any, Literal, Self

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel

from bridgegen.base import elementary
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.units import percent
from bridgegen.drivers.drivers import DEMAND
from bridgegen.drivers.kinds import IS_OBSTACLE, IS_ON_FOOT
from bridgegen.simulation.rollout import Rollout

NEAR, NEAR_TIME = 5.0, 2.0
"""Largest gap to another that is near: a distance [m], and time of the ego's travel [s]: the
distance that drivers are taught to keep."""

STANDS = 0.5
"""Speed below which the ego stands [m/s]; people walk at 1.4 m/s."""

WITHOUT_REASON = 5.0
"""Time that an ego may stand without a reason [s]; the first driver at a green light takes about 2
s (Highway Capacity Manual, start-up lost time)."""

SAMPLED = 0.25
"""Interval between two instants at which reasons for standing are sought [s]."""

GAP_TIME = 7.5
"""Time to arrival of other traffic within which a driver may wait for it [s]: the gap that cars
accept for a left turn from a stop (AASHTO, A Policy on Geometric Design, case B1)."""

IN_THE_WAY = 10.0
"""Gap to what stands ahead up to which the ego may stand because of it [m]."""

OF_A_JAM = 15.0
"""Largest distance between the centres of two vehicles that stand in a row [m]: the rear one is in
traffic, not parked. A truck and a gap are about as long."""

SIDE = 0.5
"""Lateral margin beside the ego's body within which what is ahead is in its way [m]."""

LIGHT_AHEAD = 20.0
"""Distance to a stop line or a crosswalk ahead up to which the ego may stand because of it [m]."""

_GREEN = 4
_OFF = 0

SELDOM = 0.02
"""Share of the evaluations below which an event, or an encounter, did not happen in a run."""

MOSTLY = 0.5
"""Share of stuck evaluations above which the scenario did not happen: the ego did not get there."""


def happened(rollout: Rollout, *, may_stop: bool = False) -> npt.NDArray[np.object_]:
    """Return what happened in each of N scenarios, as a JSON text; "" of a failed one.

    Keys: ``began``, by event whether it began; ``near``, by participant whether the ego came near
    it; ``met``, by event that moves others whether the ego was near one of them since; ``end``,
    whether the ego is at the end of its route; ``stuck``, see `stuck`: false, or an object with
    ``behind`` (a participant, or null), and ``driven`` and ``left`` [m], rounded. What a simulator
    does not know is absent. All but the last two hold up to the ego's first contact.

    Args:
        rollout: of N scenarios.
        may_stop: whether the scenario is a test of a protocol, which states what its ego has to do.
            It asks to stop for its target, which stands as a parked vehicle does: an ego that ends
            there has done what the test is about. Recorded in the object of ``stuck``.
    """
    n = rollout.shape[0]
    others = [e for e in range(1, rollout.shape[1]) if not rollout.is_ego_s(e)]
    if rollout.kinds.size:  # cones and barriers take no part
        others = [e for e in others if not IS_OBSTACLE[rollout.kinds[e]]]
    # An ego that is struck from behind before anything begins has shown nothing.
    last = _last_judged(rollout)
    at = np.where(rollout.began <= last[:, np.newaxis] + 1, rollout.began, -1)
    began = at >= 0 if len(at) == n else np.zeros((n, 0), np.bool_)
    last_near = np.full((n, rollout.shape[1]), -1)  # the last instant at which each is near
    for view in (rollout, *rollout.egos):
        reach = NEAR + NEAR_TIME * np.abs(view.v[:, 0])
        reach[np.arange(rollout.shape[2]) > _last_judged(view)[:, np.newaxis]] = -1.0
        for e in others:
            is_near = np.where(view.distance[:, e] <= reach, np.arange(rollout.shape[2]), -1)
            last_near[:, e] = np.maximum(last_near[:, e], is_near.max(axis=1))
    near = last_near[:, others] >= 0
    acting = [
        (i, sorted(actors & {*others}))
        for i, actors in enumerate(rollout.event_actors)
        if actors & {*others}
    ]
    met = np.zeros((n, len(acting)), np.bool_)
    for k, (i, actors) in enumerate(acting):
        # Whoever acts is to be met: an ego once came "near" a jam while the scenario's pedestrian
        # crossed 180 m ahead.
        met[:, k] = began[:, i] & (last_near[:, actors].max(axis=1) >= at[:, i])
    code = np.full((n, 4), -1, np.int64)  # at its end; behind whom, metres driven and left
    if known := bool(len(rollout.progress)):
        # A storyboard may end where the ego arrives, before the end of the lane there.
        arrived = (rollout.n_steps < rollout.shape[2]) & ~(rollout.distance <= 0.0).any(axis=(1, 2))
        code[:, 0] = (rollout.progress[:, 1] <= 0.0) | arrived
        rows, behind = stuck(rollout)
        code[rows, 1] = behind
        code[rows, 2:] = np.rint(rollout.progress[rows])
    # Few rows differ: a text is made once for each kind of row, not for each row.
    keys, which = np.unique(np.hstack([began, near, met, code]), axis=0, return_inverse=True)
    names, v = [rollout.names[e] for e in others], began.shape[1]
    w = v + len(names)
    events = _by_name(enumerate(rollout.event_names[:v]))
    moving = _by_name((w + k, rollout.event_names[i]) for k, (i, _) in enumerate(acting))

    def text(key: Sequence[int]) -> str:
        end, behind, driven, left = key[-4:]
        found: dict[str, Any] = {
            "began": {name: any(key[i] for i in at) for name, at in events.items()},
            "near": dict(zip(names, map(bool, key[v:w]), strict=True)),
        }
        if moving:
            found["met"] = {name: any(key[i] for i in at) for name, at in moving.items()}
        if known:
            who = rollout.names[behind] if behind > 0 else None
            where = {"behind": who, "driven": driven, "left": left}
            # A scenario whose criteria alone decide states what the ego has to do; to stop may be
            # right there. Of a test that asks to stop, 24 to 39 of 41 rows were "stuck" before.
            where |= {"may_stop": True} if may_stop else {}
            found |= {"end": bool(end), "stuck": where if behind >= 0 else False}
        return json.dumps(found, ensure_ascii=False, separators=(",", ":"))

    different = np.array([text(key) for key in keys.tolist()], dtype=object)
    texts: npt.NDArray[np.object_] = different[which.reshape(-1)]
    texts[rollout.status != 0] = ""
    return texts


def _by_name(numbered: Iterable[tuple[int, str]]) -> dict[str, list[int]]:
    """Return the numbers of each name; several events may have one."""
    found: dict[str, list[int]] = {}
    for i, name in numbered:
        found.setdefault(name, []).append(i)
    return found


def _last_judged(rollout: Rollout) -> Int:
    """Return the last instant that counts, ``(N,)``: of the ego's first contact, or of all."""
    touches: Bool = np.any(rollout.distance <= 0.0, axis=1)
    first = np.where(touches.any(axis=1), touches.argmax(axis=1), rollout.shape[2])
    found: Int = np.minimum(first, rollout.n_steps - 1)
    return found


def stuck(rollout: Rollout) -> tuple[Int, Int]:
    """Return which egos stand at the end of their scenarios, for no reason, before their routes'.

    An ego is stuck if it stands until the end of the scenario without a contact, and more than
    `WITHOUT_REASON` seconds of that time have no reason. Reasons are: a stop line just ahead whose
    light is not green; someone on foot on a crosswalk just ahead; any participant that comes
    nearer and could be at the ego within `GAP_TIME`; and what stands in the way just ahead, unless
    it is a vehicle or an object that never moves and has no other standing just ahead of it, as in
    a jam: that one is parked, and is to be passed. An ego that does not move at all, until its
    first contact or the end, is stuck whatever the reason; but none is whose driver has demanded a
    transition.

    Args:
        rollout: of N scenarios, with ``progress``.

    Returns:
        The rows ``(K,)``, ascending; and by row the entity that the ego stands behind, 0 if none.
    """
    every = max(round(SAMPLED / rollout.time_step), 1)
    least = WITHOUT_REASON / (every * rollout.time_step)
    last = (rollout.n_steps - 1) // every
    v = rollout.v[:, 0, ::every]
    at = np.arange(v.shape[1])
    there = at <= last[:, np.newaxis]
    idle = there & (at > np.where(there & (np.abs(v) >= STANDS), at, -1).max(axis=1, keepdims=True))
    waits = (rollout.status == 0) & (rollout.progress[:, 1] > 0.0) & (idle.sum(axis=1) > least)
    counts = np.arange(rollout.shape[2]) <= _last_judged(rollout)[:, np.newaxis]
    never_moves = ~(counts & (np.abs(rollout.v[:, 0]) >= STANDS)).any(axis=1)
    never_moves &= (rollout.status == 0) & (rollout.progress[:, 1] > 0.0)
    stands = waits | never_moves
    if len(rollout.transitions):  # it stops because it has left its domain
        stands &= rollout.transitions[:, DEMAND] < 0
    rows = np.flatnonzero(stands)
    if not rows.size:
        return rows, rows
    some, idle, there, last = _sampled(rollout, rows, every), idle[rows], there[rows], last[rows]
    distance = rollout.distance[:, :, ::every][rows]
    idle[(rollout.distance[rows] <= 0.0).any(axis=(1, 2))] = False
    ahead, aside = _from_ego(some, some.x, some.y)  # (K, E, T)
    width = 0.5 * (some.box[:, 1] + some.box[0, 1])[:, np.newaxis] + SIDE
    blocks = (ahead > 0.0) & (np.abs(aside) <= width) & (distance <= IN_THE_WAY)
    speed = np.abs(some.v)
    still = (speed < STANDS) | ~there[:, np.newaxis]
    never: Bool = np.all(still, axis=2)
    comes = ~still & (distance <= NEAR + GAP_TIME * speed)
    with np.errstate(invalid="ignore"):  # who is absent is infinitely far
        comes[:, :, 1:] &= ~(np.diff(distance, axis=2) >= 0.0)
    parked = never & ~_in_jam(some, never, last)
    if some.kinds.size:
        parked &= ~np.array(IS_ON_FOOT)[some.kinds]
    reason = (comes | (blocks & ~parked[:, :, np.newaxis])).any(axis=1)
    idle &= ~(reason | _red(some) | _crossed(some, distance))
    found = (idle.sum(axis=1) > least) | never_moves[rows]
    gap = np.where(blocks, distance, np.inf)[np.arange(len(rows)), :, last]
    behind = np.where(np.isfinite(gap).any(axis=1), gap.argmin(axis=1), 0)
    return rows[found], behind[found]


def _sampled(rollout: Rollout, rows: Int, every: int) -> Rollout:
    """Return what `stuck` looks at of some rows, at every k-th instant."""
    names = ["x", "y", "h", "v", *(["lights"] if len(rollout.lights) else [])]
    parts: dict[str, Any] = {name: getattr(rollout, name)[:, :, ::every][rows] for name in names}
    for name in ("stop_lines", "crosswalks"):
        if len(array := getattr(rollout, name)):
            parts[name] = array[rows]
    return replace(rollout, **parts)


def _from_ego(rollout: Rollout, x: Float, y: Float) -> tuple[Float, Float]:
    """Return points ``(K, ·, T)`` as the ego sees them: how far ahead and to the left [m]."""
    cosine, sine = elementary.cos(rollout.h[:, :1]), elementary.sin(rollout.h[:, :1])
    dx, dy = x - rollout.x[:, :1], y - rollout.y[:, :1]
    return dx * cosine + dy * sine, dy * cosine - dx * sine


def _in_jam(rollout: Rollout, never: Bool, last: Int) -> Bool:
    """Return ``(K, E)``: who has another that never moves just ahead of it in its lane."""
    rows = np.arange(len(last))
    x, y, h = (values[rows, :, last] for values in (rollout.x, rollout.y, rollout.h))
    dx, dy = x[:, np.newaxis] - x[:, :, np.newaxis], y[:, np.newaxis] - y[:, :, np.newaxis]
    cosine, sine = elementary.cos(h)[:, :, np.newaxis], elementary.sin(h)[:, :, np.newaxis]
    ahead, aside = dx * cosine + dy * sine, np.abs(dy * cosine - dx * sine)
    follows = (ahead > 0.0) & (ahead <= OF_A_JAM) & (aside <= 0.5 * rollout.box[:, 1, np.newaxis])
    found: Bool = np.any(follows & never[:, np.newaxis], axis=2)
    return found


def _red(rollout: Rollout) -> Bool:
    """Return ``(K, T)``: a stop line of the ego's is just ahead, and its light is not green."""
    found = np.zeros((rollout.shape[0], rollout.shape[2]), np.bool_)
    for k in np.flatnonzero(rollout.stop_entities == 0).tolist():
        x, y = (rollout.stop_lines[:, k, axis, np.newaxis, np.newaxis] for axis in range(2))
        ahead, aside = (values[:, 0] for values in _from_ego(rollout, x, y))
        state = rollout.lights[:, rollout.stop_lights[k]]
        close = (ahead > 0.0) & (ahead <= LIGHT_AHEAD) & (np.abs(aside) <= LIGHT_AHEAD)
        found |= close & (state != _GREEN) & (state != _OFF)
    return found


def _crossed(rollout: Rollout, distance: Float) -> Bool:
    """Return ``(K, T)``: someone on foot is on a crosswalk of the ego's, just ahead of it."""
    found = np.zeros((rollout.shape[0], rollout.shape[2]), np.bool_)
    if not (rollout.crosswalks.size and rollout.kinds.size):
        return found
    for e in np.flatnonzero(np.array(IS_ON_FOOT)[rollout.kinds]).tolist():
        for c in range(rollout.crosswalks.shape[1]):
            x, y, h, along, across = rollout.crosswalks[:, c].T[:, :, np.newaxis]
            dx, dy = rollout.x[:, e] - x, rollout.y[:, e] - y
            on = np.abs(dx * elementary.cos(h) + dy * elementary.sin(h)) <= along
            on &= np.abs(dy * elementary.cos(h) - dx * elementary.sin(h)) <= across
            found |= on & (distance[:, e] <= LIGHT_AHEAD)
    return found


class _Stuck(BaseModel, extra="forbid", strict=True):
    """Where an ego is stuck; see `happened`."""

    behind: str | None
    driven: int
    left: int
    may_stop: bool = False


class _Text(BaseModel, extra="forbid", strict=True):
    """A text of `happened`."""

    began: dict[str, bool]
    near: dict[str, bool]
    met: dict[str, bool] = {}
    end: bool | None = None
    stuck: _Stuck | Literal[False] | None = None


@dataclass(frozen=True)
class Share:
    """In how many evaluations something happened.

    Attributes:
        name: of the event, or the participant.
        rows: evaluations in which it happened.
        of: those of which it is known.
    """

    name: str
    rows: int
    of: int

    @property
    def value(self) -> float:
        """Rows / of."""
        return self.rows / self.of


@dataclass(frozen=True)
class Happening:
    """What happened in the evaluations of a run that have a result.

    Attributes:
        rows: how many these are; 0 of a run that recorded nothing of it.
        events: of the storyboard: where each began.
        near: the participants: where the ego came near each.
        met: the events that move others: where the ego was near one of these since it began.
        end: where the ego reached the end of its route; None where this is unknown.
        stuck: how many egos are stuck; None where this is unknown.
        may_stop: of these, how many are in a test of a protocol, see `happened`.
        behind: the participant that most of these stand behind; "" if there is none.
        driven: [m] that they drove, the median; NaN without any.
        left: [m] that was left of their routes.
        domain: a sentence if the ego's driver says that it is not made for this scenario, else "".
    """

    rows: int
    events: tuple[Share, ...] = ()
    near: tuple[Share, ...] = ()
    met: tuple[Share, ...] = ()
    end: Share | None = None
    stuck: int | None = None
    may_stop: int = 0
    behind: str = ""
    driven: float = float("nan")
    left: float = float("nan")
    domain: str = ""

    @classmethod
    def of(cls, texts: Iterable[str], domain: str = "") -> Self:
        """Return what happened, from the texts of `happened`.

        Raises:
            ValueError: a text is something else.
        """
        counts = Counter(text for text in texts if text)
        found = [(_Text.model_validate_json(text), rows) for text, rows in counts.items()]
        ends = [(item.end, rows) for item, rows in found if item.end is not None]
        stuck = [(item.stuck, rows) for item, rows in found if item.stuck]
        behind = Counter[str]()
        driven, left = list[int](), list[int]()
        for item, rows in stuck:
            behind[item.behind or ""] += rows
            driven += [item.driven] * rows
            left += [item.left] * rows
        who, most = behind.most_common(1)[0] if stuck else ("", 0)
        return cls(
            rows=sum(counts.values()),
            events=_shares([(item.began, rows) for item, rows in found]),
            near=_shares([(item.near, rows) for item, rows in found]),
            met=_shares([(item.met, rows) for item, rows in found]),
            end=_share("end", ends) if ends else None,
            stuck=len(driven) if ends else None,
            may_stop=sum(rows for item, rows in stuck if item.may_stop),
            behind=who if 2 * most > len(driven) else "",
            driven=median(driven) if stuck else float("nan"),
            left=median(left) if stuck else float("nan"),
            domain=domain,
        )

    @property
    def happened(self) -> bool:
        """Whether what the scenario is about happened; True where nothing is known."""
        return not self.reasons

    @cached_property
    def reasons(self) -> tuple[str, ...]:
        """Why it did not happen, a clause each."""
        seldom = [event for event in self.events if event.value < SELDOM]
        if self.rows * SELDOM < 1.0 and len(seldom) < len(self.events):
            seldom = []  # too few to call one event of several seldom
        found = [
            f"the event {share.name} began in {share.rows} of {share.of} evaluations"
            for share in seldom
        ]
        if self.near and all(share.value < SELDOM for share in self.near):
            most = max(self.near, key=lambda share: share.rows)
            rows = f"{most.rows} of {most.of} evaluations"
            found.append(f"no participant came near the ego in more than {rows}")
        elif self.met and all(share.value < SELDOM for share in self.met) and not found:
            most = max(self.met, key=lambda share: share.rows)
            rows = f"{most.rows} of {most.of} evaluations"
            found.append(f"a participant that acts came near the ego in at most {rows}")
        if self.stuck is not None and self.stuck - self.may_stop > MOSTLY * self.rows:
            found.append(self.stuck_in_words)
        return tuple(found)

    @property
    def stuck_in_words(self) -> str:
        """How many egos are stuck, where and how far they got; "" without any."""
        if not self.stuck:
            return ""
        behind = f"stands behind {self.behind}, " if self.behind else ""
        way = f"{self.driven:.0f} m of {self.driven + self.left:.0f} m driven"
        return f"stuck in {self.stuck} of {self.rows}: {behind}{way}"

    @property
    def sentence(self) -> str:
        """All of it in a sentence; "" where nothing is known."""
        if not self.rows:
            return self.domain
        if not self.happened:
            why = "did not happen: " + "; ".join(self.reasons)
            return "; ".join(filter(None, [why, self.domain]))
        parts = []
        if self.events:
            parts.append("began: " + ", ".join(map(_in_words, self.events)))
        if self.near:
            parts.append("came near the ego: " + ", ".join(map(_in_words, self.near)))
        if self.end is not None and (self.end.rows or self.stuck):
            parts.append(f"the ego reached its end in {percent(self.end.value)}")
        return "; ".join(filter(None, [*parts, self.stuck_in_words, self.domain]))


def _in_words(share: Share) -> str:
    return f"{share.name} {percent(share.value)}"


def _share(name: str, found: Iterable[tuple[bool, int]]) -> Share:
    known = list(found)
    return Share(name, sum(rows for yes, rows in known if yes), sum(rows for _, rows in known))


def _shares(found: Sequence[tuple[dict[str, bool], int]]) -> tuple[Share, ...]:
    names = dict.fromkeys(name for record, _ in found for name in record)
    return tuple(
        _share(name, ((record[name], rows) for record, rows in found if name in record))
        for name in names
    )
