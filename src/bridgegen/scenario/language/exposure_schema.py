"""The shape of an exposure: of a scenario file's block, and of a file of its own.

What the sections become, and the rules that they keep besides:
    `bridgegen.scenario.exposure.reader`.
"""

from typing import Annotated, Literal

from pydantic import Field

from bridgegen.scenario.language.parameterisation import Parameterisation
from bridgegen.scenario.language.schema_types import (
    Formula,
    Number,
    NumberOrName,
    ShapedSection,
    Text,
)

FormName = Literal[
    "uniform",
    "normal",
    "lognormal",
    "exponential",
    "gamma",
    "weibull",
    "beta",
    "pareto",
    "histogram",
    "discrete",
    "polygon",
    "kde",
    "mixture",
]

ScenarioName = Annotated[
    str, Field(strict=True, pattern=r"^([A-Za-z0-9_-]{1,64}/)?[A-Za-z0-9][A-Za-z0-9_-]{0,63}$")
]


class TailSection(ShapedSection):
    """A generalised Pareto tail beyond a threshold, in place of the form's own."""

    threshold: Formula
    """Value at which the tail begins, in the parameter's unit."""
    share: Number
    """Probability beyond the threshold."""
    scale: Formula
    """Scale of the excess over the threshold, in the parameter's unit."""
    shape: Number
    """Shape of the tail: exponential at 0, heavier above 0, of finite length below 0."""


class FormSection(ShapedSection):
    """A form and its numbers; which of them it needs depends on the form."""

    distribution: FormName
    """Form of the distribution, which is truncated at ``low`` and ``high``."""
    low: Formula | None = None
    """Smallest value; that of the parameter's range by default."""
    high: Formula | None = None
    """Largest value; that of the parameter's range by default."""
    mean: Formula | None = None
    """Mean before truncation, of normal and exponential."""
    deviation: Formula | None = None
    """Standard deviation before truncation, of normal."""
    median: Formula | None = None
    """Median before truncation, of lognormal."""
    log_deviation: Formula | None = None
    """Standard deviation of the natural logarithm, of lognormal."""
    shape: Formula | None = None
    """Shape parameter of gamma, weibull and pareto."""
    scale: Formula | None = None
    """Scale parameter of gamma, weibull and pareto, in the parameter's unit."""
    threshold: Formula | None = None
    """Value at which pareto begins."""
    alpha: Formula | None = None
    """First shape parameter of beta, which reaches from ``low`` to ``high``."""
    beta: Formula | None = None
    """Second shape parameter of beta, which reaches from ``low`` to ``high``."""
    edges: Annotated[list[Formula], Field(min_length=2, max_length=10_001)] | None = None
    """Edges of the bins of histogram, ascending."""
    values: Annotated[list[NumberOrName], Field(min_length=1, max_length=10_000)] | None = None
    """Values of discrete: numbers, or names of a category."""
    weights: Annotated[list[Number], Field(min_length=1, max_length=10_000)] | None = None
    """Weights of histogram's bins or discrete's values, of any sum; equal by default."""
    at: Annotated[list[Formula], Field(min_length=2, max_length=10_000)] | None = None
    """Positions of polygon's corners, ascending."""
    density: Annotated[list[Number], Field(min_length=2, max_length=10_000)] | None = None
    """Density at polygon's corners, linear between them, of any integral."""
    file: Text | None = None
    """Table (.csv) beside this file with the data of kde."""
    column: Text | None = None
    """Column of kde's table; the parameter's name by default."""
    bandwidth: Formula | None = None
    """Standard deviation of kde's kernels, in the parameter's unit."""


class PartSection(FormSection):
    """A part of a mixture."""

    weight: Number
    """Share of this part in the mixture; the shares may have any sum."""


class MarginalSection(FormSection):
    """How one parameter is distributed."""

    parts: Annotated[list[PartSection], Field(min_length=1, max_length=100)] | None = None
    """Parts of the distribution ``mixture``."""
    upper_tail: TailSection | None = None
    """Generalised Pareto tail above a threshold."""
    lower_tail: TailSection | None = None
    """Generalised Pareto tail below a threshold."""
    source: Text | None = None
    """Source of these numbers, if other than the block's source."""


class CorrelationSection(ShapedSection):
    """The correlation of two parameters."""

    between: Annotated[list[Text], Field(min_length=2, max_length=2)]
    """Names of the two parameters."""
    value: Number
    """Correlation of the parameters' scores, above -1 and below 1."""


class DependenceSection(ShapedSection):
    """How parameters depend on each other, besides formulas."""

    correlation: list[CorrelationSection] = []
    """Correlations of the copula; pairs that are not named have 0."""
    degrees_of_freedom: Number | None = None
    """Degrees of freedom of Student's copula, from 2: the fewer, the likelier are the parameters
    that have a correlation extreme together. The copula is Gaussian by default."""


class EncountersSection(ShapedSection):
    """How often the scenario was met, and in how much driving."""

    count: Annotated[int, Field(strict=True)]
    """Number of encounters that were counted."""
    hours: Number | None = None
    """Duration of the driving in which encounters were counted [h]."""
    km: Number | None = None
    """Distance of the driving in which encounters were counted [km]."""
    source: Text
    """Source of the numbers."""


class ExposureSection(ShapedSection):
    """How often a scenario is met, and with which values of its parameters."""

    source: Text
    """Source of the numbers."""
    parameters: dict[str, MarginalSection] = {}
    """Distributions of the parameters, by name. Constraints of the scenario truncate the joint
    distribution."""
    others: Literal["uniform", "default"] | None = None
    """Treatment of searched parameters that are not named: uniform over their range, or at their
    default."""
    dependence: DependenceSection = DependenceSection()
    """Dependence between the parameters; independent by default."""
    encounters: EncountersSection | None = None
    """Frequency with which the scenario is met."""
    parameterisation: Parameterisation | None = None
    """What the parameters leave out of recorded events, as verdicts that change."""


class ExposureFile(ShapedSection):
    """A file with the exposure of a scenario."""

    exposure_of: ScenarioName
    """Name of the scenario."""
    exposure: ExposureSection
    """Exposure of the scenario: the same block as in a scenario file."""
