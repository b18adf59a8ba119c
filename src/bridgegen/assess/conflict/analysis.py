"""The conflict analysis of rollouts: conflicts of the ego with each other participant."""

from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from bridgegen.assess.conflict import _codes as codes
from bridgegen.assess.conflict._codes import CONTACT, COURSE, NEAR_MISS, NO_CONFLICT, VIOLATION
from bridgegen.assess.conflict.types import ConflictType, Responsible, Rule, Zone
from bridgegen.assess.metrics.metric import motion, recorded, shared
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.simulation.rollout import Rollout

WHOLES = {
    "kind": codes.KIND,
    "type": codes.TYPE,
    "responsible": codes.RESPONSIBLE,
    "rule": codes.RULE,
    "instant": codes.INSTANT,
    "decided": codes.DECIDED,
    "zone_ego": codes.ZONE_EGO,
    "zone_other": codes.ZONE_OTHER,
}
IS_SO = {"leads_ego": codes.LEADS_EGO, "preventable": codes.PREVENTABLE}
NUMBERS = {
    "ttc": codes.TTC,
    "needed": codes.NEEDED,
    "closing_normal": codes.ACROSS,
    "closing_tangential": codes.ALONG,
    "v_ego": codes.V_EGO,
    "v_other": codes.V_OTHER,
    "stood_ego": codes.STOOD_EGO,
    "stood_other": codes.STOOD_OTHER,
    "overlap": codes.OVERLAP,
    "left": codes.LEFT_TO_ACT,
    "nearness": codes.NEARNESS,
}
"""Columns of kernels by the name in `Conflicts`: whole numbers, truths, and numbers."""


@dataclass(frozen=True)
class Conflicts:
    """The conflicts of N scenarios, pair by pair; the ego is entity 0.

    Its own column has departures from its lane or from the road, which need no other participant.

    Only events up to the ego's first contact count. Two bodies are on a collision course if two
    predictions agree that they touch within 4 s: constant velocity, and constant speed along the
    paths that both drive in the rollout (straight on beyond their ends). Where paths do not meet,
    passing is no conflict, however near. A near miss is a collision course with at most 1.5 s left
    and a needed deceleration of at least 3.35 m/s², which is more than a comfort function has (ISO
    15622), or after which they come nearer than 0.5 m. Of all instants of a collision course the
    most urgent one counts, near misses first; see ``harm``. Types, zones and responsibility exist
    for near misses and contacts only.

    Attributes:
        names: E participants.
        time_step: [s].
        kind: ``(N, E)`` NO_CONFLICT, COURSE, NEAR_MISS, CONTACT or VIOLATION.
        type: ``(N, E)`` of `ConflictType`.
        responsible: ``(N, E)`` of `Responsible`.
        rule: ``(N, E)`` of `Rule`.
        instant: ``(N, E)`` of contact, or the most urgent of the collision course.
        decided: ``(N, E)`` instant at which the risk arose that decides on responsibility.
        zone_ego: ``(N, E)`` of `Zone`, on the ego.
        zone_other: ``(N, E)`` of `Zone`, on the other.
        leads_ego: ``(N, E)`` bool: they meet at the end of the ego that is ahead as it drives, or
            at its side within 15 % of its length from there.
        preventable: ``(N, E)`` bool: the careful driver of UN R157, Annex 3 (0.75 s, 0.774 g, or
            what the tyres give on this road), braking on the ego's path since the other was
            visibly in its way (or since the vehicle ahead braked), would have avoided the contact,
            or the near miss.
        ttc: ``(N, E)`` [s], time to collision at ``instant``; 0 of a contact, +inf without a
            conflict.
        needed: ``(N, E)`` [m/s²], the deceleration that the ego needed then; of a contact, as if
            one time step had been left.
        closing_normal: ``(N, E)`` [m/s], closing speed across the surfaces that meet.
        closing_tangential: ``(N, E)`` [m/s], along them.
        v_ego: ``(N, E)`` [m/s], speed of the ego then; just before a contact.
        v_other: ``(N, E)`` [m/s], of the other.
        stood_ego: ``(N, E)`` [s], how long the ego had been standing.
        stood_other: ``(N, E)`` [s], likewise of the other.
        overlap: ``(N, E)``, share of the ego's extent across the contact's normal that meets.
        left: ``(N, E)`` [s], from the instant ``decided`` to the contact, or the predicted one.
        nearness: ``(N, E)`` in [0, 1], closeness at constant velocity; see
            ``_conflict_kernels.nearness``.
        severity: ``(N, E)`` probability of MAIS3+ of the party at the higher risk; 0 unless they
            touch.
        potential: ``(N, E)`` likewise, of a near miss too, as if they had touched as predicted.
        delta_v_ego: ``(N, E)`` [m/s], change of the ego's velocity; 0 unless they touch.
        delta_v_other: ``(N, E)`` [m/s], of the other's.
        ok: ``(N,)`` bool, False where the scenario failed; its rows are empty.
        aside: ``(N, E)`` [m], of a departure how far the rear axle was beyond the border of its
            lanes, or the edge of the road, at most, left positive; of a close pass the clearance;
            else 0.
        breach: ``(N, E)`` in [0, 1], of a violation: 1 where it is a failure; else 0.
        body: ``(N, E)`` which of the ego's bodies it is, 0 or a trailer of its own; or of which
            further vehicle of its driver, whose conflict with the ego is in its own column.
        driven: the numbers of these vehicles.
        left_hand: whether it happened in the mirror image of left-hand traffic.
        country: by whose law it is judged, a code of ISO 3166-1; "" where none is stated.
    """

    names: tuple[str, ...]
    time_step: float
    kind: Int
    type: Int
    responsible: Int
    rule: Int
    instant: Int
    decided: Int
    zone_ego: Int
    zone_other: Int
    leads_ego: Bool
    preventable: Bool
    ttc: Float
    needed: Float
    closing_normal: Float
    closing_tangential: Float
    v_ego: Float
    v_other: Float
    stood_ego: Float
    stood_other: Float
    overlap: Float
    left: Float
    nearness: Float
    severity: Float
    potential: Float
    delta_v_ego: Float
    delta_v_other: Float
    ok: Bool
    body: Int
    aside: Float
    breach: Float
    left_hand: bool = False
    country: str = ""
    driven: tuple[int, ...] = ()

    def parties(self, rows: Int | int, other: Int | int) -> tuple[Int, Int]:
        """Return whose conflict is in a column of rows, and with whom; equal: with no one."""
        body = self.body[rows, other]
        vehicle = np.where(np.isin(body, self.driven), body, 0)
        return vehicle, np.where(other == 0, vehicle, np.where(other == vehicle, 0, other))

    def take(self, at: Int) -> "Conflicts":
        """Return those of some rows."""
        values = {item.name: getattr(self, item.name) for item in fields(self)}
        some: dict[str, Any] = {n: v[at] for n, v in values.items() if isinstance(v, np.ndarray)}
        return replace(self, **some)

    @cached_property
    def at_fault(self) -> Bool:
        """``(N, E)``: the ego has failed.

        It is responsible, alone or with the other; or its front, or in reverse its rear, meets
        another in a contact that it could have prevented.
        """
        from bridgegen.assess.conflict import _conflict_kernels as kernels

        whole = (np.asarray(a, np.int64).ravel() for a in (self.kind, self.type, self.responsible))
        is_so = (np.asarray(a, np.bool_).ravel() for a in (self.leads_ego, self.preventable))
        fault = np.empty(self.kind.shape, np.bool_)
        kernels.faults(*whole, *is_so, fault.reshape(-1))
        return fault


def analyse(rollout: Rollout) -> Conflicts:
    """Return the conflicts of a rollout, computed once: of all vehicles that the driver drives.

    Source: Najm et al., DOT HS 810 767 (types); docs/conflicts.md describes the rules.
    """
    return shared(rollout, _with_violations)


def encounters(rollout: Rollout) -> Conflicts:
    """Return the same without violations: what the ego and another are involved in."""
    return _of_all(rollout, lambda view: shared(view, _analyse))


def _with_violations(rollout: Rollout) -> Conflicts:
    from bridgegen.assess.conflict.violations import with_violations  # which imports this module

    return _of_all(rollout, lambda view: with_violations(view, shared(view, _analyse)))


def _of_all(rollout: Rollout, judge: Callable[[Rollout], Conflicts]) -> Conflicts:
    """Return the conflicts of all vehicles that the driver drives: of each pair the worse one.

    Only events up to the first contact of any of them count: bodies that have met drive on.
    """
    if not rollout.egos:
        return judge(rollout)
    from bridgegen.assess.conflict.harm import harm_of_pairs  # which imports this module

    views, n = (rollout, *rollout.egos), rollout.shape[2] + 1
    touches = [np.any(view.distance <= 0.0, axis=1) for view in views]
    firsts = [np.where(each.any(axis=1), each.argmax(axis=1), n) for each in touches]
    first = np.min(firsts, axis=0)
    found, *parts = (
        judge(replace(view, n_steps=np.minimum(view.n_steps, np.where(first < own, first + 1, n))))
        for view, own in zip(views, firsts, strict=True)
    )
    for part in parts:
        e = rollout.names.index(part.names[0])
        mine, its = harm_of_pairs(found), harm_of_pairs(part)
        worse = (its > mine) | ((its == mine) & (part.kind > found.kind))
        # Where both have failed towards each other, it is the conflict of the one responsible.
        both = (found.at_fault & part.at_fault)[:, e]
        blamed = [(one.responsible == Responsible.EGO)[:, e] for one in (found, part)]
        worse[:, e] = np.where(both & (blamed[0] != blamed[1]), blamed[1], worse[:, e])
        pairs: dict[str, Any] = {
            item.name: np.where(worse, getattr(part, item.name), array)
            for item in fields(found)
            if isinstance(array := getattr(found, item.name), np.ndarray) and array.ndim == 2
        }
        pairs["body"] = np.where(worse, e, found.body)
        found = replace(found, **pairs, driven=(*found.driven, e))
    return found


def analyse_by(rollout: Rollout, kernel: Callable[..., None]) -> Conflicts:
    """Analyse a rollout, and whatever is derived of it from now on, by another kernel.

    Args:
        rollout: not analysed yet.
        kernel: takes what ``_conflict_kernels.analyse_rows`` does, and fills what that does.
    """
    rollout.derived[_analyse] = _analyse(rollout, kernel)
    return analyse(rollout)


def _analyse(rollout: Rollout, kernel: Callable[..., None] | None = None) -> Conflicts:
    own = [e for e in range(rollout.shape[1]) if rollout.is_ego_s(e)]
    if len(own) == 1:
        return _of_one_body(rollout, kernel)
    # Of a tractor and its trailers the worst conflict counts, of two contacts the earlier one.
    found, *more = (_of_one_body(_seen_from(rollout, e, own), kernel) for e in own)
    for e, part in zip(own[1:], more, strict=True):
        worse = part.kind > found.kind
        worse |= (part.kind == found.kind) & (part.kind == CONTACT) & (part.instant < found.instant)
        pairs: dict[str, Any] = {
            name: np.where(worse, getattr(part, name), array)
            for name, array in vars(found).items()
            if isinstance(array, np.ndarray) and array.ndim == 2
        }
        pairs["body"] = np.where(worse, e, found.body)
        found = replace(found, **pairs)
    return found


def _seen_from(rollout: Rollout, e: int, own: list[int]) -> Rollout:
    """Return a rollout in which a body of the ego's stands for it, and its others are absent."""
    there = np.ones(rollout.shape, np.bool_)
    if rollout.present.size:
        there = rollout.present.copy()
    there[:, [number for number in own if number != e]] = False
    order = np.arange(rollout.shape[1])
    order[[0, e]] = e, 0
    swapped = {
        name: getattr(rollout, name)[:, order] for name in ("x", "y", "h", "v", "a", "offset")
    }
    kinds = rollout.kinds[order] if len(rollout.kinds) else rollout.kinds
    return replace(
        rollout,
        **swapped,
        box=rollout.box[order],
        kinds=kinds,
        present=there[:, order],
        towed_by=np.zeros(0, np.int64),
    )


def _of_one_body(rollout: Rollout, kernel: Callable[..., None] | None) -> Conflicts:
    from bridgegen.assess.conflict import _conflict_kernels as kernels

    n, e, t = rollout.shape
    moving = motion(rollout)
    whole = np.zeros((n, e, codes.INTEGERS), dtype=np.int64)
    real = np.zeros((n, e, codes.FLOATS))
    claims = rollout.claims if rollout.claims.size else np.zeros((n, e, e), np.int64)
    crosswalks = rollout.crosswalks
    if not crosswalks.size:
        crosswalks = np.zeros((n, 0, 5))
    # A recording does not state friction: its road counts as dry, and only the driver's braking
    # limits.
    friction = rollout.friction if rollout.friction.size else np.full(n, np.inf)
    lines = rollout.stop_lines if rollout.stop_entities.size else np.zeros((n, 0, 3))
    lights = rollout.lights if len(rollout.lights) else np.zeros((n, 0, 0), np.int8)
    lamps = rollout.lamps if len(rollout.lamps) else np.zeros((n, 0, 0), np.int8)
    kinds = rollout.kinds if rollout.kinds.size else np.zeros(e, np.int64)
    ok = np.asarray(rollout.status) == 0
    real[:, :, codes.TTC] = np.inf
    potential, severity, breach = (np.zeros((n, e)) for _ in range(3))
    changes = np.zeros((n, e, 2))
    reverses = np.zeros((n, 0, 0), np.bool_) if moving.reverses is None else moving.reverses
    (kernel or kernels.analyse_rows)(
        ~ok, moving.half, np.ascontiguousarray(kinds, dtype=np.int64), moving.x, moving.y,
        moving.cosine, moving.sine, moving.v, moving.a, recorded(rollout, "offset"),
        moving.distance, moving.n_steps, rollout.time_step,
        np.ascontiguousarray(claims, dtype=np.int64), np.ascontiguousarray(crosswalks),
        np.ascontiguousarray(friction),
        np.ascontiguousarray(rollout.stop_entities, dtype=np.int64),
        np.ascontiguousarray(rollout.stop_lights, dtype=np.int64), np.ascontiguousarray(lines),
        np.ascontiguousarray(lights, dtype=np.int8), np.ascontiguousarray(lamps, dtype=np.int8),
        _is_routed(rollout), reverses, np.empty((e, t)), whole, real,
        potential, severity, changes, breach,
    )  # fmt: skip
    found: dict[str, Any] = {name: whole[:, :, column] for name, column in WHOLES.items()}
    found |= {name: whole[:, :, column] > 0 for name, column in IS_SO.items()}
    found |= {name: real[:, :, column] for name, column in NUMBERS.items()}
    return Conflicts(
        names=rollout.names,
        time_step=rollout.time_step,
        **found,
        severity=severity,
        potential=potential,
        delta_v_ego=changes[:, :, 0],
        delta_v_other=changes[:, :, 1],
        ok=ok,
        body=np.zeros((n, e), np.int64),
        aside=np.zeros((n, e)),
        breach=breach,
        left_hand=rollout.left_hand,
        country=rollout.country,
    )


def _is_routed(rollout: Rollout) -> bool:
    """Return whether offsets are known: in a rollout on a map, or if a recording has them."""
    return bool(rollout.claims.size) or bool(rollout.offset.any())


__all__ = [
    "CONTACT",
    "COURSE",
    "NEAR_MISS",
    "NO_CONFLICT",
    "VIOLATION",
    "ConflictType",
    "Conflicts",
    "Responsible",
    "Rule",
    "Zone",
    "analyse",
    "encounters",
]
