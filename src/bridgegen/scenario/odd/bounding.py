"""Bounds a logical scenario by an operational design domain: ranges, bounds, checks, and gaps."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import ScenarioError
from bridgegen.scenario.language.expression import Expression, parse
from bridgegen.scenario.language.parameters import Axis, Bound, Parameter
from bridgegen.scenario.language.scenario import SearchedScenario
from bridgegen.scenario.odd.reader import Condition, Group, Odd
from bridgegen.scenario.odd.states import (
    LONG,
    States,
    Term,
    concept_of,
    resolved,
    size_of,
    states_of,
    table,
)

MOST_CLAUSES = 256
"""Most clauses that the conditions of an ODD are brought to, one by one: more are one check."""

_GRID = 1025  # values of a range at which a condition is tried
_SAMPLE = 4096

Tree = "bool | Term | tuple[str, tuple[Tree, ...]]"


class OddBound(Bound):
    """A bound that an ODD asks for, and reads as the ODD says it."""

    SOURCE = "the operational design domain"

    def __str__(self) -> str:
        return self.why


@dataclass(frozen=True)
class Fit:
    """An ODD and a scenario.

    Attributes:
        odd: the ODD.
        states: what the scenario states of its attributes.
        clauses: terms of which each row keeps one, by clause.
        changes: what the ODD changes, a line each: ranges, bounds, checks.
        gaps: conditions that cannot be judged, each with the reason; they bound nothing.
        refused: why no row at all is inside; empty where one may be.
    """

    odd: Odd
    states: States = field(repr=False)
    clauses: tuple[tuple[Term, ...], ...] = ()
    changes: tuple[str, ...] = ()
    gaps: Mapping[str, str] = field(default_factory=dict)
    refused: tuple[str, ...] = ()

    def inside(self, columns: Mapping[str, Float]) -> Bool:
        """Return which rows keep all that can be judged, ``(N,)``.

        Args:
            columns: ``(N,)`` per parameter and derived quantity.
        """
        n = len(next(iter(columns.values())))
        kept = np.ones(n, np.bool_)
        for clause in self.clauses:
            kept &= _met(clause, columns, n)
        return kept

    def literals(
        self, name: str, columns: Mapping[str, Float], of: Iterable[str]
    ) -> dict[str, Bool]:
        """Return which literals of a category rows have, ``(N,)`` each.

        Those are left out of which it cannot be said.

        Args:
            name: of a category.
            columns: ``(N,)`` per parameter and derived quantity.
            of: the literals.
        """
        n = len(next(iter(columns.values())))
        found = {}
        for literal in of:
            gaps: dict[str, str] = {}
            condition = Condition(name, literal, (literal,))
            # Not as excluded: of several participants each one counts that is of the literal.
            tree = tree_of(condition, False, self.odd, self.states, gaps, [])
            if gaps:
                continue
            met = np.full(n, tree is not True)
            if not isinstance(tree, bool):
                met = ~np.logical_and.reduce([_met(each, columns, n) for each in clauses_of(tree)])
            found[literal] = met
        return found

    @property
    def label(self) -> str:
        """Its name, and how much of it is not judged."""
        count = len(self.gaps)
        words = f", {count} condition{'s' * (count != 1)} not judged" if count else ""
        return f"ODD {self.odd.name}{words}"

    @property
    def facts(self) -> dict[str, str]:
        """What a page states of it, by name."""
        found = {"operational design domain": f"{self.odd.title}, SHA-256 {self.odd.digest}"}
        found |= {"bounded": "; ".join(self.changes)} if self.changes else {}
        gaps = "; ".join(f"{condition}: {reason}" for condition, reason in self.gaps.items())
        return found | ({"not judged of the ODD": gaps} if gaps else {})

    def to_lines(self) -> tuple[str, ...]:
        """Return what it does in words: the ODD, its changes, and its gaps."""
        name, facts = f"ODD {self.odd.name}", self.facts
        lines = [f"{name} ({self.odd.title}): {facts.get('bounded', 'narrows nothing')}"]
        if self.gaps:
            lines.append(f"{self.label}: {facts['not judged of the ODD']}")
        return (*lines, *(f"{name}: {note}" for note in self.odd.notes))


def bounded(scenario: SearchedScenario, odd: Odd, *, on_map: bool = False) -> SearchedScenario:
    """Return a scenario all of whose rows lie in an ODD, as far as it states its attributes.

    Ranges are narrowed where a condition asks for it; combinations become bounds of what is
    decoded later, and checks where no interval says them.

    Args:
        scenario: to be bounded.
        odd: the ODD.
        on_map: whether it takes place on a map, whose roads are not read.

    Raises:
        ScenarioError: no row is inside; says what the ODD asks, and what the scenario has.
        FileFormatError: a condition's unit is of another dimension.
    """
    fit = fit_of(scenario, odd, on_map=on_map)
    where = f"the ODD {odd.name} excludes every row of {scenario.name}"
    if fit.refused:
        raise ScenarioError(f"{where}: {'; '.join(fit.refused)}")
    maker = _Maker(scenario, where)
    for clause in sorted(fit.clauses, key=lambda clause: len(maker.sources(clause))):
        maker.keep(clause)
    fit = replace(fit, changes=tuple(maker.changes))
    found = replace(maker.scenario, checks=(*scenario.checks, *maker.checks), odd=fit)
    return replace(found, notes=(*scenario.notes, *maker.tried(found), *fit.to_lines()))


def fit_of(scenario: SearchedScenario, odd: Odd, *, on_map: bool = False) -> Fit:
    """Return what an ODD asks of a scenario's rows; the scenario stays as it is.

    Args:
        scenario: the scenario.
        odd: the ODD.
        on_map: see `bounded`.

    Raises:
        FileFormatError: a condition's unit is of another dimension.
    """
    size_of(odd)
    states, gaps, refused = states_of(scenario, on_map=on_map), dict[str, str](), list[str]()
    tree = tree_of(odd.formula, True, odd, states, gaps, refused)
    if tree is False:
        return Fit(odd, states, ((),), gaps=gaps, refused=tuple(refused))
    return Fit(odd, states, () if tree is True else tuple(clauses_of(tree)), gaps=gaps)


def tree_of(
    formula: "Condition | Group",
    positive: bool,
    odd: Odd,
    states: States,
    gaps: dict[str, str],
    refused: list[str],
) -> Any:
    """Return a formula without negations, and without what is certain.

    What cannot be judged may hold: the standard's missing values put nothing outside.
    """
    if isinstance(formula, Condition):
        meant = resolved(formula, odd)
        if isinstance(meant, Group):
            return tree_of(meant, positive, odd, states, gaps, refused)
        found = states.holds(meant, positive, odd)
        if isinstance(found, str):
            gaps[formula.name] = found
            return True
        if found is False:
            refused.append(_contradiction(formula, positive, states))
        return found
    if formula.sign == "not":
        return tree_of(formula.parts[0], not positive, odd, states, gaps, refused)
    is_and = (formula.sign == "and") == positive
    own: list[str] = []
    parts = [tree_of(part, positive, odd, states, gaps, own) for part in formula.parts]
    if (not is_and) in parts:
        refused += own if is_and else []
        return not is_and
    rest = tuple(part for part in parts if part is not is_and)
    if not rest:
        refused += own
        return is_and
    return rest[0] if len(rest) == 1 else ("and" if is_and else "or", rest)


def _contradiction(condition: Condition, positive: bool, states: States) -> str:
    concept = concept_of(condition.concept)
    assert concept is not None  # what no scenario states contradicts nothing
    value = states.value(concept, states.scenario.usual_values())
    if isinstance(value, float):
        unit = table().quantities[concept.quantity]["unit"]
        has = f"{value:g}" if unit == "count" else f"{value:g} {unit}"
    else:
        has = ", ".join(value or ()) or "none"
    asks = "asks" if positive else "excludes"
    return f"it {asks} {condition.name}, {states.scenario.name} has {has}"


def clauses_of(tree: Any) -> Iterator[tuple[Term, ...]]:
    """Yield the clauses of a tree in conjunctive normal form."""
    if isinstance(tree, Term):
        yield (tree,)
        return
    sign, parts = tree
    if sign == "and":
        for part in parts:
            yield from clauses_of(part)
        return
    each = [list(clauses_of(part)) for part in parts]
    if np.prod([len(part) for part in each], dtype=float) > MOST_CLAUSES:
        yield (_joined(tree),)
        return
    for chosen in product(*each):
        yield tuple(dict.fromkeys(term for clause in chosen for term in clause))


def _joined(tree: Any) -> Term:
    if isinstance(tree, Term):
        return tree
    sign, parts = tree
    terms = [_joined(part) for part in parts]
    categories = {name: names for term in terms for name, names in term.formula.categories}
    text = f" {sign} ".join(f"({term.formula})" for term in terms)
    said = f" {sign} ".join(f"({term.said})" for term in terms)
    return Term(parse(text, "", categories, longest=LONG, deepest=256), said)


def _met(clause: tuple[Term, ...], columns: Mapping[str, Any], n: int) -> Bool:
    if not clause:
        return np.zeros(n, np.bool_)
    met = [np.broadcast_to(term.formula.evaluate(columns), (n,)) != 0.0 for term in clause]
    found: Bool = np.logical_or.reduce(met)
    return found


def _span(parameter: Parameter) -> str:
    ends = parameter.low, parameter.high
    return parameter.kind.span_text(*ends, "{:.4g}".format, f" {parameter.unit}")


class _Maker:
    """Brings clauses into a scenario, one after the other."""

    def __init__(self, scenario: SearchedScenario, where: str) -> None:
        self.scenario, self.where = scenario, where
        self.checks: list[Bound] = []
        self.declared, self.narrowed = scenario.parameters, dict[str, list[str]]()
        self.changes: list[str] = []
        self.derived = {each.name: each for each in scenario.derived}
        self.usual, self.order = scenario.usual_values(), scenario.space().order
        self.axes = [axis for axis in (tuple(Axis), None) if self._fits(scenario, axis)]

    def sources(self, clause: tuple[Term, ...]) -> frozenset[str]:
        """Return the parameters that a clause's value follows from."""
        return frozenset().union(*(self._sources(term.formula) for term in clause))

    def _sources(self, formula: Expression) -> frozenset[str]:
        found = set[str]()
        for name in formula.names:
            if name in self.derived:
                found |= self._sources(self.derived[name].value)
            else:
                found.add(name)
        return frozenset(found)

    def keep(self, clause: tuple[Term, ...]) -> None:
        """Change the scenario so that its rows keep a clause.

        Raises:
            ScenarioError: none does.
        """
        sources = self.sources(clause)
        said = " or ".join(term.said for term in clause)
        if len(sources) == 1:
            if self._narrow(next(iter(sources)), clause, said):
                return
        else:
            for name in sorted(sources, key=self.order.index, reverse=True):
                if self._bind(name, clause, said):
                    return
        columns = self._columns(self.scenario)
        if _met(clause, columns, _SAMPLE).all():
            return  # it holds anyway
        self._check(clause, said, sources)

    def _values(self, parameter: Parameter) -> Float:
        if parameter.kind.apart:
            return np.arange(parameter.low, parameter.high + 1.0)
        return np.linspace(parameter.low, parameter.high, _GRID)

    def _allowed(self, name: str, clause: tuple[Term, ...], values: Float) -> Bool:
        columns: dict[str, Any] = self.usual | {name: values}
        for column in self.order:
            if column in self.derived:
                columns[column] = self.derived[column].value.evaluate(columns)
        return _met(clause, columns, len(values))

    def _interval(self, name: str, clause: tuple[Term, ...]) -> "tuple[float, float] | bool | None":
        """Return the values of a parameter that keep a clause; None if they are no one interval.

        True: all do; False: none does.
        """
        parameter = self.scenario.parameters[name]
        values = self._values(parameter)
        good = self._allowed(name, clause, values)
        if good.all() or not good.any():
            return bool(good.all())
        at = np.flatnonzero(good)
        first, last = int(at[0]), int(at[-1])
        if not good[first : last + 1].all() or parameter.kind.names:
            return None
        if parameter.kind.apart:
            return float(values[first]), float(values[last])
        low, high = float(values[first]), float(values[last])
        if first > 0:
            low = self._edge(name, clause, low, float(values[first - 1]))
        if last < len(values) - 1:
            high = self._edge(name, clause, high, float(values[last + 1]))
        return low, high

    def _edge(self, name: str, clause: tuple[Term, ...], good: float, bad: float) -> float:
        """Return the value next to the bad one that keeps a clause."""
        for _ in range(60):
            middle = 0.5 * (good + bad)
            if middle in (good, bad):
                break
            if self._allowed(name, clause, np.array([middle]))[0]:
                good = middle
            else:
                bad = middle
        return good

    def _narrow(self, name: str, clause: tuple[Term, ...], said: str) -> bool:
        parameter = self.scenario.parameters[name]
        if getattr(parameter, "distribution", None) is not None:
            return False  # a file gives how it is drawn, whatever its range
        ends = self._interval(name, clause)
        if ends is True:
            return True
        if ends is False:
            asked = " and ".join((*self.narrowed.get(name, ()), said))
            declared = _span(self.declared[name])
            raise ScenarioError(f"{self.where}: it asks {asked}, {name} is {declared}")
        if ends is None:
            return False
        low, high = ends
        usual = float(np.clip(parameter.default, low, high))
        changed = replace(parameter, low=low, high=high, default=usual)
        found = replace(self.scenario, parameters=self.scenario.parameters | {name: changed})
        if not self._all_fit(found):
            return False
        self.scenario = found
        self.narrowed.setdefault(name, []).append(said)
        self.changes.append(f"{said}: {name} is {_span(changed)}, declared {_span(parameter)}")
        return True

    def _bind(self, name: str, clause: tuple[Term, ...], said: str) -> bool:
        """Bound a parameter by the others of a clause; say whether that was possible."""
        own = tuple(term for term in clause if self._sources(term.formula) == {name})
        others = tuple(term for term in clause if term not in own)
        drawn = getattr(self.scenario.parameters[name], "distribution", None)
        if drawn or not own or any(name in self._sources(term.formula) for term in others):
            return False
        ends = self._interval(name, own)
        if ends is False:
            self.keep(others)
        if not isinstance(ends, tuple):
            return ends is not None
        parameter = self.scenario.parameters[name]
        test = _joined(("or", others))
        categories = dict(test.formula.categories)
        sides = [
            None
            if limit == end
            else parse(f"{end!r} if {test.formula} else {limit!r}", "", categories, longest=LONG)
            for limit, end in zip(ends, (parameter.low, parameter.high), strict=True)
        ]
        rule = OddBound(name, sides[0], sides[1], said, OddBound.SOURCE)
        found = replace(self.scenario, bounds=(*self.scenario.bounds, rule))
        if not self._all_fit(found):
            return False
        self.scenario = found
        self.changes.append(f"{said}: bounds {name}")
        return True

    def _check(self, clause: tuple[Term, ...], said: str, sources: frozenset[str]) -> None:
        test = _joined(("or", clause)) if len(clause) > 1 else clause[0]
        target = self.scenario.parameters[min(sources)]
        far = target.high + 2.0 * (1.0 + abs(target.high))
        text = f"{target.low!r} if {test.formula} else {far!r}"
        limit = parse(text, "", dict(test.formula.categories), longest=LONG, deepest=300)
        self.checks.append(OddBound(target.name, limit, None, said, OddBound.SOURCE))
        self.changes.append(f"{said}: rows that break it are refused")

    def tried(self, scenario: SearchedScenario) -> tuple[str, ...]:
        """Return what to know of the checks of a bounded scenario.

        Raises:
            ScenarioError: no row keeps them.
        """
        if not self.checks:
            return ()
        columns = self._columns(scenario)
        broken = np.zeros(_SAMPLE, np.bool_)
        for rows in scenario.broken(columns).values():
            broken |= rows
        if broken.all():
            rules = " and ".join(str(check) for check in self.checks)
            raise ScenarioError(f"{self.where}: it asks {rules}, and no row of {_SAMPLE:,} does")
        return (f"{broken.mean():.0%} of random rows break what the ODD asks, and are refused",)

    def _columns(self, scenario: SearchedScenario) -> dict[str, Float]:
        space = scenario.space(self.axes[0])
        X = space.decode(np.random.default_rng(0).random((_SAMPLE, space.n_var)))
        return dict(zip(space.names, X.T, strict=True))

    def _all_fit(self, scenario: SearchedScenario) -> bool:
        return all(self._fits(scenario, axes) for axes in self.axes)

    def _fits(self, scenario: SearchedScenario, axes: Any) -> bool:
        try:
            scenario.space(axes)
        except ScenarioError:
            return False
        return True
