"""Bounds of a run for the whole space: its least margins, and the harmful share."""

from collections.abc import Sequence
from decimal import ROUND_CEILING, Context, Decimal

import numpy as np

from bridgegen.arrays import Bool, Float, Int, Numbers
from bridgegen.conflict.harm import COURSE, NEAR_MISS
from bridgegen.conflict.quantities import QUANTITIES
from bridgegen.regions.evidence import clopper_pearson
from bridgegen.regions.words import percent
from bridgegen.triage.record import Bound, Drawn, Estimate, Least

UNBIASED = ("random", "sobol")
"""The algorithms whose rows do not depend on results."""

MARGINS = ("harm", "course_ttc", "course_braking")

_DRAWN = {
    "random": "random draws",
    "sobol": "Sobol points, taken as independent draws",
    "fresh": "{} fresh random draws",
}


_MARGIN = {
    "harm": f"harm {{:.2f}} of {NEAR_MISS:g}",
    "course_ttc": "{:.2f} s to collision",
    "course_braking": "{:.2f} m/s² needed",
}


def estimate(drawn: Drawn, harmful: int, rows: int) -> Estimate:
    """Estimate a share of the space from independent rows, with its exact interval.

    Args:
        drawn: the source of the rows; "" if there are none.
        harmful: number of harmful rows.
        rows: number of rows with a result.

    Source: C. Clopper and E. Pearson, Biometrika 26 (1934); 95 %, two-sided.
    """
    if not drawn:
        return Estimate(drawn="", rows=0, harmful=0, share=None, low=0.0, high=1.0)
    low, high = clopper_pearson(harmful, rows)
    share = harmful / rows if rows else None
    return Estimate(drawn=drawn, rows=rows, harmful=harmful, share=share, low=low, high=high)


def least_margins(
    metrics: Numbers, names: Sequence[str], harm: Float, ids: Int, fit: Bool
) -> tuple[Least, ...]:
    """Return the rows with the least margin to harm, one for each recorded one of ``MARGINS``.

    Time to collision and deceleration count only in rows with a collision course that counts as
    harm: conflicts without the ego's fault are not its margins.

    Args:
        metrics: ``(N, M)``.
        names: of the M columns.
        harm: ``(N,)``.
        ids: ``(N,)`` evaluations.
        fit: ``(N,)`` bool, which have a result.
    """
    found = [_least("harm", harm, fit, ids)]
    for name in MARGINS[1:]:
        if name in names:
            column = metrics[:, list(names).index(name)]
            found.append(_least(name, column, fit & (harm >= COURSE), ids))
    return tuple(found)


def _least(name: str, column: Float, counts: Bool, ids: Int) -> Least:
    quantity = QUANTITIES[name]
    worth = np.where(counts & np.isfinite(column), quantity.sign * column, -np.inf)
    k = int(np.lexsort((ids, -worth))[0]) if len(worth) else 0  # the earliest of equal ones
    known = len(worth) > 0 and bool(np.isfinite(worth[k]))
    return Least(
        quantity=name, unit=quantity.unit, value=float(column[k]) if known else None,
        evaluation=int(ids[k]) if known else None,
    )  # fmt: skip


def bound(
    *,
    evaluations: int,
    failed: int,
    implausible: int,
    harmful: int,
    space: Estimate,
    least: tuple[Least, ...],
    modes: int,
    ego: str,
    baseline: str = "",
) -> Bound:
    """Return the bound of the space, in figures and in words."""
    fails = f"{ego} fails, and {baseline} does not," if baseline else f"{ego} fails"
    such = "harmful with it alone" if baseline else "harmful"
    none = f"No scenario in which {fails} was found" if baseline else "No failure found"
    if evaluations == failed:
        text = f"No evaluation has a result, so nothing is known of {ego}."
    elif harmful:
        text = (
            f"{fails} in {modes} way{'s' * (modes != 1)}: {harmful} of {evaluations} "
            f"evaluations; {_of_the_space(space, such)}."
        )
    else:
        besides = ""
        if space.drawn == "fresh" and space.harmful:
            besides = f", but in {space.harmful} of {space.rows} fresh random draws"
        text = (
            f"{none} in {evaluations} evaluations{besides}: {_margin(least)}; "
            f"{_of_the_space(space, such)}."
        )
    return Bound(
        evaluations=evaluations, failed=failed, implausible=implausible, harmful=harmful,
        space=space, least=least, sentence=text,
    )  # fmt: skip


def _of_the_space(space: Estimate, such: str) -> str:
    """Return the share of the space that is such, with its interval."""
    if not space.drawn or not space.rows:
        return (
            f"the share of the space that is {such} is not estimated, for the search chose its rows"
        )
    by = _DRAWN[space.drawn].format(space.rows)
    if not space.harmful:
        return f"with 95 % confidence at most {_at_most(space.high)} of the space is {such} ({by})"
    return (
        f"{percent(space.share or 0.0)} of the space is {such} ({_percent(space.low)} to "
        f"{_percent(space.high)} with 95 % confidence, {by})"
    )


def _margin(least: Sequence[Least]) -> str:
    of = {one.quantity: one for one in least}
    parts = []
    for name, words in _MARGIN.items():
        one = of.get(name)
        if one is not None and one.value is not None and one.evaluation is not None:
            parts.append(f"{words.format(one.value)} (evaluation {one.evaluation + 1})")
    return "least margin " + ", ".join(parts) if parts else "no margin is known"


def _at_most(share: float) -> str:
    """Return an upper bound in per cent, rounded up to two digits, so that it remains one."""
    rounded = Context(prec=2, rounding=ROUND_CEILING).create_decimal(Decimal(share) * 100)
    return f"{rounded.normalize():f} %"


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %" if share < 0.0995 else percent(share)
