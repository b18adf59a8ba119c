"""Compares importance sampling with subset simulation and exploration, and states its doubts.

These two found the event first. How many independent harmful rows they saw bounds the probability
of a harmful region that they missed, and that the proposals do not cover.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import scipy.special

from bridgegen.jobs.risk.estimators.problem import Aim
from bridgegen.jobs.risk.estimators.weighted import FEWEST_HITS, Weighted

MOST_UNSEEN = 0.9
"""Maximum share of the probability in regions that were not found; the upper end is ten times the
sampled one then, and says little."""
HEAVIEST = 0.2
"""Maximum share of the estimate that may come from one row."""


@dataclass(frozen=True)
class Evidence:
    """What is known of an event before rows are drawn from the proposals.

    Attributes:
        levels: result of subset simulation.
        spread: result of exploration, by rows that are spread over the ranges.
        helped: whether further points of the event were given, for example by a search.
        single: share of the event's probability at single points.
    """

    levels: Weighted
    spread: Weighted
    helped: bool
    single: float

    def judge(self, result: Weighted, aim: Aim) -> Weighted:
        """Return a result of importance sampling with its doubts, facts and final upper end.

        It is compared with subset simulation and then with exploration, unless these are in doubt.
        The first one that agrees raises the upper end by what it may have missed.
        """
        believed = [one for one in (self.levels, self.spread) if not one.doubts]
        if not believed:
            believed = [self.spread if len(self.spread.Z) and not self.helped else self.levels]
        found = [self._compared(result, known, aim) for known in believed]
        best = next((one for one in found if not one.doubts), found[0])
        return replace(best, facts={**best.facts, "spread": float(self.spread.rows)})

    def _compared(self, result: Weighted, known: Weighted, aim: Aim) -> Weighted:
        """Return a result with the doubts, facts and upper end that one known result implies."""
        low, share, high = result.share
        result = replace(result, share=(low, share, high / (1.0 - self._unseen(known, aim))))
        facts = {
            "effective_hits": result.hits(result.there(aim.threshold)),
            "heaviest": _heaviest(result, aim),
            "single": self.single,
            "reached": known.facts.get("reached", 1.0),
        }
        if "explored_hits" in known.facts:
            facts["explored_hits"] = known.facts["explored_hits"]
        return replace(result, doubts=tuple(self._doubts(result, known, aim)), facts=facts)

    def _doubts(self, result: Weighted, known: Weighted, aim: Aim) -> Iterator[str]:
        """Yield why a result is not believed, a sentence each."""
        if known.doubts and self.helped:
            yield (
                f"subset simulation is in doubt ({known.doubts[0]}), so harm other than what the "
                "search found is not bounded; what it found is counted"
            )
        else:
            yield from known.doubts
        hits, heaviest = result.hits(result.there(aim.threshold)), _heaviest(result, aim)
        found = result.probability(aim.threshold)
        if hits < FEWEST_HITS:
            yield (
                f"the effective number of harmful rows is {hits:.0f}, and {FEWEST_HITS:.0f} are "
                "needed"
            )
        elif heaviest > HEAVIEST:
            yield f"one row makes {heaviest:.0%} of the estimate: a region was missed"
        expected = known.probability(aim.threshold)
        before = "subset simulation" if known.repetitions else "exploration"
        more = found.low > expected.high and not self.helped  # a search may have found the rest
        if not known.doubts and (more or expected.low > found.high):
            yield (
                f"{before} says {expected.low:.2g} to {expected.high:.2g}, and importance "
                f"sampling {found.low:.2g} to {found.high:.2g}"
            )

    def _unseen(self, known: Weighted, aim: Aim) -> float:
        """Return an upper bound of the event's probability that proposals do not cover, a share.

        A known result is worth n independent harmful rows. For subset simulation n = 1 / c², where
        c is the relative standard error; for exploration n is its effective number of harmful rows.
        None of the n rows lies in a region that was not found, and the share `single` of them is at
        single points. The bound is the upper end of the exact interval for that share (Clopper and
        Pearson, one-sided, 95 %): about 3 / n without single points.
        """
        there = known.there(aim.threshold)
        if known.repetitions:
            sums = known.sums(there)
            if len(sums) < 2 or not sums.mean() > 0.0:
                return MOST_UNSEEN
            error = float(sums.std(ddof=1) / sums.mean())
            n = len(sums) / max(error * error, 1e-12)
        else:
            n = known.hits(there)
        missed = min(self.single * n, n)
        if n - missed <= 0.0:
            return MOST_UNSEEN
        return min(float(scipy.special.betaincinv(missed + 1.0, n - missed, 0.95)), MOST_UNSEEN)


def _heaviest(result: Weighted, aim: Aim) -> float:
    """Return the share of the estimate that the heaviest row has."""
    parts = result.weights * result.there(aim.threshold)
    total = float(parts.sum())
    return float(parts.max()) / total if total > 0.0 else 0.0
