"""From the sections of an exposure to distributions, with the rules that each form keeps."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from bridgegen.base.errors import InputError
from bridgegen.base.units import has_unit, in_unit
from bridgegen.scenario.exposure.candidates import estimate
from bridgegen.scenario.exposure.families import FAMILIES, Beta, Pareto
from bridgegen.scenario.exposure.marginals import (
    Clipped,
    Conditional,
    Form,
    Marginal,
    Mirrored,
    Mixture,
    Polygon,
    Shared,
    Spliced,
    Truncated,
)
from bridgegen.scenario.exposure.tables import cell_reader, read_table
from bridgegen.scenario.language.distributions import Discrete, Histogram, Uniform
from bridgegen.scenario.language.exposure_schema import FormSection, MarginalSection, TailSection
from bridgegen.scenario.language.expression import Expression, parse
from bridgegen.scenario.language.parameters import Parameter, nearest

_RANGE = ("low", "high")
_TAILS = ("upper_tail", "lower_tail")
_KEYS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "uniform": ((), _RANGE),
    **{name: (family.keys, (*_RANGE, *_TAILS)) for name, family in FAMILIES.items()},
    "histogram": (("edges",), ("weights",)),
    "discrete": (("values",), ("weights",)),
    "polygon": (("at", "density"), _TAILS),
    "kde": (("file", "bandwidth"), ("column", *_RANGE, *_TAILS)),
    "mixture": (("parts",), ()),
}
"""Keys that a form needs, and keys that it may have, by form."""

_ALWAYS = ("distribution", "source", "weight")
_MOST_WHOLE = 10_000


@dataclass(frozen=True)
class Naming:
    """What the formulas of an exposure may name.

    Attributes:
        names: parameters and derived quantities.
        categories: the names of the values of each category.
        folder: of the file, for the tables that it names; None where it lies in no folder.
    """

    names: frozenset[str]
    categories: Mapping[str, Sequence[str]]
    folder: Path | None


def build_marginal(
    given: FormSection, parameter: Parameter, naming: Naming, place: str
) -> Form | Conditional:
    """Return the distribution of a parameter.

    Args:
        given: its section.
        parameter: of which.
        naming: what formulas may name.
        place: file and line, for messages.

    Raises:
        InputError: what is wrong with it, without the place; all of it where parts do not depend
            on each other.
    """
    label = f"{parameter.name} [{parameter.unit}]"
    _check_keys(given)
    builder = _Builder(given, parameter, naming, place, label)
    form = given.distribution
    if parameter.kind.apart and form not in ("uniform", "discrete"):
        raise InputError(
            f"{label} takes single values: its distribution must be uniform or discrete, got {form}"
        )
    if form == "uniform":
        return builder.uniform()
    if form == "discrete":
        return builder.discrete()
    if form == "histogram":
        return builder.histogram()
    if form == "mixture":
        return builder.mixture()
    body: Form | Conditional
    if form == "polygon":
        body = builder.polygon()
    elif form == "kde":
        body = builder.kernels()
    else:
        body = builder.family()
    return builder.with_tails(body)


def _check_keys(given: FormSection) -> None:
    form = given.distribution
    needs, may = _KEYS[form]
    problems = [
        f"distribution {form} must have the key '{key}'"
        for key in needs
        if getattr(given, key, None) is None
    ]
    problems += [
        f"distribution {form} has no key '{key}'; it has {', '.join((*needs, *may)) or 'none'}"
        for key in sorted(given.model_fields_set)
        if key not in (*_ALWAYS, *needs, *may) and getattr(given, key) is not None
    ]
    if problems:
        raise InputError(*problems)


@dataclass(frozen=True)
class _Builder:
    given: FormSection
    parameter: Parameter
    naming: Naming
    place: str
    label: str

    def uniform(self) -> Shared:
        low, high = self.range()
        if not self.parameter.kind.apart:
            return Shared(Uniform(low, high))
        if high - low > _MOST_WHOLE:
            raise InputError(f"{self.label} may have {_MOST_WHOLE:,} values to be distributed over")
        whole = np.arange(np.ceil(low), np.floor(high) + 1.0)
        return Shared(Discrete.of(whole.tolist()))

    def discrete(self) -> Shared:
        values = [self.parameter.read(item) for item in self.given.values or ()]
        for value, given in zip(values, self.given.values or (), strict=True):
            self.inside(value, f"the value {given}")
            kept = self.parameter.kind.kept(np.array([value]))
            if kept and not kept[0][0]:
                raise InputError(f"{self.label} must be {kept[1]}, got {given}")
        self.same_number("values", len(values))
        return Shared(Discrete.of(values, self.given.weights))

    def histogram(self) -> Shared:
        edges = [self.number("edges", edge) for edge in self.given.edges or ()]
        self.ascending("edges", edges)
        self.same_number("edges less one", len(edges) - 1)
        weights = self.given.weights or [1.0] * (len(edges) - 1)
        return Shared(Histogram.of(list(pairwise(edges)), weights))

    def polygon(self) -> Polygon:
        at = [self.number("at", value) for value in self.given.at or ()]
        heights = self.given.density or []
        self.ascending("at", at)
        if len(heights) != len(at):
            raise InputError(
                f"density must have as many numbers as at, got {len(heights)} and {len(at)}"
            )
        if not all(0.0 <= height < np.inf for height in heights):
            raise InputError("density must be at least 0 and finite everywhere")
        with np.errstate(over="ignore"):
            area = float(np.trapezoid(heights, at))
        if not 0.0 < area < np.inf:
            raise InputError(f"density must have an integral above 0 and finite, got {area:g}")
        return Polygon(tuple(at), tuple(heights))

    def kernels(self) -> Polygon:
        name, folder = self.given.file or "", self.naming.folder
        # A file from somebody else must not have us read any other file, and show its numbers in a
        # page.
        if folder is None or Path(name).is_absolute() or ".." in Path(name).parts:
            raise InputError(f"the table of a kde lies beside the file that names it, got '{name}'")
        column = self.given.column or self.parameter.name
        values = read_table(folder / name, {column: cell_reader(self.parameter)}).columns[column]
        low, high = self.range()
        inside = values[(low <= values) & (values <= high)]
        if len(np.unique(inside)) < 2:
            raise InputError(
                f"a kde needs two different values from {low:g} to {high:g}, and column {column} "
                f"of {name} has fewer"
            )
        bandwidth = self.number("bandwidth", self.given.bandwidth)
        if not 0.0 < bandwidth < np.inf:
            raise InputError(f"bandwidth must be above 0 and finite, got {bandwidth:g}")
        return estimate(inside, bandwidth, low, high)

    def family(self) -> Truncated | Conditional:
        family = FAMILIES[self.given.distribution]
        low, high = self.range()
        numbers: list[float] = []
        formulas: list[Expression] = []
        for key in family.keys:
            expression = self.formula(
                key, getattr(self.given, key), measured=key in family.measured
            )
            formulas.append(expression)
            if not expression.names:
                numbers.append(float(expression.evaluate({})))
        if len(numbers) == len(formulas):
            return Truncated(family, tuple(numbers), low, high)
        return Conditional(family, tuple(formulas), low, high, f"{self.label} ({self.place})")

    def mixture(self) -> Mixture:
        parts = (self.given.parts if isinstance(self.given, MarginalSection) else None) or []
        made: list[tuple[Marginal, float]] = []
        for number, part in enumerate(parts, 1):
            if part.distribution in ("discrete", "mixture"):
                raise InputError(f"part {number} of a mixture must be no {part.distribution}")
            try:
                shared = build_marginal(part, self.parameter, self.naming, self.place)
            except InputError as error:
                raise InputError(*(f"part {number}: {text}" for text in error.problems)) from None
            if isinstance(shared, Conditional):
                raise InputError(f"part {number} of a mixture must have numbers, not formulas")
            if not 0.0 < part.weight < np.inf:
                raise InputError(f"weight of part {number} must be above 0, got {part.weight:g}")
            made.append((shared, part.weight))
        total = sum(weight for _, weight in made)
        return Mixture(tuple((marginal, weight / total) for marginal, weight in made))

    def with_tails(self, body: Form | Conditional) -> Form | Conditional:
        upper, lower = (getattr(self.given, key, None) for key in _TAILS)
        if upper is None and lower is None:
            return body
        if isinstance(body, Conditional):
            raise InputError("a distribution with formulas has no tails of its own")
        pieces: list[tuple[Marginal, float]] = []
        shares = [item.share for item in (upper, lower) if item is not None]
        if not (all(share > 0.0 for share in shares) and sum(shares) < 1.0):
            raise InputError(
                f"the shares of tails must be above 0, and below 1 together, got "
                f"{', '.join(f'{share:g}' for share in shares)}"
            )
        start, end = self.range()
        if lower is not None:
            start, tail = self.tail(lower, -1.0)
            pieces.append((tail, lower.share))
        if upper is not None:
            end, above = self.tail(upper, 1.0)
        pieces.append((_between(body, start, end), 1.0 - sum(shares)))
        if upper is not None:
            pieces.append((above, upper.share))
        return Spliced(tuple(pieces))

    def tail(self, given: TailSection, sign: float) -> tuple[float, Marginal]:
        """Return the threshold, and what is beyond it."""
        low, high = self.range()
        threshold = self.number("threshold", given.threshold)
        scale = self.number("scale", given.scale)
        if not low < threshold < high:
            raise InputError(
                f"the threshold of a tail must be between {low:g} and {high:g}, got {threshold:g}"
            )
        if sign > 0.0:
            return threshold, Truncated(Pareto, (threshold, given.shape, scale), threshold, high)
        beyond = Truncated(Pareto, (0.0, given.shape, scale), 0.0, threshold - low)
        return threshold, Mirrored(beyond, threshold)

    # -- numbers -------------------------------------------------------------------------------

    def formula(self, key: str, given: float | str | None, *, measured: bool) -> Expression:
        text = given if isinstance(given, str) else repr(given)
        if isinstance(given, str) and measured and has_unit(given):
            text = repr(self.number(key, given))
        expression = parse(text, "", self.naming.categories)
        for name in sorted(expression.names - self.naming.names):
            raise InputError(f"{key} names the unknown '{name}'{nearest(name, self.naming.names)}")
        if self.parameter.name in expression.names:
            raise InputError(f"{key} depends on {self.parameter.name} itself")
        return expression

    def number(self, key: str, given: float | str | None) -> float:
        """Return a number in the parameter's unit."""
        if isinstance(given, str):
            try:
                return in_unit(given, self.parameter.unit)
            except ValueError as error:
                raise InputError(f"{key} {error}, got '{given}'") from None
        assert given is not None
        return float(given)

    def range(self) -> tuple[float, float]:
        """Return where the distribution is cut off."""
        low, high = self.parameter.low, self.parameter.high
        if self.given.low is not None:
            low = self.number("low", self.given.low)
            self.inside(low, "low")
        if self.given.high is not None:
            high = self.number("high", self.given.high)
            self.inside(high, "high")
        if not low < high:
            raise InputError(f"low < high must hold, got low={low:g}, high={high:g}")
        return low, high

    def inside(self, value: float, what: str) -> None:
        low, high = self.parameter.low, self.parameter.high
        if not low <= value <= high:
            raise InputError(
                f"{what} must be in the range of {self.label}, {low:g} to {high:g}, got {value:g}"
            )

    def ascending(self, key: str, numbers: Sequence[float]) -> None:
        for low, high in pairwise(numbers):
            if not low < high:
                raise InputError(f"{key} must ascend, got {low:g} and then {high:g}")
        for number in numbers:
            self.inside(number, key)

    def same_number(self, what: str, count: int) -> None:
        weights = self.given.weights
        if weights is not None and len(weights) != count:
            raise InputError(
                f"as many weights as {what} must be given, got {len(weights)} and {count}"
            )


def _between(body: Form, low: float, high: float) -> Form:
    """Return what a body is between the thresholds of its tails."""
    # A beta distribution is of its range: cut at other ends it would be another one, so it is
    # clipped.
    if isinstance(body, Truncated) and body.family is not Beta:
        return Truncated(body.family, body.numbers, low, high)
    return Clipped(body, max(low, body.low), min(high, body.high))
