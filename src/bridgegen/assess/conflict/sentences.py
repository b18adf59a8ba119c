"""A conflict in one sentence: the parties, responsibility, its rule, and the time left.

The sentence depends on the numbers of `Conflicts` alone.
"""

from bridgegen.assess.conflict._limits import HORIZON
from bridgegen.assess.conflict.analysis import (
    CONTACT,
    COURSE,
    NEAR_MISS,
    NO_CONFLICT,
    VIOLATION,
    Conflicts,
)
from bridgegen.assess.conflict.types import RULES, ConflictType, Responsible, Rule, Zone
from bridgegen.base.physics import CAREFUL_BRAKING_G, CAREFUL_REACTION

_BEARS = {
    Responsible.EGO: "the ego is responsible: it {rule}",
    Responsible.OTHER: "{other} is responsible: it {rule}",
    Responsible.SHARED: "both are responsible: the ego {rule}",
    Responsible.NONE: "neither is responsible: {rule}",
}

_BRAKING = (
    f"a driver who brakes {CAREFUL_REACTION:g} s later with {CAREFUL_BRAKING_G:g} g, or as hard as "
    "the road allows (UN R157, Annex 3),"
)

_BY_NEITHER = {
    Rule.STEPPED_OUT: "{other} came into the path when stopping was no longer possible",
    Rule.LEFT_ITS_LANE: "neither has changed its course",
    Rule.INTO_THE_SIDE: "{other} moved into the side of the ego",
}
"""The rule where neither is responsible, if its own description is of a fault."""

_BY_BOTH = {
    Rule.RED_LIGHT: "they crossed their stop lines at red",
    Rule.TURNING_GIVES_WAY: "both turned",
}


_CROSSINGS = (ConflictType.CROSSING, ConflictType.TURNING)


def sentence(conflicts: Conflicts, row: int, other: int) -> str:
    """Return one English sentence on the conflict of the ego and another participant.

    It is empty where there is none.

    Args:
        conflicts: of N scenarios and E participants.
        row: of the scenario.
        other: the other participant, 1 to E − 1; 0 for a departure of the ego's.

    Raises:
        IndexError: there is no such row or participant.
    """
    n, e = conflicts.kind.shape
    if not 0 <= row < n or not 0 <= other < e:
        raise IndexError(
            f"row must be 0 to {n - 1} and other 0 to {e - 1}, got row={row}, other={other}"
        )
    name = f"'{conflicts.names[other]}'"
    kind = conflicts.kind[row, other]
    if kind == NO_CONFLICT:
        return ""
    if kind == COURSE:
        return (
            f"The ego and {name} were on a collision course with "
            f"{conflicts.ttc[row, other]:.1f} s left, which needed "
            f"{conflicts.needed[row, other]:.1f} m/s² of braking."
        )
    parts = [_event(conflicts, row, other, name), _responsibility(conflicts, row, other, name)]
    if kind != VIOLATION:
        parts.append(_time_left(conflicts, row, other))
    return "; ".join(part for part in parts if part) + "."


def avoidance(conflicts: Conflicts, row: int, other: int) -> str:
    """Return the end of `sentence` that says whether braking would have helped; "" without one."""
    if conflicts.kind[row, other] not in (NEAR_MISS, CONTACT):
        return ""
    _, _, said = _time_left(conflicts, row, other).partition(", and ")
    return f", and {said}" if said else ""


def _event(conflicts: Conflicts, row: int, other: int, name: str) -> str:
    """Return the event, with the edges that meet and the speed."""
    closing = conflicts.closing_normal[row, other]
    own = Zone(int(conflicts.zone_ego[row, other])).label
    mine, whole = f"ego's {own}", "the ego"
    if conflicts.body[row, other] > 0:
        mine, whole = f"{own} of the ego's trailer", "the ego's trailer"
    its = Zone(int(conflicts.zone_other[row, other])).label
    kind = ConflictType(int(conflicts.type[row, other]))
    if conflicts.kind[row, other] == VIOLATION:
        aside, v = conflicts.aside[row, other], conflicts.v_ego[row, other]
        if kind == ConflictType.CLOSE_PASS:
            return f"The ego passed {name} at {v:.1f} m/s, {aside:.2f} m beside it"
        left = "the road" if kind == ConflictType.ROAD_DEPARTURE else "its lane"
        side = "left" if aside > 0.0 else "right"
        return f"The ego left {left} by {abs(aside):.1f} m to the {side} at {v:.1f} m/s"
    if conflicts.kind[row, other] == NEAR_MISS:
        return (
            f"The {mine} came within {conflicts.ttc[row, other]:.1f} s of the {its} of {name} "
            f"at {closing:.1f} m/s closing speed, which needed "
            f"{conflicts.needed[row, other]:.1f} m/s² of braking"
        )
    speed, strikes = f"at {closing:.1f} m/s closing speed", "struck"
    if closing < 0.05:  # m/s
        speed, strikes = "without closing on it", "touched"
    if kind == ConflictType.EGO_STANDING:
        stood = conflicts.stood_ego[row, other]
        return (
            f"The {its} of {name} {strikes} the {own} of {whole}, which had stood for "
            f"{stood:.1f} s, {speed}"
        )
    by_other = kind in (ConflictType.REAR_END_STRUCK, ConflictType.VRU_INTO_SIDE)
    if by_other or (kind in _CROSSINGS and "front" in its and "front" not in own):
        return f"The {its} of {name} {strikes} the {mine} {speed}"
    verb = "met" if kind == ConflictType.SIDE_SWIPE and strikes == "struck" else strikes
    return f"The {mine} {verb} the {its} of {name} {speed}"


def _responsibility(conflicts: Conflicts, row: int, other: int, name: str) -> str:
    """Return the responsible party, the rule, and its source."""
    who = Responsible(int(conflicts.responsible[row, other]))
    rule = Rule(int(conflicts.rule[row, other]))
    words, source = RULES[rule]
    if who == Responsible.NONE:
        words = _BY_NEITHER.get(rule, words).format(other=name)
    elif who == Responsible.SHARED and rule in _BY_BOTH:
        return f"both are responsible: {_BY_BOTH[rule]} ({source})"
    words = words.replace("the other", "the ego" if who == Responsible.OTHER else name)
    return f"{_BEARS[who].format(rule=words, other=name)} ({source})"


def _time_left(conflicts: Conflicts, row: int, other: int) -> str:
    """Return when the risk arose, and whether braking then would have avoided the event."""
    kind = ConflictType(int(conflicts.type[row, other]))
    rule = Rule(int(conflicts.rule[row, other]))
    by_others = (
        ConflictType.EGO_STANDING, ConflictType.REAR_END_STRUCK, ConflictType.SIDE_SWIPE,
        ConflictType.VRU_INTO_SIDE,
    )  # fmt: skip
    left = conflicts.left[row, other]
    arose = f"the risk arose {left:.1f} s before"
    if rule == Rule.STANDING_AHEAD and left > HORIZON:
        arose = f"it stood there, hidden by no other participant, for the last {left:.1f} s"
    if rule == Rule.UNSAFE_START or kind == ConflictType.EGO_STANDING:
        return ""
    blamed = conflicts.responsible[row, other] == Responsible.EGO
    if kind in by_others and not (blamed and conflicts.preventable[row, other]):
        return arose
    would = "would" if conflicts.preventable[row, other] else "would not"
    avoided = "it" if conflicts.kind[row, other] == CONTACT else "the near miss"
    return f"{arose}, and {_BRAKING} {would} have avoided {avoided}"
