"""An exposure as a ``ParameterValueDistribution`` of OpenSCENARIO XML 1.3.

The standard has normal, log-normal, uniform and Poisson distributions, histograms and sets of
values, each of one parameter: other forms become histograms, and dependence is left out.
"""

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.base.errors import UnsupportedError
from bridgegen.base.units import percent
from bridgegen.openx.openscenario import distributions as dst
from bridgegen.openx.openscenario.declarations import File, FileHeader
from bridgegen.openx.openscenario.write import to_xml
from bridgegen.scenario.exposure.exposure import Exposure
from bridgegen.scenario.exposure.families import LogNormal, Normal
from bridgegen.scenario.exposure.marginals import Conditional, Marginal, Shared, Truncated
from bridgegen.scenario.language.distributions import Discrete, Uniform
from bridgegen.scenario.language.parameters import Parameter

BINS = 100
"""Number of bins of a histogram, of equal width."""


def distribution_xml(exposure: Exposure, *, runs: int = 1000, date: str) -> bytes:
    """Return the file of an exposure's distribution.

    Args:
        exposure: which.
        runs: how many test runs the file asks for.
        date: of the file, in ISO 8601.

    Raises:
        UnsupportedError: a distribution that depends on other parameters.
    """
    parameters = exposure.scenario.parameters
    made = tuple(
        dst.StochasticDistribution(name, _element(marginal, parameters[name]))
        for name, marginal in exposure.marginals.items()
    )
    header = FileHeader(
        1, 3, date, f"Distribution of the parameters of {exposure.scenario.name}", "BridgeGen"
    )
    scenario = File(f"{exposure.scenario.name}.xosc")
    definition = dst.Stochastic(runs, made, 0.0)
    return to_xml(
        dst.DistributionFile(header, dst.ParameterValueDistribution(scenario, definition))
    )


def left_out(exposure: Exposure) -> list[str]:
    """Return what of an exposure the file does not hold, a sentence each."""
    notes = []
    matrix = exposure.copula.matrix
    if np.any(matrix != np.eye(len(matrix))) or np.isfinite(exposure.copula.freedom):
        notes.append("OpenSCENARIO has no correlations: the file's parameters are independent")
    if exposure.feasible_share.estimate < 1.0:
        notes.append(
            "the file does not hold the scenario's constraints: "
            f"{percent(1.0 - exposure.feasible_share.estimate)} of its values break one"
        )
    if exposure.encounters is not None:
        notes.append("OpenSCENARIO has no rates: the file does not hold the encounters")
    return notes


_Element = (
    dst.ProbabilityDistributionSet
    | dst.NormalDistribution
    | dst.LogNormalDistribution
    | dst.UniformDistribution
    | dst.Histogram
)


def _element(marginal: Marginal | Conditional, parameter: Parameter) -> _Element:
    if isinstance(marginal, Conditional):
        raise UnsupportedError(
            f"OpenSCENARIO has no distribution that depends on other parameters, as that of "
            f"{marginal.label} does"
        )
    if isinstance(marginal, Shared) and isinstance(marginal.distribution, Discrete):
        given = marginal.distribution
        return dst.ProbabilityDistributionSet(
            tuple(
                dst.ProbabilityDistributionSetElement(str(parameter.kind.written(value)), weight)
                for value, weight in zip(given.values, given.weights, strict=True)
            )
        )
    within = dst.Range(marginal.low, marginal.high)
    if isinstance(marginal, Shared) and isinstance(marginal.distribution, Uniform):
        return dst.UniformDistribution(within)
    if isinstance(marginal, Truncated) and marginal.family is Normal:
        mean, deviation = (float(number) for number in marginal.numbers)
        return dst.NormalDistribution(mean, deviation**2, within)
    if isinstance(marginal, Truncated) and marginal.family is LogNormal and marginal.low > 0.0:
        median, deviation = (float(number) for number in marginal.numbers)
        mean = median * elementary.exp(0.5 * deviation**2)
        return dst.LogNormalDistribution(mean, mean**2 * elementary.expm1(deviation**2), within)
    return _histogram(marginal)


def _histogram(marginal: Marginal) -> dst.Histogram:
    edges = np.linspace(marginal.low, marginal.high, BINS + 1)
    below, above = marginal.tails(edges)
    weights: Float = np.where(below[1:] <= 0.5, below[1:] - below[:-1], above[:-1] - above[1:])
    return dst.Histogram(
        tuple(
            dst.HistogramBin(dst.Range(low, high), max(weight, 0.0))
            for low, high, weight in zip(
                edges[:-1].tolist(), edges[1:].tolist(), weights.tolist(), strict=True
            )
        )
    )
