"""An exposure in the unit cube of a search."""

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError, ScenarioError
from bridgegen.scenario.exposure.exposure import Exposure
from bridgegen.scenario.exposure.reader import evenly
from bridgegen.scenario.language.space import SearchSpace

LEAST_KEPT = 0.98
"""Least share of an exposure's rows that a search can ask for; the others count as not met."""

_TRIED = 256  # rows of which it is tried whether a search can ask for them


class OnRoad:
    """How the rows of a search are distributed on the road: see `bridgegen.search.algorithms.Road`.

    Attributes:
        dimensions: number of distributed parameters.
        share: the feasible share of the exposure, and its interval: low, estimate, high.
        continuous: ``(dimensions,)``, which parameters do not take single values.

    Args:
        exposure: of the scenario.
        space: that is searched.

    Raises:
        InputError: the space holds a parameter at one value that the exposure varies; or the
            exposure contradicts the constraints.
    """

    def __init__(self, exposure: Exposure, space: SearchSpace) -> None:
        self._exposure, self._even, self._space = exposure, evenly(exposure), space
        self.dimensions, found = exposure.dimensions, exposure.feasible_share
        self.share = (found.low if found.estimate < 1.0 else 1.0, found.estimate, found.high)
        self.continuous: Bool = np.array([not one.apart for one in exposure.marginals.values()])
        if held := [name for name in exposure.names if name not in space.variables]:
            raise InputError(
                f"the exposure says how {', '.join(held)} varies, which this search holds at one "
                "value: search it, too (--axes, --fix), or leave it out of the exposure"
            )
        X = exposure.sample(_TRIED, 0).X
        kept = self._encoded(X)[1]
        if kept.mean() < LEAST_KEPT:
            try:
                space.encode(X[~kept])
            except ScenarioError as error:
                raise InputError(
                    f"{kept.mean():.0%} of the exposure's rows can be searched, and at least "
                    f"{LEAST_KEPT:.0%} must: {error.problems[0]} (--exposure)"
                ) from None

    def rows(self, Z: Float) -> tuple[Float, Bool, Float]:
        """See `bridgegen.search.algorithms.Road`."""
        X = self._exposure.from_normal(Z)
        good = self._exposure.feasible(X)
        U, log_even = np.full((len(Z), self._space.n_var), 0.5), np.zeros(len(Z))
        U[good], kept = self._encoded(X[good])
        good[good] = kept
        log_even[good] = self._even.log_density(X[good]) - self._exposure.log_density(X[good])
        return U, good, log_even

    def met(self, n: int, random: np.random.Generator) -> Float:
        """See `bridgegen.search.algorithms.Road`."""
        X = self._exposure.sample(n, int(random.integers(2**31))).X
        return self._exposure.to_normal(X)

    def even(self, n: int, random: np.random.Generator) -> tuple[Float, Bool]:
        """See `bridgegen.search.algorithms.Road`."""
        X = self._even.sample(n, int(random.integers(2**31))).X
        there: Bool = np.isfinite(self._exposure.log_density(X))
        Z = np.zeros((n, self.dimensions))
        Z[there] = self._exposure.to_normal(X[there])
        return Z, there

    def _encoded(self, X: Float) -> tuple[Float, Bool]:
        """Return the points of the cube that rows stand for, and which have one."""
        try:
            return self._space.encode(X), np.ones(len(X), np.bool_)
        except ScenarioError:  # at the very edge of a constraint, by rounding
            if len(X) == 1:
                return np.full((1, self._space.n_var), 0.5), np.zeros(1, np.bool_)
            half = len(X) // 2
            (U, kept), (others, more) = self._encoded(X[:half]), self._encoded(X[half:])
            return np.concatenate([U, others]), np.concatenate([kept, more])
