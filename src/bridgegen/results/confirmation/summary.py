"""The key figures of a confirmation."""

from collections.abc import Iterable
from dataclasses import dataclass
from statistics import median
from typing import Any

from bridgegen.base.statistics import wilson
from bridgegen.results.confirmation.record import Scenario


@dataclass(frozen=True)
class Spread:
    """The absolute value of a quantity over several scenarios.

    Attributes:
        n: scenarios that have the quantity.
        median: over these; None if there are none.
        max: likewise.
    """

    n: int
    median: float | None
    max: float | None

    @classmethod
    def of(cls, values: Iterable[float | None]) -> "Spread":
        """Return the spread of numbers; None is skipped."""
        there = [abs(value) for value in values if value is not None]
        return cls(len(there), median(there) if there else None, max(there, default=None))


@dataclass(frozen=True)
class ConfirmationSummary:
    """The key figures of a confirmation.

    Attributes:
        scenarios: how many were requested.
        confirmed: how many are critical there, too.
        not_run: how many failed there; they are not judged.
        contacts: how many have a contact in both, only here, only there.
        robust: of those that ran and whose neighbours were tested, how many are robust, and how
            many of these are confirmed.
        knife_edge: likewise of those that are harmful in fewer than half of their neighbours.
        harm: differences of harm; empty in records of earlier versions.
        d_min: differences of d_min [m].
        v_d: differences of v_d [m/s].
        F: differences of the objective, if there is only one.
        contact: differences of the time of the first contact [s], if both have one.
        parted: time of the first divergence [s], if there is one.
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
        """The number of scenarios that ran there."""
        return self.scenarios - self.not_run

    @property
    def lost(self) -> int:
        """The number of scenarios that ran there and are not critical."""
        return self.ran - self.confirmed

    @property
    def share(self) -> float | None:
        """Confirmed scenarios / scenarios that ran; None if none ran."""
        return self.confirmed / self.ran if self.ran else None

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's 95 % interval of the share, valid for independent draws."""
        return wilson(self.confirmed, self.ran)


def summarise(scenarios: Iterable[Scenario]) -> ConfirmationSummary:
    """Return the key figures of scenarios."""
    every = list(scenarios)
    ran = [
        (scenario.here, scenario.there, scenario.change, scenario.differences)
        for scenario in every
        if scenario.there and scenario.change and scenario.differences
    ]
    contacts = [(here.contact is not None, there.contact is not None) for here, there, *_ in ran]
    change = [item for _, _, item, _ in ran]
    partings = [found.partings for *_, found in ran]
    return ConfirmationSummary(
        scenarios=len(every),
        confirmed=sum(there.critical for _, there, *_ in ran),
        not_run=len(every) - len(ran),
        contacts=(
            contacts.count((True, True)),
            contacts.count((True, False)),
            contacts.count((False, True)),
        ),
        robust=_of_tested(every, knife_edge=False),
        knife_edge=_of_tested(every, knife_edge=True),
        harm=Spread.of(item.harm for item in change),
        d_min=Spread.of(item.d_min for item in change),
        v_d=Spread.of(item.v_d for item in change),
        F=Spread.of(item.F[0] for item in change if len(item.F) == 1),
        contact=Spread.of(item.contact for item in change),
        parted=Spread.of(each[0].time for each in partings if each),
    )


def _of_tested(every: Iterable[Scenario], *, knife_edge: bool) -> tuple[int, int]:
    """Return how many robust, or knife-edge, scenarios ran, and how many are confirmed."""
    ran = [
        scenario.confirmed
        for scenario in every
        if scenario.there and scenario.robustness is not None and scenario.knife_edge == knife_edge
    ]
    return len(ran), sum(map(bool, ran))


def to_json(summary: ConfirmationSummary) -> dict[str, Any]:
    """Return a summary in JSON types."""
    low, high = summary.interval
    both, here, there = summary.contacts
    spreads = {
        name: {"n": item.n, "median": item.median, "max": item.max}
        for name in ("harm", "d_min", "v_d", "F", "contact", "parted")
        for item in [getattr(summary, name)]
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
