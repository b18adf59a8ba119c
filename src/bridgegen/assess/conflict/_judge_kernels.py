"""Compiled judgement of one row: what ``analysis.analyse`` finds, of what a simulation recorded.

It takes bundles and allocates nothing, so that it also runs where there is no Python: in a page.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math
from typing import NamedTuple

from bridgegen.assess.conflict._codes import INSTANT, KIND, TTC
from bridgegen.assess.conflict._conflict_kernels import (
    analyse_row,
    fails,
    first_contact,
    name_zones,
    weigh,
)
from bridgegen.assess.conflict._plausibility_kernels import last_conflict
from bridgegen.assess.conflict._violation_kernels import violate
from bridgegen.assess.metrics._kernels import closest_of, place_row, turn_round
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.compiled import kernel
from bridgegen.simulation._box_kernels import directions, leave_out, row_distance


class Facts(NamedTuple):
    """What is the same for all rows of a storyboard on one road network; see `Rollout`.

    Attributes:
        box: ``(E, 3)`` [m].
        half: ``(E, 2)`` half lengths and widths [m].
        kinds: ``(E,)`` of `bridgegen.drivers.kinds`.
        claims: ``(E, E)``.
        crosswalks: ``(C, 5)``.
        stop_entities: ``(L,)``.
        stop_lights: ``(L,)``.
        stop_lines: ``(L, 3)``.
        corridor: ``(S, 8)`` along the ego's first path; without rows where it is unknown.
        time_step: [s].
        after: instants of ``plausibility.AFTER``.
        own_bodies: how many bodies the ego has: 1, and 1 for each trailer.
    """

    box: Float
    half: Float
    kinds: Int
    claims: Int
    crosswalks: Float
    stop_entities: Int
    stop_lights: Int
    stop_lines: Float
    corridor: Float
    time_step: float
    after: int
    own_bodies: int


class Verdict(NamedTuple):
    """What is found of a row, and room for what is worked out on the way.

    Attributes:
        is_judged: ``(1,)``; False where the ego has trailers, and the rest is as it was.
        whole: ``(E, INTEGERS)`` whole numbers of each pair, see ``_codes``,
        real: ``(E, FLOATS)`` and numbers; column 0 of E is of departures.
        potential, severity: ``(E,)``, see `Conflicts`.
        changes: ``(E, 2)`` [m/s], of the velocities of the ego and of the other.
        aside, breach: ``(E,)``.
        at_fault: ``(E,)`` whether the ego has failed.
        distance: ``(E, T)`` [m], from the ego's body; +inf of its own and where one is absent.
        least: ``(1,)`` [m], the least of them; +inf without others.
        instants: ``(2,)`` of the ego's first contact, and that of ``least``; -1 without one.
        until: ``(1,)``, see ``_plausibility_kernels.last_conflict``.
        x, y, cosine, sine, v, a, gone: ``(E, T)`` room; see `Motion` and `Scene`.
        reverses: ``(E, T)`` likewise.
        apart: ``(2, T)`` likewise,
        leave: ``(LEAVINGS,)``, see ``_violation_kernels.violate``,
        over: ``(1,)``,
        passed: ``(PASSINGS,)``,
        gaps: ``(2,)``.
    """

    is_judged: Bool
    whole: Int
    real: Float
    potential: Float
    severity: Float
    changes: Float
    aside: Float
    breach: Float
    at_fault: Bool
    distance: Float
    least: Float
    instants: Int
    until: Int
    x: Float
    y: Float
    cosine: Float
    sine: Float
    v: Float
    a: Float
    gone: Float
    reverses: Bool
    apart: Float
    leave: Int
    over: Float
    passed: Int
    gaps: Float


@kernel
def judge_row(n_steps, status, path, friction, facts, record, verdict):
    """Judge a row that has ended; the last three are bundles.

    Args:
        n_steps: the recorded instants.
        status: 0 of a row that did not fail; else no conflict is found.
        path: that the ego is on at the end, ``State.on[0]``: if it is not its first, no violation
            is found, since the corridor is along that.
        friction: what the tyres could give at the end [m/s²]; +inf where unknown.
        facts: `Facts`.
        record: of this row, see ``_memory_kernels.Record``.
        verdict: `Verdict`; only what is found of this row remains.
    """
    verdict.is_judged[0] = facts.own_bodies == 1
    if facts.own_bodies != 1:
        return
    move(n_steps, facts, record, verdict)
    distance, whole, real = verdict.distance, verdict.whole, verdict.real
    verdict.least[0], verdict.instants[1] = closest_of(distance, n_steps)
    contact = first_contact(distance, n_steps)
    verdict.instants[0] = contact if contact < n_steps else -1
    whole[:] = 0
    real[:] = 0.0
    real[:, TTC] = math.inf
    verdict.potential[:] = 0.0
    verdict.severity[:] = 0.0
    verdict.changes[:] = 0.0
    verdict.aside[:] = 0.0
    verdict.breach[:] = 0.0
    verdict.at_fault[:] = False
    verdict.until[0] = distance.shape[1]
    if status != 0:
        return
    analyse_row(
        facts.half, facts.kinds, verdict.x, verdict.y, verdict.cosine, verdict.sine, verdict.v,
        verdict.a, record.offset, distance, n_steps, facts.time_step, facts.claims,
        facts.crosswalks, friction, facts.stop_entities, facts.stop_lights, facts.stop_lines,
        record.lights, record.lamps, True, verdict.gone, whole, real,
    )  # fmt: skip
    name_zones(verdict.reverses, whole)
    weigh(
        facts.kinds, verdict.v, whole, real, verdict.potential, verdict.severity, verdict.changes,
        verdict.breach,
    )  # fmt: skip
    kind, instant = whole[:, KIND], whole[:, INSTANT]
    verdict.until[0] = last_conflict(kind, instant, facts.after, distance.shape[1])
    if path == 0:
        violate(
            facts.corridor, facts.half, facts.kinds, record.x, record.y, verdict.x, verdict.y,
            verdict.cosine, verdict.sine, verdict.v, record.offset, distance, friction,
            facts.time_step, n_steps, whole, real, verdict.potential, verdict.aside,
            verdict.breach, verdict.leave, verdict.over, verdict.passed, verdict.gaps,
        )  # fmt: skip
    for e in range(len(whole)):
        verdict.at_fault[e] = fails(whole[e])


@kernel
def move(n_steps, facts, record, verdict):
    """Fill the bodies' motion and their distances from the ego."""
    cosine, sine, distance = verdict.cosine, verdict.sine, verdict.distance
    for e in range(len(facts.box)):
        directions(record.h[e], n_steps, cosine[e], sine[e])
    row_distance(
        facts.box, record.x, record.y, cosine, sine, n_steps, verdict.apart[0], verdict.apart[1],
        distance,
    )  # fmt: skip
    if len(record.present):
        leave_out(record.present, 0, distance)
    place_row(facts.box, record.x, record.y, cosine, sine, n_steps, verdict.x, verdict.y)
    for e in range(len(facts.box)):
        for k in range(len(record.v[e])):
            verdict.v[e, k], verdict.a[e, k] = record.v[e, k], record.a[e, k]
        turn_round(cosine[e], sine[e], verdict.v[e], verdict.a[e], verdict.reverses[e])
