"""What a confirmation comes to."""

from collections.abc import Iterable
from dataclasses import dataclass
from statistics import median
from typing import Any

from bridgegen.confirmation.schema import Scenario
from bridgegen.regions.evidence import wilson


@dataclass(frozen=True)
class Spread:
    """How large something is over several scenarios, whatever its sign.

    Attributes:
        n: scenarios that have it.
        median: over these; None of none.
        max: likewise.
    """

    n: int
    median: float | None
    max: float | None

    @classmethod
    def of(cls, values: Iterable[float | None]) -> "Spread":
        """Return that of some numbers; those that do not exist are left out."""
        there = [abs(one) for one in values if one is not None]
        return cls(len(there), median(there) if there else None, max(there, default=None))


@dataclass(frozen=True)
class Summary:
    """What a confirmation comes to.

    Attributes:
        scenarios: that were run again, or were to be.
        confirmed: that are critical there, too.
        not_run: that failed there; they say nothing.
        contacts: those with a contact in both, here alone, there alone.
        robust: of those that ran and whose neighbours were tested, how many are robust, and how
            many of these are confirmed.
        knife_edge: likewise of the others, harmful in fewer than half of their neighbours.
        harm: differences of harm, of those that ran; of none in records of earlier versions.
        d_min: differences of d_min [m], of those that ran.
        v_d: of v_d [m/s].
        F: of the objective, where there is one.
        contact: of the time of the first contact [s], of those with one in both.
        parted: when the first entity parted [s], of those where one did.
    """

    scenarios: int
    confirmed: int
    not_run: int
    contacts: tuple[int, int, int]
    robust: tuple[int, int]
    knife_edge: tuple[int, int]
    harm: Spread
    d_min: Spread
    v_d: Spread
    F: Spread
    contact: Spread
    parted: Spread

    @property
    def ran(self) -> int:
        """Scenarios that ran there."""
        return self.scenarios - self.not_run

    @property
    def lost(self) -> int:
        """Scenarios that ran there and are not critical."""
        return self.ran - self.confirmed

    @property
    def share(self) -> float | None:
        """Confirmed of those that ran; None of none."""
        return self.confirmed / self.ran if self.ran else None

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's, with 95 %: of the share, were the scenarios independent draws."""
        return wilson(self.confirmed, self.ran)


def summarise(scenarios: Iterable[Scenario]) -> Summary:
    """Return what some scenarios come to."""
    every = list(scenarios)
    ran = [
        (one.here, one.there, one.change, one.differences)
        for one in every
        if one.there and one.change and one.differences
    ]
    touches = [(here.contact is not None, there.contact is not None) for here, there, *_ in ran]
    change = [one for _, _, one, _ in ran]
    partings = [found.partings for *_, found in ran]
    return Summary(
        scenarios=len(every),
        confirmed=sum(there.critical for _, there, *_ in ran),
        not_run=len(every) - len(ran),
        contacts=(
            touches.count((True, True)),
            touches.count((True, False)),
            touches.count((False, True)),
        ),
        robust=_of_tested(every, knife_edge=False),
        knife_edge=_of_tested(every, knife_edge=True),
        harm=Spread.of(one.harm for one in change),
        d_min=Spread.of(one.d_min for one in change),
        v_d=Spread.of(one.v_d for one in change),
        F=Spread.of(one.F[0] for one in change if len(one.F) == 1),
        contact=Spread.of(one.contact for one in change),
        parted=Spread.of(each[0].time for each in partings if each),
    )


def _of_tested(every: Iterable[Scenario], *, knife_edge: bool) -> tuple[int, int]:
    """Return how many robust, or knife-edge, scenarios ran, and how many are confirmed."""
    ran = [
        one.confirmed
        for one in every
        if one.there and one.robustness is not None and one.knife_edge == knife_edge
    ]
    return len(ran), sum(map(bool, ran))


def to_json(summary: Summary) -> dict[str, Any]:
    """Return a summary as JSON's types."""
    low, high = summary.interval
    both, here, there = summary.contacts
    spreads = {
        name: {"n": one.n, "median": one.median, "max": one.max}
        for name in ("harm", "d_min", "v_d", "F", "contact", "parted")
        for one in [getattr(summary, name)]
    }
    return {
        "scenarios": summary.scenarios,
        "ran": summary.ran,
        "confirmed": summary.confirmed,
        "lost": summary.lost,
        "not_run": summary.not_run,
        "share": summary.share,
        "interval": [low, high],
        "robust": {"ran": summary.robust[0], "confirmed": summary.robust[1]},
        "knife_edge": {"ran": summary.knife_edge[0], "confirmed": summary.knife_edge[1]},
        "contacts": {"both": both, "here_alone": here, "there_alone": there},
        "differences": spreads,
    }
