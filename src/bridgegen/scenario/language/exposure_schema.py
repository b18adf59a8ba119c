"""The shape of an exposure: of a scenario file's block, and of a file of its own.

What the sections become, and the rules that they keep besides:
    `bridgegen.scenario.exposure.reader`.
"""

from typing import Annotated, Literal

from pydantic import Field

from bridgegen.scenario.language.shape import Formula, Number, NumberOrName, ShapedSection, Text

FormName = Literal[
    "uniform", "normal", "lognormal", "exponential", "gamma", "weibull", "beta", "pareto",
    "histogram", "discrete", "polygon", "kde", "mixture",
]  # fmt: skip

ScenarioName = Annotated[
    str, Field(strict=True, pattern=r"^([A-Za-z0-9_-]{1,64}/)?[A-Za-z0-9][A-Za-z0-9_-]{0,63}$")
]


class TailSection(ShapedSection):
    """A generalised Pareto tail beyond a threshold, in place of the form's own."""

    threshold: Formula
    """Where it begins, in the parameter's unit."""
    share: Number
    """The probability beyond the threshold."""
    scale: Formula
    """Of the excess, in the parameter's unit."""
    shape: Number
    """0: exponential; above: heavier; below: it ends."""


class FormSection(ShapedSection):
    """A form and its numbers; which of them it needs depends on the form."""

    distribution: FormName
    """The form, cut off at ``low`` and ``high``."""
    low: Formula | None = None
    """Smallest value; of the parameter's range by default."""
    high: Formula | None = None
    """Largest value; of the parameter's range by default."""
    mean: Formula | None = None
    """normal, exponential: of the whole distribution, before it is cut off."""
    deviation: Formula | None = None
    """normal: standard deviation before it is cut off."""
    median: Formula | None = None
    """lognormal: before it is cut off."""
    log_deviation: Formula | None = None
    """lognormal: standard deviation of the natural logarithm."""
    shape: Formula | None = None
    """gamma, weibull, pareto."""
    scale: Formula | None = None
    """gamma, weibull, pareto: in the parameter's unit."""
    threshold: Formula | None = None
    """pareto: where it begins."""
    alpha: Formula | None = None
    """beta, from ``low`` to ``high``."""
    beta: Formula | None = None
    """beta, from ``low`` to ``high``."""
    edges: Annotated[list[Formula], Field(min_length=2, max_length=10_001)] | None = None
    """histogram: ends of the bins, ascending."""
    values: Annotated[list[NumberOrName], Field(min_length=1, max_length=10_000)] | None = None
    """discrete: numbers, or names of a category."""
    weights: Annotated[list[Number], Field(min_length=1, max_length=10_000)] | None = None
    """histogram, discrete: of the bins or values, of any sum; equal by default."""
    at: Annotated[list[Formula], Field(min_length=2, max_length=10_000)] | None = None
    """polygon: places of its corners, ascending."""
    density: Annotated[list[Number], Field(min_length=2, max_length=10_000)] | None = None
    """polygon: density at its corners, linear between them, of any integral."""
    file: Text | None = None
    """kde: a table (.csv) beside this file."""
    column: Text | None = None
    """kde: the table's column; the parameter's name by default."""
    bandwidth: Formula | None = None
    """kde: standard deviation of the kernels, in the parameter's unit."""


class PartSection(FormSection):
    """A part of a mixture."""

    weight: Number
    """Its share of the mixture, of any sum."""


class MarginalSection(FormSection):
    """How one parameter is distributed."""

    parts: Annotated[list[PartSection], Field(min_length=1, max_length=100)] | None = None
    """mixture: its parts."""
    upper_tail: TailSection | None = None
    """Above a threshold: peaks over it."""
    lower_tail: TailSection | None = None
    """Below a threshold: how far values fall short of it."""
    source: Text | None = None
    """Where these numbers come from, if not from the block's source."""


class CorrelationSection(ShapedSection):
    """The correlation of two parameters."""

    between: Annotated[list[Text], Field(min_length=2, max_length=2)]
    """Two parameters."""
    value: Number
    """Of their normal scores, above -1 and below 1."""


class DependenceSection(ShapedSection):
    """How parameters depend on each other, besides formulas."""

    correlation: list[CorrelationSection] = []
    """A Gaussian copula: pairs that are not named have 0."""


class EncountersSection(ShapedSection):
    """How often the scenario was met, and in how much driving."""

    count: Annotated[int, Field(strict=True)]
    """Encounters that were counted."""
    hours: Number | None = None
    """Of driving in which they were counted [h]."""
    km: Number | None = None
    """Of driving in which they were counted [km]."""
    source: Text
    """Where the numbers come from."""


class ExposureSection(ShapedSection):
    """How often a scenario is met, and with which values of its parameters."""

    source: Text
    """Where the numbers come from."""
    parameters: dict[str, MarginalSection] = {}
    """By name: how it is distributed. Constraints of the scenario cut the joint distribution."""
    others: Literal["uniform", "default"] | None = None
    """Searched parameters that are not named: spread evenly over their range, or at default."""
    dependence: DependenceSection = DependenceSection()
    """How they depend on each other; independent by default."""
    encounters: EncountersSection | None = None
    """How often the scenario is met."""


class ExposureFile(ShapedSection):
    """A file with the exposure of a scenario."""

    exposure_of: ScenarioName
    """The scenario's name."""
    exposure: ExposureSection
    """The same block as in a scenario file."""
