"""Compiled typology of a conflict; the types are those of ``types.ConflictType``."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from bridgegen.assess.conflict._codes import (
    CROSSING,
    EGO_STANDING,
    FRONT,
    FRONT_LEFT,
    FRONT_RIGHT,
    HEAD_ON,
    OBJECT,
    REAR,
    REAR_END_STRIKING,
    REAR_END_STRUCK,
    SIDE_SWIPE,
    TURNING,
    VRU_BY_FRONT,
    VRU_INTO_SIDE,
)
from bridgegen.assess.conflict._geometry_kernels import turned
from bridgegen.assess.conflict._limits import PUSHES, SAME_WAY, TURN_BEGINS, TURN_TIME, TURNS
from bridgegen.base.compiled import kernel
from bridgegen.drivers.kinds import IS_OBSTACLE, IS_VULNERABLE


@kernel
def strikes_with_front(own, own_part):
    """Return whether the ego moves into the other with its front edge or a front corner."""
    return own in (FRONT, FRONT_LEFT, FRONT_RIGHT) and own_part > PUSHES


@kernel
def turning_of(c, s, first, n, k, dt):
    """Return a body's change of heading up to instant k, and until a while later."""
    steps = int(TURN_TIME / dt)
    before = turned(c, s, first, k, steps)
    later = min(k + steps // 2, n - 1)
    return before, before + turned(c, s, k, later, later - k)


@kernel
def is_turning(before, later, limit):
    """Return whether a body turns off: it has turned by more than a limit [rad], or begins to."""
    begins = abs(before) > TURN_BEGINS and before * later > 0.0 and abs(later) > 2.0 * TURNS
    return abs(before) > limit or (begins and abs(later) > limit)


@kernel
def turns(c, s, e, first, n, k, dt):
    """Return whether the ego, and whether body e, turns off; following the same bend is no turn.

    Of two bodies with the same direction throughout, one that changes lane does not turn off, nor
    one that comes round a bend to one that stands there: it would have to leave the direction that
    the other has now.
    """
    steps = int(TURN_TIME / dt)
    j, later = max(k - steps, first), min(k + steps // 2, n - 1)
    now = c[0, k] * c[e, k] + s[0, k] * s[e, k]
    before = c[0, j] * c[e, j] + s[0, j] * s[e, j]
    if now >= SAME_WAY and before >= SAME_WAY:
        item = c[0, later] * c[e, k] + s[0, later] * s[e, k] < SAME_WAY
        other = c[e, later] * c[0, k] + s[e, later] * s[0, k] < SAME_WAY
        return item and not other, other and not item
    mine, my_all = turning_of(c[0], s[0], first, n, k, dt)
    its, its_all = turning_of(c[e], s[e], first, n, k, dt)
    item, other = is_turning(mine, my_all, TURNS), is_turning(its, its_all, TURNS)
    if now <= -SAME_WAY and before <= -SAME_WAY and item and other and mine * its < 0.0:
        return False, False
    return item, other


@kernel
def type_of(e, first, n, k, dt, kinds, c, s, own, its, own_part, stood, along):
    """Return the type of the conflict of the ego and body e, which meet after instant k.

    ``own`` and ``its`` are the zones that meet; ``own_part`` [m/s] is the ego's share of the
    closing speed; ``stood`` [s] is how long the ego has been standing; ``along``: both drive on
    lanes that share no junction, so that those in opposite directions follow a bend, and do not
    turn off.
    """
    cosine = c[0, k] * c[e, k] + s[0, k] * s[e, k]
    if stood > 0.0:
        return EGO_STANDING
    if IS_VULNERABLE[kinds[e]]:
        return VRU_BY_FRONT if strikes_with_front(own, own_part) else VRU_INTO_SIDE
    if IS_OBSTACLE[kinds[e]]:
        return OBJECT
    if cosine <= -SAME_WAY and along:
        return HEAD_ON
    mine, theirs = turns(c, s, e, first, n, k, dt)
    if cosine >= SAME_WAY:
        if own == REAR or (its == FRONT and own_part <= PUSHES):
            return REAR_END_STRUCK
        if own == FRONT or (its == REAR and own_part > PUSHES):
            return REAR_END_STRIKING
        return TURNING if mine or theirs else SIDE_SWIPE
    if mine or theirs:
        return TURNING
    return HEAD_ON if cosine <= -SAME_WAY else CROSSING
