"""What of an operational design domain a drive can leave: limits of what may change.

That is the weather, and the class and the markings of a road that change along the way.
All else that a scenario states stays as it is at the start.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from bridgegen.base.errors import ScenarioError
from bridgegen.scenario.language.expression import Expression, parse
from bridgegen.scenario.language.roads import RoadsSpec
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.odd.bounding import clauses_of, tree_of
from bridgegen.scenario.odd.reader import Condition, Odd, odd_in
from bridgegen.scenario.odd.states import (
    CLOSE,
    Concept,
    States,
    Term,
    size_of,
    spans_of,
    states_of,
)
from bridgegen.scenario.weather import OF_THE_ROAD, ROAD_TYPES, Limit, Limits, limits_text

FOLLOWED = {
    "rain": ("rain", 1.0),
    "visual_range": ("visual_range", 1.0),
    "cloud": ("cloud", 8.0),
    "friction": ("friction_scale", 0.85),
    "sun_altitude": ("sun_elevation", 180.0 / math.pi),
}
"""Quantities of ``taxonomy.yaml`` that a simulation follows: what it simulates, and how many of the
former's unit are one of the latter's."""


@dataclass(frozen=True)
class Watched:
    """An ODD as far as a drive can leave it.

    Attributes:
        limits: that the weather and the road keep.
        gaps: conditions that are judged at the start only, or not at all, each with the reason.
    """

    limits: Limits
    gaps: Mapping[str, str]

    @property
    def text(self) -> str:
        """The limits as a scenario's files state them."""
        return limits_text(self.limits)

    def to_lines(self) -> tuple[str, ...]:
        """Return in words what may be left, and what is not followed."""
        groups = map(_in_words, self.limits)
        names = {limit.name for group in self.limits for limit in group}
        parts = {"weather": names - {*OF_THE_ROAD}, "road": names & {*OF_THE_ROAD}}
        what = " and the ".join(part for part, limited in parts.items() if limited)
        lines = [f"the {what} is within the ODD where {', '.join(groups)}"]
        if not self.limits:
            lines = ["no weather leaves the ODD"]
        if self.gaps:
            each = "; ".join(f"{name}: {why}" for name, why in self.gaps.items())
            lines.append(f"of the ODD a drive does not follow: {each}")
        return tuple(lines)


def _in_words(group: Sequence[Limit]) -> str:
    """Return limits, of which one holds, as a person writes them: what touches is one."""
    joined: list[Limit] = []
    for limit in sorted(group, key=lambda limit: (limit.name, limit.low)):
        last = joined[-1] if joined else None
        if last and last.name == limit.name and limit.low - last.high <= CLOSE * abs(limit.low):
            joined[-1] = replace(last, high=max(last.high, limit.high))
        else:
            joined.append(limit)
    said = []
    for name, low, high in ((each.name, each.low, each.high) for each in joined):
        if name in OF_THE_ROAD:
            words = ROAD_TYPES if name == "road_type" else ("none", "clear")
            said.append(f"{name} = {words[int(low)]}")
        elif high == math.inf:
            said.append(f"{name} ≥ {low:g}")
        else:  # what is never below 0 needs no lower end there
            above = low >= 0.0 or (name == "sun_elevation" and low > -math.inf)
            said.append(f"{low:g} ≤ {name} ≤ {high:g}" if above else f"{name} ≤ {high:g}")
    return " or ".join(said)


def watched(scenario: LogicalScenario, *, on_map: bool = False) -> Watched | None:
    """Return what a scenario's drives can leave of its ODD, of ``--odd`` or its own; None: no ODD.

    Args:
        scenario: the scenario.
        on_map: whether it takes place on a map, whose roads are not read.

    Raises:
        ScenarioError: it lies outside from the start, asks too much of the weather at once, or
            the scenario's own asks nothing of it.
        FileFormatError: its own ODD is none, or has a unit of another dimension.
    """
    own, odd = scenario.domain, scenario.odd.odd if scenario.odd else None
    if odd is None:
        if own is None:
            return None
        odd = odd_in(own)
    size_of(odd)
    states = states_of(scenario, on_map=on_map)
    followed = _Followed(**vars(states), changes=() if on_map else _changes(states, scenario.roads))
    gaps, refused = dict[str, str](), list[str]()
    tree = tree_of(odd.formula, True, odd, followed, gaps, refused)
    if tree is False:
        why = "; ".join(refused)
        raise ScenarioError(f"{scenario.name} lies outside its ODD from the start: {why}")
    found = () if tree is True else tuple(clauses_of(tree))
    if not all(isinstance(term, _Span) for clause in found for term in clause):
        raise ScenarioError(f"{scenario.name}: its ODD asks too much at once")
    if not found and own is not None and scenario.odd is None:
        raise ScenarioError(
            f"{scenario.name}: nothing of its ODD limits the weather, or what of its road "
            f"changes, which alone change during a drive ({own.at(())})"
        )
    limits = tuple(tuple(term.limit for term in clause) for clause in found)  # type: ignore[attr-defined]
    return Watched(limits, gaps)


def _changes(states: States, roads: RoadsSpec) -> tuple[tuple[str, int, int, States], ...]:
    """Return `_Followed.changes`."""
    found, later = list[tuple[str, int, int, States]](), roads.change
    if later is not None and later.road_type:
        facts = states.facts - {roads.road_type} | {later.road_type}
        before, after = (ROAD_TYPES.index(kind) for kind in (roads.road_type, later.road_type))
        found.append(("road_type", before, after, replace(states, facts=facts)))
    if later is not None and later.markings:
        facts = states.facts - {"marked"} | {"unmarked"}
        found.append(("lane_marking", 1, 0, replace(states, facts=facts)))
    return tuple(found)


@dataclass(frozen=True)
class _Span(Term):
    """A limit as a term."""

    limit: Limit


@dataclass(frozen=True)
class _Followed(States):
    """What a scenario states, and limits in place of formulas of the weather, and of changes.

    Those of the road are the quantity, its number before and after, and the states after.
    """

    changes: tuple[tuple[str, int, int, States], ...] = ()

    def holds(self, condition: Condition, positive: bool, odd: Odd) -> Any:
        """See `States.holds`; limits, joined as `tree_of` does, in place of the rows."""
        found = super().holds(condition, positive, odd)
        for name, before, after, states in self.changes if isinstance(found, bool) else ():
            if states.holds(condition, positive, odd) is not found:
                value = float(before if found else after)
                return _Span(parse("1 == 1"), condition.name, Limit(name, value, value))
        return "stays as it is at the start" if type(found) is Term else found

    def _of_quantity(
        self,
        formula: Expression,
        condition: Condition,
        concept: Concept,
        positive: bool,
        odd: Odd,
    ) -> Any:
        spans = spans_of(condition, concept, odd)
        if concept.quantity not in FOLLOWED or isinstance(spans, str) or not spans:
            return super()._of_quantity(formula, condition, concept, positive, odd)
        name, factor = FOLLOWED[concept.quantity]

        def span(low: float, high: float) -> _Span:
            return _Span(parse("1 == 1"), condition.name, Limit(name, low / factor, high / factor))

        parts: list[Any] = []
        for low, high, above, below in spans:
            # Files state the weather by formulas of their own, which may round otherwise.
            near, far = CLOSE * abs(low), CLOSE * abs(high)
            low, high = low + (near if above else -near), high - (far if below else -far)
            if positive:
                parts.append(span(low, high))
                continue
            sides = [span(-math.inf, math.nextafter(low, -math.inf))] if low > -math.inf else []
            sides += [span(math.nextafter(high, math.inf), math.inf)] if high < math.inf else []
            parts.append(("or", tuple(sides)))
        return parts[0] if len(parts) == 1 else ("or" if positive else "and", tuple(parts))
