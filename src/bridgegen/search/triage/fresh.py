"""Fresh random draws of the search space: they follow from a run's seed; no record has them."""

import numpy as np

from bridgegen.assess.conflict.harm import NEAR_MISS
from bridgegen.base.arrays import Float
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.search.triage.record import Triage

FRESH = "fresh-"
"""Prefix of the files of failures among the fresh random draws, where no evaluation fails."""

_STREAM = 19  # of random numbers, apart from others of the same seed


def draw(space: SearchSpace, seed: int, n: int) -> tuple[Float, Float]:
    """Return n draws: rows of the unit cube, ``(n, n_var)``, and ``(n, len(space.names))``.

    Args:
        space: of the run.
        seed: of the run.
        n: how many.
    """
    # They follow from the seed, so no record of a run has to hold them.
    U = np.random.Generator(np.random.PCG64([seed, _STREAM])).random((n, space.n_var))
    return U, space.decode(U) + 0.0


def failing_draws(space: SearchSpace, found: Triage | None, keep: int) -> dict[str, Float]:
    """Return the harmful draws of a run without harmful evaluations, the worst first.

    Args:
        space: of the run.
        found: its triage.
        keep: how many at most.

    Returns:
        The names of their files, and the rows of X.
    """
    if found is None or found.fresh is None or found.bound.harmful:
        return {}
    harm = np.array([item or 0.0 for item in found.fresh.harm])
    _, X = draw(space, found.seed, len(harm))
    worst = np.argsort(-harm, kind="stable")[:keep].tolist()
    return {f"{FRESH}{k:02d}": X[i] for k, i in enumerate(worst, 1) if harm[i] >= NEAR_MISS}
