"""Bounds of a run for the whole space: its least margins, and the harmful share."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from decimal import ROUND_CEILING, Context, Decimal
from typing import Self

import numpy as np

from bridgegen.assess.conflict import analysis
from bridgegen.assess.conflict.findings import KINDS, Findings, is_excused
from bridgegen.assess.conflict.happening import Happening
from bridgegen.assess.conflict.harm import COURSE, NEAR_MISS
from bridgegen.assess.conflict.quantities import QUANTITIES
from bridgegen.assess.conflict.types import Rule
from bridgegen.base.arrays import Bool, Float, Int, Numbers
from bridgegen.base.statistics import clopper_pearson
from bridgegen.base.units import percent
from bridgegen.search.triage.record import NOT_JUDGED, Bound, Drawn, Estimate, Least, Met, Verdict

Avoids = Callable[[Int], Bool]
"""Function that says of rows ``(K,)`` whether a careful driver has no collision in them, ``(J,)``,
J <= K."""

UNBIASED = ("random", "sobol")
"""The algorithms whose rows do not depend on results."""

MARGINS = ("harm", "course_ttc", "course_braking")

_DRAWN = {
    "random": "random draws",
    "sobol": "Sobol points, taken as independent draws",
    "fresh": "{} fresh random draws",
}


_MARGIN = {
    "harm": f"harm {{:.2f}}, failures start at {NEAR_MISS:g}",
    "course_ttc": "{:.2f} s to collision",
    "course_braking": "{:.2f} m/s² needed",
}


def estimate(drawn: Drawn, harmful: int, rows: int, *, met: Met = False) -> Estimate:
    """Estimate a share of the space from independent rows, with its exact interval.

    Args:
        drawn: the source of the rows; "" if there are none.
        harmful: number of harmful rows.
        rows: number of rows with a result.
        met: see `Estimate`.

    Source: C. Clopper and E. Pearson, Biometrika 26 (1934); 95 %, two-sided.
    """
    # Nothing is known of the share: its interval is the whole range.
    if not drawn:
        return Estimate(drawn="", rows=0, harmful=0, share=None, low=0.0, high=1.0)
    low, high = clopper_pearson(harmful, rows)
    share = harmful / rows if rows else None
    return Estimate(
        drawn=drawn, rows=rows, harmful=harmful, share=share, low=low, high=high, met=met
    )


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
        quantity=name,
        unit=quantity.unit,
        value=float(column[k]) if known else None,
        evaluation=int(ids[k]) if known else None,
    )


@dataclass(frozen=True)
class NotCounted:
    """What a run has seen and does not count as a failure.

    Attributes:
        conflicts: by ("contact" or "near miss", rule that excuses the ego) the number of rows.
        implausible: by reason the number of rows whose traffic could not happen.
        collisions: rows of implausible traffic in which the ego collides.
        failed: rows without a result.
        avoided: of the excused collisions that a careful driver drove again, how many it avoided.
        driven_again: the number of these.
    """

    conflicts: Mapping[tuple[str, str], int]
    implausible: Mapping[str, int]
    collisions: int
    failed: int
    avoided: int = 0
    driven_again: int = 0

    @classmethod
    def of(cls, findings: Findings, harm: Float, ok: Bool, avoids: Avoids | None = None) -> Self:
        """Return what N rows hold.

        Args:
            findings: of the rows.
            harm: ``(N,)``.
            ok: ``(N,)`` bool, which have a result.
            avoids: says of some rows, by their positions, whether a careful driver has no
                collision in them; None: it is not known.
        """
        contact, odd = findings.conflict == CONTACT, ok & (findings.implausible != "")
        excused = ok & is_excused(findings, harm)
        pairs = zip(findings.conflict[excused], findings.rule[excused], strict=True)
        again = avoids(np.flatnonzero(excused & contact)) if avoids else np.zeros(0, np.bool_)
        return cls(
            Counter(pairs),
            Counter(findings.implausible[odd].tolist()),
            int((odd & contact).sum()),
            int((~ok).sum()),
            int(again.sum()),
            len(again),
        )

    @property
    def unsafe(self) -> int:
        """Rows in which there was no time to act from the start on: nothing can be said of them."""
        return sum(n for (_, rule), n in self.conflicts.items() if rule == Rule.UNSAFE_START.label)

    @property
    def by_foresight(self) -> str:
        """Of excused collisions, that another driver avoids them, in words.

        Rules of responsibility ask what braking can do once the danger is there; a careful driver
        also slows down before.
        """
        return f"a careful driver avoids {self.avoided} of {self.driven_again}"

    @property
    def sentence(self) -> str:
        """In words; "" if all counts."""
        parts = []
        for kind, (name, many) in _KIND.items():
            rules = {rule: n for (what, rule), n in self.conflicts.items() if what == kind}
            if rules:
                total = sum(rules.values())
                also = f"; {self.by_foresight}" if kind == CONTACT and self.avoided else ""
                parts.append(f"{total} {name if total == 1 else many} ({_listed(rules)}{also})")
        if self.implausible:
            total = sum(self.implausible.values())
            also = f"; {self.collisions} of them collisions" if self.collisions else ""
            traffic = f"{total} with implausible traffic ({_listed(self.implausible)}{also})"
            parts.append(traffic)
        if self.failed:
            parts.append(f"{self.failed} without a result")
        return "not counted: " + ", ".join(parts) if parts else ""


CONTACT, NEAR = KINDS[analysis.CONTACT], KINDS[analysis.NEAR_MISS]
_KIND = {CONTACT: ("collision", "collisions"), NEAR: ("near miss", "near misses")}

JUDGED = 0.5
"""Share of a run's evaluations that must be judged, so that no failure among them says anything."""


def _listed(counts: Mapping[str, int]) -> str:
    """Return numbers by name, the largest first."""
    ordered = sorted(counts.items(), key=lambda pair: (-pair[1], pair[0]))
    return ", ".join(f"{name or 'no rule'} {n}" for name, n in ordered)


def too_few(judged: int, n: int, what: str) -> str:
    """Return that too few of N could be judged for a verdict, in words; "" if enough could.

    Args:
        judged: how many could.
        n: all of them.
        what: they are, in the plural, and what could be done with them.
    """
    if judged and judged >= JUDGED * n:
        return ""
    return f"{f'only {judged}' if judged else 'none'} of {n} {what}"


def _unjudged(evaluations: int, besides: NotCounted, happening: Happening) -> str:
    """Return why a run without failures says nothing of its driver; "" if it does."""
    left_out = besides.failed + sum(besides.implausible.values()) + besides.unsafe
    if few := too_few(evaluations - left_out, evaluations, "evaluations could be judged"):
        return few
    if not happening.happened:
        return "the scenario did not happen: " + "; ".join(happening.reasons)
    return happening.domain


def bound(
    *,
    evaluations: int,
    besides: NotCounted,
    happening: Happening,
    harmful: int,
    space: Estimate,
    least: tuple[Least, ...],
    modes: int,
    ego: str,
    baseline: str = "",
    in_repeats: int = 0,
) -> Bound:
    """Return the bound of the space, in figures and in words."""
    fails = f"{ego} fails, and {baseline} does not," if baseline else f"{ego} fails"
    such = "harmful with it alone" if baseline else "harmful"
    none = f"No scenario in which {fails} was found" if baseline else "No failure found"
    failed, implausible = besides.failed, sum(besides.implausible.values())
    verdict: Verdict = "no failure found"
    if harmful:
        verdict = "fails"
        text = (
            f"{fails} in {modes} way{'s' * (modes != 1)}: {harmful} of {evaluations} "
            f"evaluations; {_of_the_space(space, such)}."
        )
    # Fresh draws are evaluations, too. In bus-pulls-out with `reference` none of 300 evaluations
    # failed and one of 256 draws did: the verdict was "no failure found" above "0.39 % fail".
    elif space.drawn == "fresh" and space.harmful:
        verdict = "fails"
        text = (
            f"{fails} in {space.harmful} of {space.rows} fresh random draws, though in none of "
            f"{evaluations} evaluations: {_margin(least)}; {_of_the_space(space, such)}."
        )
    elif in_repeats:
        verdict = "fails"
        text = (
            f"{fails} in repeats of {in_repeats} of the evaluations that came nearest to failing, "
            f"though in none of {evaluations} evaluations at first: {_of_the_space(space, such)}."
        )
    # A run that says nothing of its driver must not pass: 6 of 27 such runs were once called "no
    # failure found".
    elif evaluations == failed:
        verdict, text = NOT_JUDGED, f"Not judged: no evaluation of {ego} has a result."
    elif why := _unjudged(evaluations, besides, happening):
        verdict, text = NOT_JUDGED, f"Not judged: {why}."
    else:
        but = f", but {besides.by_foresight} collisions not counted" if besides.avoided else ""
        text = (
            f"{none} in {evaluations} evaluations{but}: {_margin(least)}; "
            f"{_of_the_space(space, such)}."
        )
    return Bound(
        evaluations=evaluations,
        failed=failed,
        implausible=implausible,
        harmful=harmful,
        space=space,
        least=least,
        verdict=verdict,
        not_counted=besides.sentence,
        in_repeats=in_repeats,
        sentence=text,
    )


def _of_the_space(space: Estimate, such: str) -> str:
    """Return the share of the space that is such, with its interval."""
    if not space.drawn or not space.rows:
        return f"how much of the space is {such} is unknown: the search chose its rows on purpose"
    by = _DRAWN[space.drawn].format(space.rows) + (f", {space.measure}" if space.met else "")
    if not space.harmful:
        return f"with 95 % confidence at most {_at_most(space.high)} of the space is {such} ({by})"
    return (
        f"{percent(space.share or 0.0)} of the space is {such} ({_percent(space.low)} to "
        f"{_percent(space.high)} with 95 % confidence, {by})"
    )


def _margin(least: Sequence[Least]) -> str:
    of = {element.quantity: element for element in least}
    parts = []
    for name, words in _MARGIN.items():
        item = of.get(name)
        if item is not None and item.value is not None and item.evaluation is not None:
            parts.append(f"{words.format(item.value)} (evaluation {item.evaluation + 1})")
    return "closest: " + ", ".join(parts) if parts else "no margin is known"


def _at_most(share: float) -> str:
    """Return an upper bound in per cent, rounded up to two digits, so that it remains one."""
    # Rounded up: an upper bound that is rounded down is none.
    rounded = Context(prec=2, rounding=ROUND_CEILING).create_decimal(Decimal(share) * 100)
    return f"{rounded.normalize():f} %"


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %" if share < 0.0995 else percent(share)
