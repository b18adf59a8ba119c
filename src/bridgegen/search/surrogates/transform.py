"""Objectives as numbers that a Gaussian process can learn."""

from bridgegen.arrays import Float


def normal_scores(F: Float) -> Float:
    """Return the normal scores of objectives: the standard normal quantiles of their ranks.

    They keep the order alone. Outliers, plateaus and infinite values do no harm: equal values have
    equal scores, those of their mean rank.

    Args:
        F: ``(n,)`` float64, no NaN.

    Returns:
        ``(n,)`` float64, finite.

    Source: Blom (1958), "Statistical Estimates and Transformed Beta-Variables", for the 3/8.
    """
    from scipy.special import ndtri
    from scipy.stats import rankdata

    scores: Float = ndtri((rankdata(F) - 0.375) / (len(F) + 0.25))
    return scores
