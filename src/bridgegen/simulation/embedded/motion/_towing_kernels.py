"""Vehicles that are towed: their hitch leads their coupler, and their axle follows it.

The axle of a trailer moves the way that the trailer points; so while its coupler moves in a
straight line, the angle phi from that line to the trailer follows the tractrix:
tan(phi/2) shrinks by exp(-way/length), exactly, whatever the step. Backwards it grows: the trailer
jackknifes.

Source: Lockwood, A Book of Curves (Cambridge 1961), chapter 13.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.simulation.embedded._codes import TOWED, WHOM
from bridgegen.simulation.embedded.motion._follow_kernels import end_quest
from bridgegen.simulation.embedded.motion._presence_kernels import leave, look_round, stay_away
from bridgegen.simulation.embedded.places._lane_kernels import continued, turned
from bridgegen.simulation.embedded.places._place_kernels import (
    end_follow,
    end_lateral,
    put_in_world,
)

HITCH, COUPLER = 0, 1
"""Columns of ``plan.couplings`` for a tractor's hitch and a trailer's coupler."""


@kernel
def drawn(h, dx, dy, length):
    """Return the heading of a trailer whose coupler has moved by (dx, dy) [m].

    Args:
        h: its heading before [rad].
        dx: of its coupler [m].
        dy: of its coupler [m].
        length: from its coupler to its axle [m].
    """
    way = elementary.hypot(dx, dy)
    if way == 0.0:
        return h
    along = elementary.atan2(dy, dx)
    # The exact tractrix of a straight pull gives the same in one step or in ten. esmini aims the
    # old axle at the new hitch, which depends on the step.
    phi = turned(h, along)
    return along + 2.0 * elementary.atan(elementary.tan(0.5 * phi) * elementary.exp(-way / length))


@kernel
def start_towed(plan, roads, state, record):
    """Put the trailers behind what tows them: straight, or towards where they stand.

    One that stands ahead of its hitch would be folded into what tows it: it is straight, too.
    """
    for w in range(plan.tows.shape[0]):
        t, e = plan.tows[w, 0], plan.tows[w, 1]
        if state.tower[e] != t:
            continue
        state.on[e] = -1
        if not state.present[t]:
            state.present[e] = record.present[e, 0] = False
        h, length = record.h[t, 0], plan.couplings[e, COUPLER]
        x = record.x[t, 0] + plan.couplings[t, HITCH] * elementary.cos(h)
        y = record.y[t, 0] + plan.couplings[t, HITCH] * elementary.sin(h)
        if plan.stands_apart[e]:
            apart = elementary.atan2(y - record.y[e, 0], x - record.x[e, 0])
            # A trailer that its file puts ahead of its hitch would be folded into what tows it.
            if abs(turned(apart, h)) <= 0.5 * math.pi:
                h = apart
        record.h[e, 0] = h
        record.x[e, 0], record.y[e, 0] = (
            x - length * elementary.cos(h),
            y - length * elementary.sin(h),
        )
        turn = h - record.h[t, 0]
        record.v[e, 0] = state.command[e] = state.target[e] = record.v[t, 0] * elementary.cos(turn)
        record.offset[e, 0] = 0.0
    look_round(state)


@kernel
def tow(k, plan, roads, state, record):
    """Move the trailers to instant k + 1, where what tows them is already.

    They have gone straight on at their speed like all others; that is corrected here.
    """
    last = k == record.x.shape[1] - 1
    for w in range(plan.tows.shape[0]):
        t, e = plan.tows[w, 0], plan.tows[w, 1]
        if state.tower[e] != t:
            continue
        comes = state.present[t] and not state.present[e]
        if state.present[e] and not state.present[t]:
            leave(e, plan, roads, state)  # with what tows it
        if not state.present[t] or last:
            stay_away(e, k, record)
            continue
        state.present[e] = record.present[e, k + 1] = True
        before, length = record.h[e, k], plan.couplings[e, COUPLER]
        h, hitch = record.h[t, k + 1], plan.couplings[t, HITCH]
        x, y = (
            record.x[t, k + 1] + hitch * elementary.cos(h),
            record.y[t, k + 1] + hitch * elementary.sin(h),
        )
        if comes or state.straight[e]:
            mine = h
        else:
            dx = x - record.x[e, k] - length * elementary.cos(before)
            dy = y - record.y[e, k] - length * elementary.sin(before)
            mine = drawn(before, dx, dy, length)
        state.straight[e] = False
        record.h[e, k + 1] = continued(mine, before)
        record.x[e, k + 1], record.y[e, k + 1] = (
            x - length * elementary.cos(mine),
            y - length * elementary.sin(mine),
        )
        yaw = turned(h, record.h[t, k]) / plan.dt
        v = record.v[t, k + 1] * elementary.cos(h - mine) + yaw * hitch * elementary.sin(mine - h)
        was = record.v[e, k]
        record.v[e, k + 1] = state.command[e] = state.target[e] = v
        record.a[e, k], record.offset[e, k + 1] = (v - was) / plan.dt, 0.0
    look_round(state)


@kernel
def begin_connect(j, k, plan, roads, state, record):
    """Begin, and end, action j: its entity tows the trailer from instant k on."""
    t, e = plan.actions[j, WHOM], plan.actions[j, TOWED]
    state.action_ended[j] = True
    if not state.present[e]:
        return
    end_lateral(e, state)
    end_follow(e, state)
    end_quest(e, state)
    if state.speed_action[e] >= 0:
        state.action_ended[state.speed_action[e]] = True
        state.speed_action[e] = -1
    for other in range(state.tower.shape[0]):  # a vehicle tows one trailer
        if state.tower[other] == t and other != e:
            release(other, k, roads, state, record)
    state.tower[e], state.on[e] = t, -1
    look_round(state)


@kernel
def begin_disconnect(j, k, plan, roads, state, record):
    """Begin, and end, action j: the trailer of its entity is on its own from instant k on."""
    state.action_ended[j] = True
    for e in range(state.tower.shape[0]):
        if state.tower[e] == plan.actions[j, WHOM]:
            release(e, k, roads, state, record)


@kernel
def release(e, k, roads, state, record):
    """Uncouple a trailer: it goes on at its speed, the way that it points."""
    state.tower[e] = -1
    look_round(state)
    state.command[e] = state.target[e] = record.v[e, k]
    put_in_world(e, record.x[e, k], record.y[e, k], record.h[e, k], roads, state)
