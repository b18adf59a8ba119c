"""The decisive conflict of one scenario, with all its figures."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isfinite
from typing import Any, Self

from bridgegen.assess.conflict._limits import HORIZON
from bridgegen.assess.conflict.analysis import (
    CONTACT,
    COURSE,
    NEAR_MISS,
    NO_CONFLICT,
    VIOLATION,
    Conflicts,
)
from bridgegen.assess.conflict.findings import KINDS
from bridgegen.assess.conflict.harm import Count, decisive, harm_of_pairs
from bridgegen.assess.conflict.types import RULES, ConflictType, Responsible, Rule, Zone
from bridgegen.base.physics import CAREFUL_BRAKING_G, CAREFUL_REACTION
from bridgegen.scenario.countries import country_of, in_the_mirror

# --- A conflict in one sentence: the parties, responsibility, its rule, and the time left ---
# The sentence depends on the numbers of `Conflicts` alone.


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
    Rule.MISLED: "the ego did not give way, the other indicated a turn and went straight on",
    Rule.NO_PRIORITY: "nobody has priority there by law, and neither gave way",
}


_CROSSINGS = (ConflictType.CROSSING, ConflictType.TURNING)
_STRUCK = (
    ConflictType.REAR_END_STRUCK,
    ConflictType.UNJUSTIFIED_BRAKING,
    ConflictType.VRU_INTO_SIDE,
)


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
    name = f"'{conflicts.names[conflicts.parties(row, other)[1]]}'"
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
    if conflicts.body[row, other] > 0 and not conflicts.parties(row, other)[0]:
        mine, whole = f"{own} of the ego's trailer", "the ego's trailer"
    its = Zone(int(conflicts.zone_other[row, other])).label
    kind = ConflictType(int(conflicts.type[row, other]))
    if conflicts.kind[row, other] == VIOLATION:
        aside, v = conflicts.aside[row, other], conflicts.v_ego[row, other]
        if kind == ConflictType.CLOSE_PASS:
            return f"The ego passed {name} at {v:.1f} m/s, {aside:.2f} m beside it"
        if kind == ConflictType.UNJUSTIFIED_BRAKING:
            needed = conflicts.needed[row, other]
            return (
                f"The ego braked hard at {v:.1f} m/s, and {name} behind it had to brake by "
                f"{needed:.1f} m/s² at least"
            )
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
    by_other = kind in _STRUCK
    # Whose front meets a side strikes: of 401 sentences, 40 once said that the ego's side struck
    # the other's front.
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
    kind = ConflictType(int(conflicts.type[row, other]))
    if who == Responsible.SHARED and (kind in _CROSSINGS or rule == Rule.OBSTRUCTION_WAITS):
        words += f", and {name} drove on although comfortable braking would have done"
    elif who == Responsible.SHARED and kind == ConflictType.UNJUSTIFIED_BRAKING:
        words += f", and {name} was too close or braked late"
    elif who == Responsible.SHARED and kind == ConflictType.SIDE_SWIPE:
        return f"both are responsible: {name} {words}, and the ego could have avoided it ({source})"
    return f"{_BEARS[who].format(rule=words, other=name)} ({source})"


def _time_left(conflicts: Conflicts, row: int, other: int) -> str:
    """Return when the risk arose, and whether braking then would have avoided the event."""
    kind = ConflictType(int(conflicts.type[row, other]))
    rule = Rule(int(conflicts.rule[row, other]))
    by_others = (
        ConflictType.EGO_STANDING,
        ConflictType.SIDE_SWIPE,
        *_STRUCK,
    )
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


CAREFUL_DRIVER = f"the careful driver of UN R157 ({CAREFUL_REACTION:g} s, {CAREFUL_BRAKING_G:g} g)"
"""The driver whose braking decides whether a contact was preventable."""

UNITS: Mapping[str, str] = {
    "time": "s", "decided": "s", "ttc": "s", "needed_deceleration": "m/s²", "left": "s",
    "closing_normal": "m/s", "closing_tangential": "m/s", "v_ego": "m/s", "v_other": "m/s",
    "stood_ego": "s", "stood_other": "s", "overlap": "1", "delta_v_ego": "m/s",
    "delta_v_other": "m/s", "severity": "1", "harm": "1", "aside": "m",
}  # fmt: skip
"""The unit of each number of a summary."""


@dataclass(frozen=True)
class ConflictSummary:
    """A conflict of the ego with one other participant, or a departure of its own.

    A collision course has no type, zones, responsibility or rule: nothing happened.

    Attributes:
        conflict: "contact", "near miss", "violation" or "collision course".
        sentence: the event, in one sentence.
        partner: name of the other participant; "" of a departure.
        type: label of its `ConflictType`; empty of a collision course, as are all texts below.
        type_source: the typology's name for the type.
        responsible: label of `Responsible`.
        rule: label of the `Rule` that decides.
        rule_says: the rule's statement on the responsible party.
        rule_source: source of the rule.
        zone_ego: edge or corner of the ego that meets the other.
        zone_other: of the other.
        preventable: whether the careful driver of UN R157 would have avoided it; None of a
            violation.
        time: of contact, or of the least time to collision [s].
        decided: when the risk arose that decides on responsibility [s].
        left: from then to the contact, or the predicted one [s].
        ttc: least time to collision [s]; 0 of a contact.
        needed_deceleration: that the ego needed then [m/s²].
        closing_normal: closing speed across the surfaces that meet [m/s].
        closing_tangential: along them [m/s].
        v_ego: speed of the ego then [m/s].
        v_other: speed of the other then [m/s].
        stood_ego: how long the ego had been standing [s].
        stood_other: how long the other had been standing [s].
        overlap: share of the ego's extent that meets the other.
        delta_v_ego: change of the ego's velocity in the collision [m/s].
        delta_v_other: change of the other's velocity [m/s].
        severity: probability of a MAIS3+ injury.
        harm: in [0, 1], as the row's, but of this conflict alone.
        aside: of a violation, see `Conflicts.aside` [m]; else 0.
        avoidance: the end of ``sentence`` that says whether braking would have avoided it.
        vehicle: name of the further vehicle of the driver whose conflict it is; "" of the ego's.
    """

    conflict: str
    sentence: str
    partner: str
    type: str
    type_source: str
    responsible: str
    rule: str
    rule_says: str
    rule_source: str
    zone_ego: str
    zone_other: str
    preventable: bool | None
    time: float
    decided: float
    left: float
    ttc: float
    needed_deceleration: float
    closing_normal: float
    closing_tangential: float
    v_ego: float
    v_other: float
    stood_ego: float
    stood_other: float
    overlap: float
    delta_v_ego: float
    delta_v_other: float
    severity: float
    harm: float
    aside: float = 0.0
    avoidance: str = ""
    vehicle: str = ""

    @property
    def bare(self) -> str:
        """The sentence without its end on braking."""
        return self.sentence.removesuffix(f"{self.avoidance}.").removesuffix(".")

    def reconciled(self, judgement: str) -> Self:
        """Return the same with the judgement of its finding in place of the end on braking.

        Args:
            judgement: a clause, see `bridgegen.search.triage.judgement`; "" changes nothing.
        """
        if not judgement:
            return self
        return replace(self, sentence=f"{self.bare}; {judgement}.", avoidance=f"; {judgement}")

    @property
    def happened(self) -> bool:
        """Whether it is a contact, a near miss or a violation, not only a collision course."""
        return self.conflict not in ("", KINDS[COURSE])

    def to_dict(self) -> dict[str, Any]:
        """Return everything as JSON's types: texts, None where there is none; numbers with units.

        Values that a conflict does not have are None.
        """
        texts: dict[str, Any] = {}
        for name in (
            "conflict",
            "sentence",
            "partner",
            "type",
            "type_source",
            "responsible",
            "rule",
            "rule_says",
            "rule_source",
            "zone_ego",
            "zone_other",
        ):
            texts[name] = getattr(self, name) or None
        texts |= {"vehicle": self.vehicle} if self.vehicle else {}
        texts["preventable"] = self.preventable if self.happened else None
        return texts | {
            name: {"value": value if isfinite(value) else None, "unit": unit}
            for name, unit in UNITS.items()
            for value in [getattr(self, name)]
        }


def summarise(conflicts: Conflicts, row: int = 0, count: Count = "ego") -> ConflictSummary | None:
    """Return a scenario's decisive conflict; None if it has none, or failed.

    Args:
        conflicts: of N scenarios.
        row: which of them.
        count: whose conflicts decide; see `harm.decisive`.
    """
    others, _ = decisive(conflicts, count)
    other = int(others[row])
    if conflicts.kind[row, other] < COURSE:
        return None
    return of_pair(conflicts, row, other, count)


def of_pair(conflicts: Conflicts, row: int, other: int, count: Count = "ego") -> ConflictSummary:
    """Return the conflict of the ego with one other participant, of which there must be one.

    Args:
        conflicts: of N scenarios.
        row: which of them.
        other: number of the other participant; 0 for a departure of the ego's.
        count: whose conflicts count as harm.
    """
    kind = int(conflicts.kind[row, other])
    rule = Rule(conflicts.rule[row, other])
    happened = kind >= NEAR_MISS
    vehicle, partner = conflicts.parties(row, other)
    said = sentence(conflicts, row, other)
    if vehicle:  # of several egos each is called by its name
        said = re.sub(r"\b([Tt]he ego)\b", rf"\1 {conflicts.names[vehicle]}", said)
    sort = ConflictType(conflicts.type[row, other])

    def number(name: str) -> float:
        return float(getattr(conflicts, name)[row, other])

    numbers = {
        name: number(name)
        for name in (
            "left",
            "ttc",
            "closing_normal",
            "closing_tangential",
            "v_ego",
            "v_other",
            "stood_ego",
            "stood_other",
            "overlap",
            "delta_v_ego",
            "delta_v_other",
            "severity",
            "aside",
        )
    }
    found = ConflictSummary(
        conflict=KINDS[kind],
        sentence=said,
        avoidance=avoidance(conflicts, row, other),
        partner=conflicts.names[partner] if partner != vehicle else "",
        vehicle=conflicts.names[vehicle] if vehicle else "",
        type=sort.label,
        type_source=sort.source,
        responsible=Responsible(conflicts.responsible[row, other]).label if happened else "",
        rule=rule.label,
        rule_says=RULES[rule][0],
        rule_source=RULES[rule][1],
        zone_ego=Zone(conflicts.zone_ego[row, other]).label if happened else "",
        zone_other=Zone(conflicts.zone_other[row, other]).label if happened else "",
        preventable=None if kind == VIOLATION else bool(conflicts.preventable[row, other]),
        time=round(number("instant") * conflicts.time_step, 9),
        decided=round(number("decided" if happened else "instant") * conflicts.time_step, 9),
        needed_deceleration=number("needed"),
        harm=float(harm_of_pairs(conflicts, count)[row, other]),
        **numbers,
    )
    return _by_law(found, rule, conflicts)


_BY_SIDE = (Rule.RIGHT_BEFORE_LEFT, Rule.ASSUMED_RIGHT_BEFORE_LEFT)
_SAID = ("sentence", "avoidance", "rule", "rule_says", "zone_ego", "zone_other")


def _by_law(found: ConflictSummary, rule: Rule, conflicts: Conflicts) -> ConflictSummary:
    """Return a conflict on the side on which it happened, with the law of its country."""
    country, law = country_of(conflicts.country), found.rule_source
    if rule in _BY_SIDE and country:
        law = country.source
    elif rule in _BY_SIDE and conflicts.left_hand:
        law = f"as in a mirror: {law}"
    elif law and country and country.code != "DE":
        others = [text for text in law.split("; ") if not text.startswith("StVO")]
        law = "; ".join(others) or f"German law, that of {country.code} was not read: {law}"
    sentence = found.sentence.replace(f"({found.rule_source})", f"({law})")
    found = replace(found, rule_source=law, sentence=sentence)
    if not conflicts.left_hand:
        return found
    texts: dict[str, Any] = {name: in_the_mirror(getattr(found, name)) for name in _SAID}
    return replace(found, **texts, aside=found.aside if found.partner else -found.aside)
