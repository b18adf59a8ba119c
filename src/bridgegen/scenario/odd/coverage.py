"""What rows cover of an operational design domain: attributes, their limits, and their pairs.

Bins, values and limits are those of the ODD, whatever scenario is searched: counts of several
scenarios add up.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from itertools import combinations, pairwise, product
from typing import Any

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.scenario.odd.bounding import Fit
from bridgegen.scenario.odd.reader import Condition, Group, Odd
from bridgegen.scenario.odd.states import (
    Concept,
    concept_of,
    in_unit,
    literals_of,
    resolved,
    size_of,
    table,
)

BINS = 5
MOST_WORK = 1_000_000
"""Largest product of conditions and squared attributes of an ODD whose pairs are counted."""

NEAR = 0.01
"""Part of an attribute's range inside the ODD within which a value counts as on its limit."""


@dataclass
class OddAttribute:
    """An attribute of an ODD, and what rows have of it.

    Attributes:
        name: as the ODD writes it.
        unit: of numbers; "" for values that are none.
        labels: of its bins or values inside the ODD.
        edges: of bins, ascending, one more than labels; empty for values.
        limits: numbers that the ODD asks, inside its range.
        problem: what no scenario states of it; "" for nothing.
        evaluations: rows of each bin or value.
        failures: critical ones among them.
        nearest: of each limit the distance of the row next to it, as a part of the range.
        low: the least number of rows.
        high: the greatest one; below low where there is none.
    """

    name: str
    unit: str = ""
    labels: tuple[str, ...] = ()
    edges: tuple[float, ...] = ()
    limits: tuple[float, ...] = ()
    problem: str = ""
    evaluations: list[int] = field(default_factory=list)
    failures: list[int] = field(default_factory=list)
    nearest: list[float] = field(default_factory=list)
    low: float = math.inf
    high: float = -math.inf

    def __post_init__(self) -> None:
        self.evaluations = self.evaluations or [0] * len(self.labels)
        self.failures = self.failures or [0] * len(self.labels)
        self.nearest = self.nearest or [math.inf] * len(self.limits)

    @property
    def untried(self) -> tuple[str, ...]:
        """Its bins or values that no row has."""
        return tuple(x for x, n in zip(self.labels, self.evaluations, strict=True) if not n)

    @property
    def tested(self) -> int:
        """Number of its limits that a row is on."""
        return sum(distance <= NEAR for distance in self.nearest)


@dataclass
class OddCoverage:
    """What rows cover of an ODD.

    Attributes:
        odd: the ODD.
        attributes: all that it asks, in its order.
        evaluations: all rows.
        failures: critical ones.
        pairs: whether rows have a pair of bins, by attributes' and bins' numbers; only those that
            the ODD does not exclude.
    """

    odd: Odd
    attributes: tuple[OddAttribute, ...]
    evaluations: int = 0
    failures: int = 0
    pairs: dict[tuple[int, int], Bool] = field(default_factory=dict)
    possible: dict[tuple[int, int], Bool] = field(default_factory=dict)

    @property
    def pair_counts(self) -> tuple[int, int]:
        """The numbers of pairs that rows have, and of all that the ODD does not exclude."""
        have = sum(int((self.pairs[key] & self.possible[key]).sum()) for key in self.pairs)
        return have, sum(int(found.sum()) for found in self.possible.values())

    @property
    def pairs_in_words(self) -> str:
        """How many pairs rows have."""
        have, possible = self.pair_counts
        return f"{have:,} of {possible:,} pairs of values tried" if possible else "no pairs counted"

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON's types."""
        have, possible = self.pair_counts
        return {
            "name": self.odd.name,
            "sha256": self.odd.digest,
            "pairs": {"possible": possible, "evaluated": have},
            "attributes": [
                asdict(each) | {"nearest": [x if math.isfinite(x) else None for x in each.nearest]}
                for each in self.attributes
            ],
        }

    def add(self, fit: Fit, columns: Mapping[str, Float], critical: Bool) -> None:
        """Count rows.

        Args:
            fit: the ODD and the rows' scenario.
            columns: ``(N,)`` per parameter and derived quantity.
            critical: ``(N,)``.
        """
        self.evaluations += len(critical)
        self.failures += int(critical.sum())
        where = [_where(each, fit, columns, len(critical)) for each in self.attributes]
        for each, inside in zip(self.attributes, where, strict=True):
            for k, rows in enumerate(inside):
                each.evaluations[k] += int(rows.sum())
                each.failures[k] += int((rows & critical).sum())
            _measure(each, fit, columns)
        for (i, j), have in self.pairs.items():
            for k, m in product(range(len(where[i])), range(len(where[j]))):
                have[k, m] |= bool((where[i][k] & where[j][m]).any())


def _number(x: float) -> str:
    return f"{x:,.0f}" if abs(x) >= 1000 else f"{x:.4g}"


def odd_coverage(odd: Odd) -> OddCoverage:
    """Return the attributes of an ODD, of which nothing is covered yet."""
    size = size_of(odd)
    names = dict.fromkeys(condition.concept for condition in odd.conditions)
    attributes = tuple(_attribute(name, odd) for name in names)
    found = OddCoverage(odd, attributes)
    if len(attributes) ** 2 * size > MOST_WORK:
        return found  # pairs of a stranger's ODD could take hours
    for i, j in combinations(range(len(attributes)), 2):
        a, b = attributes[i], attributes[j]
        if a.labels and b.labels:
            grid = [
                [
                    any(
                        _holds(odd.formula, odd, {a.name: x, b.name: y}) is not False
                        for x, y in product(of_a, of_b)
                    )
                    for of_b in _points(b)
                ]
                for of_a in _points(a)
            ]
            found.possible[i, j] = np.array(grid)
            found.pairs[i, j] = np.zeros_like(found.possible[i, j])
    return found


def _attribute(name: str, odd: Odd) -> OddAttribute:
    concept = concept_of(name)
    if concept is None:
        return OddAttribute(name, problem="no scenario states it")
    defined = odd.taxonomy.get(name)
    if isinstance(defined, Mapping) or not concept.quantity or concept.bands:
        flag = tuple(concept.facts or concept.types) == ("true",)
        own = concept.bands or concept.facts or concept.types
        asked = [c for c in odd.conditions if c.concept == name]
        values = (
            defined
            if isinstance(defined, Mapping)
            else {
                **({"true": 0, "false": 0} if flag else {}),
                **{value: 0 for each in asked for value in each.values if value in own},
            }
        )
        inside = [v for v in values if _holds(odd.formula, odd, {name: v}) is not False]
        can = [v for v in inside if _is_stated(v, own, defined, flag)]
        cannot = ", ".join(v for v in inside if v not in can)
        return OddAttribute(
            name, labels=tuple(can), problem=f"no scenario states {cannot}" if cannot else ""
        )
    entry = table().quantities[concept.quantity]
    asked = [c for c in _numeric(odd, odd.formula) if c.concept == name and not c.problem]
    ends = (in_unit(x, c, concept, odd) for c in asked for x in (c.low, c.high))
    limits = sorted({x for x in ends if math.isfinite(x)})
    low, high = float(entry["low"]), float(entry["high"])
    marks = [low, *(x for x in limits if low < x < high), high]
    middles = [0.5 * (a + b) for a, b in pairwise(marks)]
    inside_at = [
        k for k, x in enumerate(middles) if _holds(odd.formula, odd, {name: x}) is not False
    ]
    if not inside_at:
        return OddAttribute(name, entry["unit"], problem="no scenario has a value that it asks")
    low, high = marks[inside_at[0]], marks[inside_at[-1] + 1]
    edges = np.linspace(low, high, BINS + 1).tolist()
    if entry["measures"] == "count":
        edges = np.arange(math.ceil(low), math.floor(high) + 2.0).tolist()
        labels = tuple(f"{x:g}" for x in edges[:-1])
    else:
        labels = tuple(f"{_number(a)} to {_number(b)}" for a, b in pairwise(edges))
    reached = tuple(x for x in limits if low <= x <= high)
    return OddAttribute(name, entry["unit"], labels, tuple(edges), reached)


def _is_stated(value: str, own: Mapping[str, Any], defined: Any, flag: bool) -> bool:
    """Say whether a scenario can have a value: a range defines it, or it has evidence."""
    if isinstance(defined, Mapping) and defined.get(value) is not None:
        return True
    if flag and value == "false":
        return bool(own["true"] != "always")
    return own.get(value) not in (None, "never")


def _numeric(odd: Odd, formula: "Condition | Group") -> Iterator[Condition]:
    """Yield the conditions of numbers, those that define literals among them."""
    if isinstance(formula, Condition):
        meant = resolved(formula, odd)
        if meant is formula or isinstance(meant, Condition):
            yield formula
            return
        formula = meant
    for part in formula.parts:
        yield from _numeric(odd, part)


def _points(attribute: OddAttribute) -> Iterator[tuple[str | float, ...]]:
    """Yield values of each bin: near its ends and in its middle."""
    if not attribute.edges:
        yield from ((label,) for label in attribute.labels)
    for low, high in pairwise(attribute.edges):
        if attribute.unit == "count":
            yield (low,)
        else:
            yield tuple(low + part * (high - low) for part in (0.01, 0.5, 0.99))


def _holds(formula: "Condition | Group", odd: Odd, known: Mapping[str, str | float]) -> bool | None:
    """Return whether a formula holds where some attributes are known; None: it depends."""
    if isinstance(formula, Group):
        parts = [_holds(part, odd, known) for part in formula.parts]
        if formula.sign == "not":
            return None if parts[0] is None else not parts[0]
        decides = formula.sign == "or"
        if decides in parts:
            return decides
        return None if None in parts else not decides
    value = known.get(formula.concept)
    concept = concept_of(formula.concept)
    if formula.problem or concept is None:
        return None
    if isinstance(value, str):
        return value in literals_of(formula, odd)
    meant = resolved(formula, odd)
    if isinstance(meant, Group):
        return _holds(meant, odd, known)
    if value is None or meant.values:
        return None
    low, high = (in_unit(x, meant, concept, odd) for x in (meant.low, meant.high))
    return (value > low if meant.above else value >= low) and (
        value < high if meant.below else value <= high
    )


def _where(attribute: OddAttribute, fit: Fit, columns: Mapping[str, Float], n: int) -> list[Bool]:
    """Return which rows are in each bin."""
    concept = concept_of(attribute.name)
    if concept is None or not attribute.labels:
        return []
    if attribute.edges:
        x = _values(concept, fit, columns, n)
        at = np.searchsorted(attribute.edges[1:-1], x, side="right")
        # A last edge belongs to the last bin, as in each coverage; rounding may miss either.
        slack = 1e-9 * (attribute.edges[-1] - attribute.edges[0])
        inside = (x >= attribute.edges[0] - slack) & (x <= attribute.edges[-1] + slack)
        return [(at == k) & inside for k in range(len(attribute.labels))]
    found = fit.literals(attribute.name, columns, attribute.labels)
    return [found.get(label, np.zeros(n, np.bool_)) for label in attribute.labels]


def _values(concept: Concept, fit: Fit, columns: Mapping[str, Float], n: int) -> Float:
    formula = fit.states.quantities.get(concept.quantity)
    if formula is None:
        return np.full(n, np.nan)
    return np.broadcast_to(formula.evaluate(columns), (n,))


def _measure(attribute: OddAttribute, fit: Fit, columns: Mapping[str, Float]) -> None:
    concept = concept_of(attribute.name)
    if concept is None or not attribute.edges:
        return
    x = _values(concept, fit, columns, 1 if not columns else len(next(iter(columns.values()))))
    finite = x[np.isfinite(x)]
    attribute.low = min(attribute.low, float(finite.min(initial=math.inf)))
    attribute.high = max(attribute.high, float(finite.max(initial=-math.inf)))
    width = attribute.edges[-1] - attribute.edges[0] or 1.0
    for k, limit in enumerate(attribute.limits):
        away = np.abs(finite - limit) / width
        attribute.nearest[k] = min(attribute.nearest[k], float(away.min(initial=math.inf)))
