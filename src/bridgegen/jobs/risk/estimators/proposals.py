"""What importance sampling draws rows from.

A mixture of three: normal distributions fitted to points of the event; narrow ones around single
points of it, so that no region that was seen is left out; and, for a tenth of the rows, the
distribution of the road itself. The last one keeps all weights below ten.

Sources: Rubinstein and Kroese, The Cross-Entropy Method (2004); Owen and Zhou, Journal of the
American Statistical Association 95 (2000) 135-143 (defensive mixtures).
"""

from dataclasses import dataclass, replace

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.jobs.risk.estimators import mixture
from bridgegen.jobs.risk.estimators.mixture import Kernels, Mixture

# Kernels keep every region that was seen: proposals fitted to a single chain missed one of two half
# spaces, and claimed 0.67 of the truth with a narrow interval.
DEFENSIVE, AROUND = 0.1, 0.25
"""The shares of rows that are drawn as on the road, and around single points."""
FITTED, CENTRES = 500, 200  # points, at most
OF_CHAIN = 5.0  # points of chains are worth one independent one
_INFLATED = 1.2  # standard deviations: tails that are too thin make weights too large


@dataclass(frozen=True)
class Proposals:
    """What rows are drawn from."""

    fitted: Mixture
    kernels: Kernels

    @classmethod
    def of(cls, Z: Float, weights: Float, size: float, random: np.random.Generator) -> "Proposals":
        """Fit them to weighted points of the event.

        Args:
            Z: ``(M, d)``, M ≥ 1.
            weights: ``(M,)``, positive.
            size: how many independent points they are worth.
            random: chooses points and where components begin.
        """
        Z, first = np.unique(Z, axis=0, return_inverse=True)
        sums = np.bincount(first.reshape(-1), weights, len(Z)).astype(np.float64)
        p = sums / sums.sum()
        if len(Z) > FITTED:
            Z = Z[random.choice(len(Z), FITTED, p=p)]
            p = np.full(FITTED, 1.0 / FITTED)
        made = mixture.fit(Z, p, size, random)
        centres = Z[random.choice(len(Z), min(CENTRES, len(Z)), replace=False, p=p)]
        wide = replace(made, factors=made.factors * _INFLATED)
        return cls(wide, Kernels.around(centres, made.within))

    def also_around(self, points: Float) -> "Proposals":
        """Return proposals that are around more single points ``(K, d)``, too."""
        centres = np.concatenate([self.kernels.points, points])
        return replace(self, kernels=replace(self.kernels, points=centres))

    def draw(self, n: int, random: np.random.Generator) -> tuple[Float, Float]:
        """Draw n points; return them and their weights."""
        d = self.fitted.means.shape[1]
        Z = self.fitted.sample(n, random)
        kind = random.random(n)
        plain, around = kind < DEFENSIVE, kind >= 1.0 - AROUND
        Z[plain] = random.standard_normal((int(plain.sum()), d))
        Z[around] = self.kernels.sample(int(around.sum()), random)
        return Z, self.weights(Z)

    def weights(self, Z: Float) -> Float:
        """Return how much likelier points are on the road than among these proposals, ``(N,)``."""
        d = Z.shape[1]
        road = -0.5 * np.sum(Z * Z, axis=1) - 0.5 * d * np.log(2.0 * np.pi)
        parts = (
            (1.0 - DEFENSIVE - AROUND, self.fitted.log_density(Z)),
            (AROUND, self.kernels.log_density(Z)),
        )
        # Beyond e^700 a float64 overflows; such a row weighs nothing.
        ratio = sum(share * np.exp(np.minimum(part - road, 700.0)) for share, part in parts)
        found: Float = 1.0 / (DEFENSIVE + ratio)
        return found
