"""Whether importance sampling is believed beside what is known otherwise, and how high it may be.

What found the event also bounds what it has not seen: a region that proposals do not cover.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import scipy.special

from bridgegen.risk.estimators.problem import Aim
from bridgegen.risk.estimators.weighted import FEWEST_HITS, Weighted

MOST_UNSEEN = 0.9  # of the probability in regions that nobody has seen: no upper end to speak of
HEAVIEST = 0.2
"""Of the estimate at most may come from one row."""


@dataclass(frozen=True)
class Evidence:
    """What is known of an event before rows of proposals are drawn.

    Attributes:
        levels: what subset simulation found.
        spread: what rows found that are spread over the ranges.
        helped: whether further points of the event were given, of a search say.
        single: the share of the event's probability at single points.
    """

    levels: Weighted
    spread: Weighted
    helped: bool
    single: float

    def judge(self, result: Weighted, aim: Aim) -> Weighted:
        """Return a result with its doubts, its facts, and what regions nobody has seen may add.

        Subset simulation and exploration are heard in this order; who is not in doubt and agrees
        with the result bounds what it has not seen.
        """
        heard = [one for one in (self.levels, self.spread) if not one.doubts]
        if not heard:
            heard = [self.spread if len(self.spread.Z) and not self.helped else self.levels]
        found = [self._beside(known, result, aim) for known in heard]
        best = next((one for one in found if not one.doubts), found[0])
        return replace(best, facts={**best.facts, "spread": float(self.spread.rows)})

    def _beside(self, known: Weighted, result: Weighted, aim: Aim) -> Weighted:
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
        return replace(result, doubts=tuple(self._doubts(known, result, aim)), facts=facts)

    def _doubts(self, known: Weighted, result: Weighted, aim: Aim) -> Iterator[str]:
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
        """Return the share of the event's probability that proposals may not cover.

        Subset simulation that knows the probability to a relative standard error c has seen as much
        of it as n = 1 / c² independent harmful rows show; exploration, as much as its effective
        harmful rows do. Of n rows none is in a region that nobody has seen, and the share of single
        points at these: the upper end of the exact interval (Clopper and Pearson, 95 %), 3 / n if
        that share is 0.
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
