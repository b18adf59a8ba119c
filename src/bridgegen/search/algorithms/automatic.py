"""Which search algorithm `auto` is: the one that found most in its place, by measurement."""

AUTO = "auto"
"""Name of the automatic choice of an algorithm."""

RATE = "rate"
"""Name of the algorithm whose rows also say how often."""

MOST_MODELLED = 100_000
"""Largest number of rows for which models of the space are known to be worth their time."""
MOST_PARAMETERS = 40
"""Number of parameters beyond which a Gaussian process of some hundred rows says little."""


def automatic(rows: int, parameters: int, *, many: bool, closed_loop: bool) -> str:
    """Return the name of the algorithm for a search (docs/decisions/search.md has the figures).

    Args:
        rows: of the search.
        parameters: that are searched.
        many: whether several objectives are optimised.
        closed_loop: whether a participant's decisions are searched, too.
    """
    if many:
        return "nsga2"
    if rows <= MOST_MODELLED and parameters <= MOST_PARAMETERS and not closed_loop:
        return "surrogate"
    return "es"
