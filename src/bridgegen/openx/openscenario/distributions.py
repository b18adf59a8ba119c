"""Parameter distributions of a scenario, and their reader.

Source: ASAM OpenSCENARIO XML 1.1 to 1.3, ``ParameterValueDistribution``.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from bridgegen.base.errors import FileFormatError, InputError, UnsupportedError
from bridgegen.openx.openscenario.declarations import File, FileHeader, ParameterAssignment
from bridgegen.openx.openscenario.element import AtLeast, Element, Tag
from bridgegen.openx.openscenario.read import DISTRIBUTION
from bridgegen.openx.openscenario.reader import element_of
from bridgegen.openx.openscenario.values import Kind, LiteralString, parse_literal
from bridgegen.openx.xml import parse_xml
from bridgegen.scenario.language.distributions import (
    Discrete,
    Distribution,
    LogNormal,
    Normal,
    Uniform,
)
from bridgegen.scenario.language.distributions import Histogram as Bins

VERSIONS = ("1.1", "1.2", "1.3")

MOST_VALUES = 100_000
"""Largest number of values of a DistributionRange."""

_Double = Annotated[float, Kind.DOUBLE]  # a distribution file declares no parameters to refer to
_UnsignedInt = Annotated[int, Kind.UNSIGNED_INT]


@dataclass(frozen=True)
class Range(Element):
    """From a lower to an upper limit, both included."""

    lower_limit: _Double
    upper_limit: _Double


@dataclass(frozen=True)
class DistributionSetElement(Element):
    """A value."""

    value: LiteralString


@dataclass(frozen=True)
class DistributionSet(Element):
    """Some values."""

    elements: Annotated[tuple[DistributionSetElement, ...], AtLeast(1), Tag("Element")]


@dataclass(frozen=True)
class DistributionRange(Element):
    """The values from the lower limit on in equal steps."""

    range: Range
    step_width: _Double


@dataclass(frozen=True)
class DeterministicSingleParameterDistribution(Element):
    """The values of one parameter."""

    parameter_name: LiteralString
    distribution: DistributionSet | DistributionRange


@dataclass(frozen=True)
class ParameterValueSet(Element):
    """Values that several parameters have together."""

    assignments: Annotated[tuple[ParameterAssignment, ...], AtLeast(1), Tag("ParameterAssignment")]


@dataclass(frozen=True)
class ValueSetDistribution(Element):
    """Sets of values, one of which is taken."""

    sets: Annotated[tuple[ParameterValueSet, ...], AtLeast(1), Tag("ParameterValueSet")]


@dataclass(frozen=True)
class DeterministicMultiParameterDistribution(Element):
    """The values of several parameters, not independent of each other."""

    distribution: ValueSetDistribution


@dataclass(frozen=True)
class Deterministic(Element):
    """Distributions whose values are enumerated."""

    distributions: tuple[
        DeterministicMultiParameterDistribution | DeterministicSingleParameterDistribution, ...
    ] = ()


@dataclass(frozen=True)
class ProbabilityDistributionSetElement(Element):
    """A value and how often it comes, in proportion to the other weights."""

    value: LiteralString
    weight: _Double


@dataclass(frozen=True)
class ProbabilityDistributionSet(Element):
    """Some values, each with its weight."""

    elements: Annotated[tuple[ProbabilityDistributionSetElement, ...], AtLeast(1), Tag("Element")]


@dataclass(frozen=True)
class NormalDistribution(Element):
    """A normal distribution, cut off at the range."""

    expected_value: _Double
    variance: _Double
    range: Range | None = None


@dataclass(frozen=True)
class LogNormalDistribution(Element):
    """A log-normal distribution, cut off at the range; from 1.3 on."""

    expected_value: _Double
    variance: _Double
    range: Range | None = None


@dataclass(frozen=True)
class UniformDistribution(Element):
    """All values of a range, equally likely."""

    range: Range


@dataclass(frozen=True)
class PoissonDistribution(Element):
    """A Poisson distribution, cut off at the range."""

    expected_value: _Double
    range: Range | None = None


@dataclass(frozen=True)
class HistogramBin(Element):
    """A range and how often a value is in it, in proportion to the other weights."""

    range: Range
    weight: _Double


@dataclass(frozen=True)
class Histogram(Element):
    """Ranges, each with its weight."""

    bins: Annotated[tuple[HistogramBin, ...], AtLeast(1), Tag("Bin")]


@dataclass(frozen=True)
class StochasticDistribution(Element):
    """How one parameter is distributed."""

    parameter_name: LiteralString
    distribution: (
        ProbabilityDistributionSet
        | NormalDistribution
        | LogNormalDistribution
        | UniformDistribution
        | PoissonDistribution
        | Histogram
    )


@dataclass(frozen=True)
class Stochastic(Element):
    """Distributions to draw values from, how many times, and the seed of the random numbers."""

    number_of_test_runs: _UnsignedInt
    distributions: Annotated[
        tuple[StochasticDistribution, ...], AtLeast(1), Tag("StochasticDistribution")
    ]
    random_seed: _Double | None = None


@dataclass(frozen=True)
class ParameterValueDistribution(Element):
    """How the parameters of a scenario file are distributed."""

    scenario_file: Annotated[File, Tag("ScenarioFile")]
    definition: Deterministic | Stochastic


@dataclass(frozen=True)
class DistributionFile(Element):
    """A file with a distribution."""

    file_header: FileHeader
    parameter_value_distribution: ParameterValueDistribution


def is_distribution(path: Path) -> bool:
    """Return whether a file holds a distribution.

    Raises:
        FileFormatError: missing, unreadable, not well-formed, or hostile.
    """
    return parse_xml(path).find(DISTRIBUTION) is not None


def read_distribution(path: Path) -> ParameterValueDistribution:
    """Read a file with a distribution, of version 1.1 to 1.3.

    Raises:
        FileFormatError: missing, unreadable, not well-formed, hostile, malformed, or no such file;
            all that is wrong at once.
        UnsupportedError: a distribution that the user defines, or another version.
    """
    root = parse_xml(path)
    if root.tag != "OpenSCENARIO" or root.find(DISTRIBUTION) is None:
        raise FileFormatError(
            f"{path}: a file with a distribution must hold a {DISTRIBUTION} in OpenSCENARIO, and "
            "does not"
        )
    made = element_of(DistributionFile, root, str(path))
    header = made.file_header
    version = f"{header.rev_major}.{header.rev_minor}"
    if version not in VERSIONS:
        raise UnsupportedError(
            f"{path}: FileHeader must state a version of {', '.join(VERSIONS)}, got {version} "
            f"(line {header.line})"
        )
    return made.parameter_value_distribution


def distribution_of(
    given: DistributionSet
    | DistributionRange
    | ProbabilityDistributionSet
    | NormalDistribution
    | LogNormalDistribution
    | UniformDistribution
    | PoissonDistribution
    | Histogram,
) -> Distribution:
    """Return the contents of an element.

    Raises:
        InputError: it is no distribution.
    """
    match given:
        case DistributionSet():
            return Discrete.of([number(element.value) for element in given.elements])
        case ProbabilityDistributionSet():
            values = [number(element.value) for element in given.elements]
            return Discrete.of(values, [element.weight for element in given.elements])
        case DistributionRange():
            return _steps(given)
        case UniformDistribution():
            return Uniform(*_limits(given.range))
        case NormalDistribution():
            # A variance below 0 becomes the deviation 0, which Normal refuses with a message.
            deviation = math.sqrt(max(given.variance, 0.0))
            return Normal(given.expected_value, deviation, _optional(given.range))
        case LogNormalDistribution():
            return LogNormal.of(given.expected_value, given.variance, _optional(given.range))
        case PoissonDistribution():
            return Discrete.poisson(given.expected_value, _optional(given.range))
        case Histogram():
            bins = [_limits(bin_.range) for bin_ in given.bins]
            return Bins.of(bins, [bin_.weight for bin_ in given.bins])


def _steps(given: DistributionRange) -> Discrete:
    """Return lower, lower + step … up to the upper limit, which rounding may miss by a bit."""
    span, step = Uniform(*_limits(given.range)), given.step_width
    if not 0.0 < step < math.inf:
        raise InputError(f"stepWidth must be above 0, got {step:g}")
    count = (span.high - span.low) / step
    if count >= MOST_VALUES:
        raise InputError(f"a range may have {MOST_VALUES} steps, got {count:.6g}")
    # 0.1 to 0.7 in steps of 0.2 has four values, though (0.7 - 0.1) / 0.2 is 2.9999999999999996.
    steps = range(math.floor(count + 1e-9) + 1)
    return Discrete.of([min(span.low + k * step, span.high) for k in steps])


def _limits(given: Range) -> tuple[float, float]:
    return given.lower_limit, given.upper_limit


def _optional(given: Range | None) -> tuple[float, float] | None:
    return None if given is None else _limits(given)


def number(text: str) -> float:
    """Return the number that a text is.

    Raises:
        FileFormatError: it is none.
    """
    return float(parse_literal(Kind.DOUBLE, text))
