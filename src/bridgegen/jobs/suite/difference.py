"""Two egos on the same rows: what is fixed, what is broken, and how sure that is."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

from bridgegen.jobs.suite.results import EntryResult, RowResult, Verdict
from bridgegen.search.triage.bound import too_few

Change = Literal["fixed", "broken", "both fail", "both pass", "not comparable"]

CHANGES: tuple[Change, ...] = ("broken", "fixed", "both fail", "both pass", "not comparable")


@dataclass(frozen=True)
class RowChange:
    """What changes in one variation from the first ego to the second.

    Attributes:
        entry: of the suite, by name.
        row: number of the variation.
        change: the second passes what the first fails ("fixed"), the reverse ("broken"), …
        severity: second less first, of the probability of MAIS3+.
        harm: second less first.
        run: whether both have a result.
    """

    entry: str
    row: int
    change: Change
    severity: float
    harm: float
    run: bool = True


@dataclass(frozen=True)
class Difference:
    """Two egos on the same variations.

    Attributes:
        first: the ego that is compared with, as named.
        second: the ego that is compared.
        rows: what changes in each variation; of an entry that one of them cannot run, one.
        sampled: whether the variations are a sample, so that there are confidence intervals.
    """

    first: str
    second: str
    rows: tuple[RowChange, ...]
    sampled: bool = True

    @property
    def counts(self) -> dict[Change, int]:
        """The number of variations of each change."""
        found = Counter(one.change for one in self.rows)
        return {change: found[change] for change in CHANGES}

    @cached_property
    def unjudged(self) -> dict[str, str]:
        """By entry why it says nothing, of those of which too few variations can be compared."""
        of: dict[str, list[bool]] = {}
        for one in self.rows:
            of.setdefault(one.entry, []).append(one.change != "not comparable")
        whys = {
            entry: too_few(sum(known), len(known), "variations could be compared")
            if len(known) > 1 or known[0]
            else "it could not be compared"
            for entry, known in of.items()
        }
        return {entry: why for entry, why in whys.items() if why}

    def interval(self, change: Change) -> tuple[float, float]:
        """Return the 95 % interval of the share of a change among comparable variations.

        Source: Clopper and Pearson, Biometrika 26 (1934) 404. It holds where variations are a
        sample, as those of a logical scenario are; not where they are all that there are.
        """
        from scipy.stats import binomtest

        counts = self.counts
        n = len(self.rows) - counts["not comparable"]
        if not n:
            return 0.0, 1.0
        found = binomtest(counts[change], n).proportion_ci(0.95, "exact")
        return float(found.low), float(found.high)

    @property
    def p_value(self) -> float:
        """The probability of so uneven a number of fixed and broken variations by chance.

        Source: McNemar's test, exact (Psychometrika 12 (1947) 153).
        """
        from scipy.stats import binomtest

        counts = self.counts
        n = counts["fixed"] + counts["broken"]
        return float(binomtest(counts["broken"], n).pvalue) if n else 1.0


def difference(
    first: Sequence[EntryResult], second: Sequence[EntryResult], egos: tuple[str, str]
) -> Difference:
    """Compare the results of two egos on the same entries.

    Args:
        first: of the ego that is compared with, entry by entry.
        second: of the other, in the same order.
        egos: their names.
    """
    rows, sampled = list[RowChange](), True
    for a, b in zip(first, second, strict=True):
        if a.problem or b.problem or len(a.rows) != len(b.rows):
            rows.append(RowChange(a.entry, 0, "not comparable", 0.0, 0.0, run=False))
            continue
        sampled = sampled and a.sampled
        verdicts = zip(a.verdicts, b.verdicts, strict=True)
        rows += [_change(a.entry, i, a.rows[i], b.rows[i], both) for i, both in enumerate(verdicts)]
    return Difference(*egos, tuple(rows), sampled)


def _change(
    entry: str, row: int, a: RowResult, b: RowResult, verdicts: tuple[Verdict, Verdict]
) -> RowChange:
    change: Change = "not comparable"
    if not {"not run", "not judged"} & {*verdicts}:
        named: dict[tuple[bool, bool], Change] = {
            (True, True): "both fail",
            (True, False): "fixed",
            (False, True): "broken",
            (False, False): "both pass",
        }
        change = named[verdicts[0] == "failed", verdicts[1] == "failed"]
    run = "not run" not in verdicts
    return RowChange(entry, row, change, b.severity - a.severity, b.harm - a.harm, run)
