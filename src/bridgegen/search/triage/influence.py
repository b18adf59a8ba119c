"""Which parameters matter for a run's failures, and whether failures lie at the end of a range."""

from collections.abc import Sequence

import numpy as np

from bridgegen.base.arrays import Bool, Numbers
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.search.triage.moves import searched
from bridgegen.search.triage.record import Influence

END = 0.025
"""Share of a range that is its end."""

AT_END = 0.25
"""Least share of failures at an end of a range to be stated."""

LEAST_ROWS = 5
"""Least number of rows that fail, and of rows that do not, for an influence to be stated."""

MOST_OTHERS = 50_000
"""Largest number of other rows that are compared; of more, evenly chosen ones."""

SIGNIFICANT = 0.01
"""Probability of a distance by chance, times the number of parameters, below which it counts."""


def influences(space: SearchSpace, X: Numbers, fails: Bool, ok: Bool) -> tuple[Influence, ...]:
    """Return the parameters whose values differ between failures and other rows, most first.

    The difference is the Kolmogorov-Smirnov distance of the two samples, which is 0 where they are
    alike and 1 where a single limit separates them. It describes the rows of the run: an algorithm
    that draws near failures sees other distances than random draws do.

    Args:
        space: the search space.
        X: ``(N, len(space.names))``.
        fails: ``(N,)``.
        ok: ``(N,)``, rows with a result.

    Source: N. Smirnov, Ann. Math. Stat. 19 (1948), 279-281; Bonferroni's correction.
    """
    others = np.flatnonzero(ok & ~fails)
    bad, good = X[fails], X[others[:: max(1, -(-len(others) // MOST_OTHERS))]]
    if min(len(bad), len(good)) < LEAST_ROWS:
        return ()
    from scipy.stats import ks_2samp

    V, W = searched(space, bad), searched(space, good)
    found = []
    for k, name in enumerate(space.variables):
        parameter = space.parameters[name]
        distance, p = ks_2samp(V[:, k], W[:, k], method="asymp")
        # Bonferroni: of many parameters, one would else be significant by chance.
        p = min(1.0, float(p) * space.n_var)
        if p >= SIGNIFICANT:
            continue
        low = high = 0
        if not parameter.kind.names and parameter.kind.turn is None:
            end = END * (parameter.high - parameter.low)
            # What begins at 0, or ends at 100 %, ends there by its nature: it cannot be widened.
            if parameter.low != 0.0:
                low = int((V[:, k] <= parameter.low + end).sum())
            if (parameter.high, parameter.unit) != (100.0, "%"):
                high = int((V[:, k] >= parameter.high - end).sum())
        found.append(
            Influence(
                name=name, distance=float(distance), p=p, failures=len(V), at_low=low, at_high=high
            )
        )
    return tuple(sorted(found, key=lambda influence: (-influence.distance, influence.name)))


def ends_in_words(found: Sequence[Influence]) -> list[str]:
    """Return of each parameter at whose end many failures lie, how many; the most first."""
    said = []
    for influence in found:
        for n, end in ((influence.at_low, "lower"), (influence.at_high, "upper")):
            if n >= AT_END * influence.failures:
                said.append(
                    (
                        n,
                        f"{n} of {influence.failures} failures lie at the {end} end of "
                        f"{influence.name}",
                    )
                )
    return [text for _, text in sorted(said, key=lambda each: -each[0])]


def in_words(found: Sequence[Influence], most: int = 3) -> str:
    """Return in one line which parameters matter most; "" if none does."""
    return ", ".join(f"{influence.name} ({influence.distance:.2f})" for influence in found[:most])
