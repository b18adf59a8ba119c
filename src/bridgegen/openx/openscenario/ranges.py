"""The parameters of a scenario file as those of a search: what may vary, and how it is distributed.

What the standard leaves open, and what is chosen here, is in docs/decisions.md.
"""

import math
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import product

from bridgegen.base.arrays import Float
from bridgegen.base.errors import FileFormatError, InputError
from bridgegen.openx.openscenario import distributions as dst
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element, values_of, walk
from bridgegen.openx.openscenario.from_owl.notes import PARAMETER
from bridgegen.openx.openscenario.parameters import broken, kind_of, numbers, refers, values
from bridgegen.openx.openscenario.values import (
    Expr,
    Kind,
    ParameterRef,
    parse_literal,
    parse_value,
)
from bridgegen.scenario.language.distributions import Discrete, Distribution, Uniform, shares_within
from bridgegen.scenario.language.expression import lookup, parse
from bridgegen.scenario.language.kinds import FLOAT, INTEGER, Category
from bridgegen.scenario.language.parameters import Axis, Bound, Derived, Parameter, nearest

MOST_VARIANTS = 200
"""Largest number of combinations of texts, each of which is read, checked and compiled by
itself."""

UNIT = "?"
"""The unit of a parameter whose file states none."""

_AT_LEAST = (osc.Rule.GREATER_THAN, osc.Rule.GREATER_OR_EQUAL, osc.Rule.EQUAL_TO)
_AT_MOST = (osc.Rule.LESS_THAN, osc.Rule.LESS_OR_EQUAL, osc.Rule.EQUAL_TO)


WHICH_SET = "Which of the value sets is taken, from 0."
"""The description of the parameter that numbers the sets of a joint distribution."""


@dataclass(frozen=True)
class FileParameter(Parameter):
    """A parameter of a scenario file: of any name, perhaps of no known unit, distributed.

    Attributes:
        distribution: of its values; None where they are spread evenly.
    """

    distribution: Distribution | None = None

    @property
    def is_set(self) -> bool:
        """Whether it is the number, from 0 on, of a set of values that come together."""
        return self.description == WHICH_SET

    def at(self, share: Float, lo: Float | float, hi: Float | float) -> Float:
        """See `Parameter`."""
        if self.distribution is None:
            return super().at(share, lo, hi)
        return self.distribution.value(share)

    def share(self, value: Float, lo: Float | float, hi: Float | float) -> Float:
        """See `Parameter`."""
        if self.distribution is None:
            return super().share(value, lo, hi)
        return self.distribution.share(value)

    def shares(
        self, low: float, high: float, lo: Float | float, hi: Float | float
    ) -> tuple[Float, Float]:
        """See `Parameter`."""
        if self.distribution is None:
            return super().shares(low, high, lo, hi)
        return shares_within(self.distribution, low, high)

    def ends(self, low: float, high: float) -> tuple[float, float] | None:
        """See `Parameter`."""
        if not isinstance(self.distribution, Discrete):
            return super().ends(low, high)
        inside = [value for value in self.distribution.values if low <= value <= high]
        return min(inside), max(inside)

    def _naming_problems(self) -> list[str]:
        return []


@dataclass(frozen=True)
class DerivedParameter(Derived):
    """A parameter of a scenario file that follows from others: from the set that is taken, say."""

    def _naming_problems(self) -> list[str]:
        return []


@dataclass(frozen=True)
class Ranges:
    """What of a scenario file may vary.

    Attributes:
        parameters: every numeric parameter but the derived ones; what does not vary stands at the
            value that the file declares. Texts that vary. Besides, which of its sets a joint
            distribution takes.
        derived: those that value sets give, or a formula.
        bounds: the limits of parameters by others.
        texts: of each text or truth that varies its values; a row holds the number of one.
        variants: those of them on which the storyboard depends, not formulas of the header alone.
        combinations: the values of these that come together, one for each of `variants`.
        notes: what is searched otherwise than the distribution says, a sentence each.
    """

    parameters: dict[str, Parameter]
    derived: tuple[Derived, ...] = ()
    bounds: tuple[Bound, ...] = ()
    texts: dict[str, tuple[str, ...]] = field(default_factory=dict)
    variants: tuple[str, ...] = ()
    combinations: tuple[tuple[float, ...], ...] = ()
    notes: tuple[str, ...] = ()


def ranges_of(
    scenario: osc.OpenScenario,
    definition: dst.Deterministic | dst.Stochastic | None = None,
    place: str = "",
) -> Ranges:
    """Return the parameters of a scenario as a distribution lets them vary.

    Args:
        scenario: the file.
        definition: the distribution; without one nothing varies.
        place: the distribution's file, for messages.

    Raises:
        FileFormatError: what does not fit the scenario's parameters, or is no distribution; all of
            it at once, with its line.
    """
    builder = _Builder(scenario, place)
    for distribution in definition.distributions if definition else ():
        builder.add(distribution)
    if builder.problems:
        raise FileFormatError(*(f"{place}: {problem}" for problem in builder.problems))
    return builder.ranges()


def _fixed(group: osc.ValueConstraintGroup) -> osc.ValueConstraintGroup:
    """Return those constraints of a group that do not depend on other parameters."""
    fixed = tuple(limit for limit in group.constraints if not refers(limit))
    return replace(group, constraints=fixed)


def _bounds(declaration: osc.ParameterDeclaration, known: Collection[str]) -> Iterator[Bound]:
    """Yield the limits of a parameter that depend on others.

    Of several groups one must hold, which is no limit that holds by itself.
    """
    if len(declaration.constraint_groups) != 1 or not kind_of(declaration.parameter_type).is_number:
        return
    for limit in declaration.constraint_groups[0].constraints:
        if not refers(limit):
            continue
        value = parse_value(Kind.DOUBLE, limit.value, expressions=True)
        if not isinstance(value, ParameterRef | Expr) or not value.names <= set(known):
            continue
        text = value.name if isinstance(value, ParameterRef) else str(value.expression)
        place = f"line {limit.line}"
        low = parse(text, place) if limit.rule in _AT_LEAST else None
        high = parse(text, place) if limit.rule in _AT_MOST else None
        if low is not None or high is not None:
            why = "The file constrains it so."
            yield Bound(declaration.name, low, high, why, "its ValueConstraint", place)


def _is_text(declaration: osc.ParameterDeclaration | None) -> bool:
    return declaration is not None and kind_of(declaration.parameter_type) in (
        Kind.STRING,
        Kind.BOOLEAN,
    )


def _referred(element: Element) -> Iterator[str]:
    """Yield the parameters that an element refers to itself."""
    for _, value in values_of(element):
        if isinstance(value, ParameterRef | Expr):
            yield from value.names


class _Builder:
    """Takes in distributions one by one.

    Attributes:
        problems: why one is none, or does not fit, with its line.
        notes: what is searched otherwise than the distribution says.
    """

    def __init__(self, scenario: osc.OpenScenario, place: str) -> None:
        self._place = place
        declared = scenario.parameter_declarations
        self._declared = (
            {parameter.name: parameter for parameter in declared.parameters} if declared else {}
        )
        self._numbers, self._values = numbers(scenario), values(scenario)
        header = scenario.file_header.properties
        self._said = (
            {str(property_.name): str(property_.value) for property_ in header.properties}
            if header
            else {}
        )
        self._single: dict[str, Distribution] = {}
        self._categories: dict[str, FileParameter] = {}
        self._words: dict[str, tuple[str, ...]] = {}
        self._used = {name for node in walk(scenario) for name in _referred(node)}
        self._joint: list[dict[str, list[float]]] = []
        self.problems: list[str] = []
        self.notes: list[str] = []

    def add(
        self,
        distribution: dst.DeterministicMultiParameterDistribution
        | dst.DeterministicSingleParameterDistribution
        | dst.StochasticDistribution,
    ) -> None:
        """Add one distribution, or report why not."""
        if isinstance(distribution, dst.DeterministicMultiParameterDistribution):
            self._add_sets(distribution.distribution)
            return
        name = distribution.parameter_name
        with self._saying(distribution.distribution):
            if _is_text(self._declared.get(name)) and isinstance(
                distribution.distribution, dst.DistributionSet | dst.ProbabilityDistributionSet
            ):
                self._add_category(name, distribution.distribution)
                return
            kind = self._kind(name)
            found = dst.distribution_of(distribution.distribution)
            # A continuous distribution of a whole number would have to be rounded, and the standard
            # does not say how.
            if kind.is_integer and not isinstance(found, Discrete | Uniform):
                raise InputError(
                    f"parameter {name} is a whole number ({kind.value}), and a "
                    f"{type(distribution.distribution).__name__} gives others, too"
                )
            if isinstance(
                distribution.distribution, dst.DistributionRange | dst.UniformDistribution
            ):
                found = self._without_open_ends(name, found)
            if isinstance(found, Discrete):
                for value in found.values:
                    self._check(name, kind, value, value)
            else:
                self._check(name, kind, found.low, found.high)
            self._single[name] = found

    def _without_open_ends(self, name: str, found: Distribution) -> Distribution:
        """Return a range without an end that the scenario's constraint just excludes, and note it.

        ASAM's own examples vary from −1.75 to 1.75 what must be greater than −1.75.
        """
        limits = {
            float(constraint.value): str(constraint.rule)
            for group in self._declared[name].constraint_groups
            for constraint in group.constraints
            if constraint.rule in (osc.Rule.GREATER_THAN, osc.Rule.LESS_THAN)
            and not refers(constraint)
        }
        ends = [end for end in (found.low, found.high) if end in limits]
        if not ends or found.low == found.high:
            return found
        self.notes += [
            f"{self._place}: parameter {name} must be {limits[end]} {end:g}: its range is searched "
            "without that end"
            for end in ends
        ]
        if isinstance(found, Discrete):
            kept = [value for value in found.values if value not in ends]
            return Discrete.of(kept) if kept else found
        low, high = found.low, found.high
        return Uniform(
            # The nearest double within the range: a search may then have any value that the
            # constraint allows.
            math.nextafter(low, high) if low in ends else low,
            math.nextafter(high, low) if high in ends else high,
        )

    def _add_category(
        self, name: str, given: dst.DistributionSet | dst.ProbabilityDistributionSet
    ) -> None:
        """Take in the values of a text.

        Raises:
            InputError: a value that the scenario does not allow, or a second distribution.
        """
        words = [str(element.value) for element in given.elements]
        codes = self._codes(name, words)
        weights = (
            [element.weight for element in given.elements]
            if isinstance(given, dst.ProbabilityDistributionSet)
            else None
        )
        found = Discrete.of(codes, weights)
        declared = float(self._words[name].index(str(self._declared[name].value)))
        default = declared if declared in found.values else found.values[0]
        self._categories[name] = FileParameter(
            name,
            self._axis(name),
            self._unit(name),
            found.low,
            found.high,
            default,
            Category(self._words[name]),
            distribution=found,
        )

    def _codes(self, name: str, words: list[str]) -> list[float]:
        """Return the numbers of a text's values, and remember which text each stands for.

        Raises:
            InputError: a value that the scenario does not allow, or a second distribution.
        """
        if name in self._words:
            raise InputError(f"parameter {name} must have one distribution, got two")
        declaration = self._declared[name]
        for word in words:
            if reasons := broken(declaration, word, self._values):
                raise InputError(f"parameter {name} {reasons[0]}")
        allowed = [
            constraint.value
            for group in declaration.constraint_groups
            for constraint in group.constraints
            if constraint.rule is osc.Rule.EQUAL_TO
        ]
        # The order of the constraint's values, if it lists them, does not depend on what a
        # distribution picks: so the same text has the same number with any distribution.
        names = tuple(dict.fromkeys(map(str, [*allowed, *words, declaration.value])))
        self._words[name] = names
        return [float(names.index(word)) for word in words]

    def _texts(self) -> Iterator[tuple[str, str]]:
        """Yield the formulas of the header, each after the name of its property."""
        for name in self._numbers:
            place = f"{PARAMETER}.{name}.expression"
            if (text := self._said.get(place)) is not None:
                yield place, text

    def _add_sets(self, given: dst.ValueSetDistribution) -> None:
        names = dict.fromkeys(
            assignment.parameter_ref for each in given.sets for assignment in each.assignments
        )
        columns: dict[str, list[float]] = {}
        for name in names:
            with self._saying(given):
                if _is_text(self._declared.get(name)):
                    columns[name] = self._codes(name, [self._said_by(e, name) for e in given.sets])
                    continue
                kind = self._kind(name)
                columns[name] = [self._of_set(each, name) for each in given.sets]
                for value in columns[name]:
                    self._check(name, kind, value, value)
        self._joint.append(columns)

    def _of_set(self, given: dst.ParameterValueSet, name: str) -> float:
        """Return a parameter's value in a set; what the scenario declares, if it is not in it."""
        text = self._given(given, name)
        return self._numbers[name] if text is None else dst.number(text)

    def _said_by(self, given: dst.ParameterValueSet, name: str) -> str:
        """Return a text in a set; what the scenario declares, if it is not in it."""
        text = self._given(given, name)
        return str(self._declared[name].value) if text is None else text

    @staticmethod
    def _given(given: dst.ParameterValueSet, name: str) -> str | None:
        texts = [
            str(assignment.value)
            for assignment in given.assignments
            if assignment.parameter_ref == name
        ]
        if len(texts) > 1:
            raise InputError(f"a set must give {name} one value (line {given.line})")
        return texts[0] if texts else None

    def ranges(self) -> Ranges:
        """Return all that was taken in."""
        parameters: dict[str, Parameter] = {}
        joint: list[DerivedParameter] = []
        for number, columns in enumerate(self._joint, start=1):
            index = f"value_set_{number}"
            while index in self._declared:
                index += "_"
            last = len(next(iter(columns.values()))) - 1
            parameters[index] = FileParameter(
                index,
                Axis.PARTICIPANTS,
                "count",
                0.0,
                float(last),
                0.0,
                INTEGER,
                WHICH_SET,
            )
            joint += [
                DerivedParameter(
                    name,
                    self._axis(name),
                    self._unit(name),
                    lookup(index, values),
                    "The values of a set are taken together.",
                    "ParameterValueSet",
                )
                for name, values in columns.items()
            ]
        derived = [*joint, *self._formulas({parameter.name for parameter in joint})]
        following = {item.name for item in derived}
        own = {name: self._parameter(name) for name in self._numbers if name not in following}
        made = own | self._categories | parameters
        bounds = [
            bound
            for name, declaration in self._declared.items()
            for bound in _bounds(declaration, self._numbers.keys())
            if bound.names & made.keys()
        ]
        names, combinations = self._combinations()
        return Ranges(
            made,
            tuple(derived),
            tuple(bounds),
            self._words,
            names,
            combinations,
            tuple(self.notes),
        )

    def _combinations(self) -> tuple[tuple[str, ...], tuple[tuple[float, ...], ...]]:
        """Return the texts on which the storyboard depends, and which values come together.

        A text that only formulas of the header compare is left out.

        Raises:
            FileFormatError: there are too many.
        """
        compared = {
            name for place, text in self._texts() for name in parse(text, place, self._words).names
        }
        names: list[str] = []
        choices: list[list[tuple[float, ...]]] = []
        for name, category in self._categories.items():
            # Each text on which the storyboard depends is read, checked and compiled by itself; one
            # that only formulas of the header compare costs nothing.
            if name in self._used or name not in compared:
                assert isinstance(category.distribution, Discrete)
                names.append(name)
                choices.append([(value,) for value in category.distribution.values])
        for columns in self._joint:
            if together := [name for name in columns if name in self._words]:
                names += together
                rows = zip(*(columns[name] for name in together), strict=True)
                choices.append(list(dict.fromkeys(rows)))
        count = math.prod(map(len, choices))
        if count > MOST_VARIANTS:
            raise FileFormatError(
                f"{self._place}: the values of {', '.join(names)} may come together in at most "
                f"{MOST_VARIANTS} ways, for each is a storyboard of its own, got {count}"
            )
        if not names:
            return (), ()
        return tuple(names), tuple(
            tuple(value for part in parts for value in part) for parts in product(*choices)
        )

    def _formulas(self, joint: set[str]) -> Iterator[Derived]:
        """Yield the parameters that follow from others, as a file of ours says (`from_owl.notes`).

        One that the distribution names does not.
        """
        for name in self._numbers:
            text = self._said.get(f"{PARAMETER}.{name}.expression")
            # What the distribution says of a parameter counts more than the formula that the header
            # has for it.
            if text is None or name in self._single or name in joint:
                continue
            formula = parse(text, f"{PARAMETER}.{name}.expression", self._words)
            if formula.names <= self._numbers.keys() | self._words.keys():
                yield DerivedParameter(
                    name,
                    self._axis(name),
                    self._unit(name),
                    formula,
                    "The file's header says so.",
                    "FileHeader",
                )

    def _parameter(self, name: str) -> Parameter:
        declared = self._numbers[name]
        found = self._single.get(name, Uniform(declared, declared))
        low, high = found.low, found.high
        whole = kind_of(self._declared[name].parameter_type).is_integer
        if whole:
            low, high = float(math.ceil(low)), float(math.floor(high))
        return FileParameter(
            name,
            self._axis(name),
            self._unit(name),
            low,
            high,
            # The declared value is the default even where the distribution leaves it out; a default
            # must lie in the range.
            min(max(declared, low), high),
            INTEGER if whole else FLOAT,
            distribution=None if isinstance(found, Uniform) else found,
        )

    def _kind(self, name: str) -> Kind:
        """Return the type of a parameter that is to vary.

        Raises:
            InputError: there is none of that name, it is no number, or it varies already.
        """
        if name not in self._declared:
            hint = nearest(name, self._declared)
            raise InputError(f"the scenario declares no parameter '{name}'{hint}")
        kind = kind_of(self._declared[name].parameter_type)
        if not kind.is_number:
            raise InputError(
                f"parameter {name} is a {kind.value}; it can take the values of a set, but not of "
                "a range"
            )
        if name in self._single or any(name in columns for columns in self._joint):
            raise InputError(f"parameter {name} must have one distribution, got two")
        return kind

    def _check(self, name: str, kind: Kind, low: float, high: float) -> None:
        """Make sure that all from ``low`` to ``high`` is of a parameter's type and is allowed.

        Raises:
            InputError: it is not.
        """
        if kind.is_integer:
            if low == high != math.floor(low):
                raise InputError(f"parameter {name} must be a whole number, got {low:g}")
            low, high = math.ceil(low), math.floor(high)
            if low > high:
                raise InputError(f"parameter {name} must be a whole number, and the range has none")
        try:
            ends = [parse_literal(kind, repr(end)) for end in (low, high)]
        except FileFormatError as error:
            raise InputError(f"parameter {name} {error}") from None
        declaration = self._declared[name]
        groups = [_fixed(group) for group in declaration.constraint_groups]
        alone = [replace(declaration, constraint_groups=(group,)) for group in groups]
        known = self._values
        if groups and not any(
            all(not broken(parameter_declaration, end, known) for end in ends)
            for parameter_declaration in alone
        ):
            whole = replace(declaration, constraint_groups=tuple(groups))
            reasons = [text for end in ends for text in broken(whole, end, known)]
            reason = reasons[0] if reasons else f"may not have all values from {low:g} to {high:g}"
            raise InputError(f"parameter {name} {reason}")

    def _axis(self, name: str) -> Axis:
        said = self._said.get(f"{PARAMETER}.{name}.axis")
        # Never static: the map of a scenario file is one file, which no parameter changes.
        return Axis(said) if said in list(Axis) and said != Axis.STATIC else Axis.PARTICIPANTS

    def _unit(self, name: str) -> str:
        if name in self._words:
            return "1"
        return self._said.get(f"{PARAMETER}.{name}.unit", UNIT)

    @contextmanager
    def _saying(self, element: Element) -> Iterator[None]:
        """Record a problem with its line."""
        try:
            yield
        except InputError as error:
            self.problems += [f"{text} (line {element.line})" for text in error.problems]
