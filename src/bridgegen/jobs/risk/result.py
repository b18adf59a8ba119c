"""A risk: probabilities with intervals, rates, what carries them; and its files."""

import io
import json
from collections.abc import Mapping
from csv import writer
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.disk import write_whole
from bridgegen.jobs.frame import Judged, Table
from bridgegen.jobs.risk.cross_simulator import Elsewhere
from bridgegen.jobs.risk.estimators.total import DRAWS
from bridgegen.jobs.risk.estimators.weighted import FEWEST_HITS, Probability, Weighted
from bridgegen.jobs.risk.experiment import Estimated
from bridgegen.jobs.risk.extremes import Extreme, of_near_misses
from bridgegen.jobs.risk.options import FIGURES, WORDS
from bridgegen.jobs.risk.outcomes import EVENTS, INJURY, Column, DataBand
from bridgegen.scenario.exposure import Exposure
from bridgegen.scenario.exposure.exposure import Rate
from bridgegen.scenario.typology import published

RECORD, PAGE, TABLE = "risk.json", "risk.html", "harmful.csv"
MOST_ROWS = 100_000  # of the table
BINS = 10  # equally likely classes of a parameter
COMPARED = 20_000  # rows of the exposure, which harmful ones are compared with


@dataclass(frozen=True)
class Finding:
    """A probability, or why it is not known.

    Attributes:
        probability: None where it is not believed.
        hits: the effective number of rows behind it.
        doubt: why it is not believed; empty where it is.
    """

    probability: Probability | None
    hits: float
    doubt: str = ""


@dataclass(frozen=True)
class ParameterShare:
    """How a parameter's values differ between harmful rows and the road.

    Attributes:
        name: of the parameter.
        unit: of its values.
        distance: of both distributions, 0 (harm does not depend on it) to 1: the share of the
            probability that would have to move (total variation, by tenths of the road's values).
        harmful: its 5 %, 50 % and 95 % quantiles among harmful rows.
        road: likewise, on the road.
        shares: ``(BINS,)`` of harmful rows in each tenth of the road's values.
    """

    name: str
    unit: str
    distance: float
    harmful: tuple[float, float, float]
    road: tuple[float, float, float]
    shares: Float


@dataclass(frozen=True)
class Likely:
    """The harmful encounter of a failure mode that is most likely on the road.

    Attributes:
        mode: the failure mode's words.
        x: its row, ``(len(space.names),)``.
        name: of its scenario's files, without suffix.
        picture: it as a moving picture, SVG.
        sentence: what happens.
    """

    mode: str
    x: Float
    name: str
    picture: str
    sentence: str


@dataclass(frozen=True)
class Risk:
    """How likely harm is in a scenario, for one driver.

    Attributes:
        exposure: how its parameters are distributed.
        driver: of the ego.
        event: the event that was aimed at, of `events.EVENTS`.
        count: whose conflicts count.
        estimated: the method and what it found.
        seed: of all random numbers.
        budget: evaluations, at most.
        modes: the words of failure modes, by their number in outcomes.
        failed: rows without a result; they count as harmless.
        implausible: rows whose traffic could not happen; likewise.
        check: the same event by Monte Carlo, if that was asked for.
        data: how much few data leave open, if the events of the exposure are known.
        elsewhere: the event in another simulator, if that was asked for.
        most_likely: the most likely harmful encounters, of each failure mode one, the likeliest
            failure mode first.
        command: makes it again.
        folder: of its files.
    """

    exposure: Exposure
    driver: str
    event: str
    count: str
    estimated: Estimated
    seed: int
    budget: int
    modes: tuple[str, ...]
    failed: int
    implausible: int
    check: Weighted | None
    data: DataBand | None
    elsewhere: Elsewhere | None
    most_likely: tuple[Likely, ...]
    command: str
    folder: Path

    @property
    def weighted(self) -> Weighted:
        """The outcomes with their weights."""
        return self.estimated.weighted

    @property
    def believed(self) -> bool:
        """Whether the event's interval is believed."""
        return self.probability(self.event) is not None

    @cached_property
    def findings(self) -> dict[str, Finding]:
        """The probability of each event per encounter, by name; and of a serious injury."""
        return {name: self._finding(self._values(name)) for name in (*EVENTS, INJURY)}

    def probability(self, name: str) -> Probability | None:
        """Return the probability of an event per encounter; None where it is not believed."""
        return self.findings[name].probability

    @property
    def preventable(self) -> Finding | None:
        """The event where the ego is responsible or could prevent it; None if only those count."""
        if self.count == "ego":
            return None
        own = self.weighted.outcomes[:, Column.OWN] >= EVENTS[self.event].score
        return self._finding(self._values(self.event) * own)

    @cached_property
    def by_mode(self) -> dict[str, Finding]:
        """The probability of the event by failure mode, most likely first."""
        values, number = self._values(self.event), self.weighted.outcomes[:, Column.MODE]
        parts = self.weighted.weights * values
        sums = {words: float(parts[number == k].sum()) for k, words in enumerate(self.modes)}
        order = sorted((sum_ for sum_ in sums if sums[sum_] > 0.0), key=lambda name: -sums[name])
        return {name: self._finding(values * (number == self.modes.index(name))) for name in order}

    @property
    def stated(self) -> tuple[tuple[str, str | None, Finding], ...]:
        """What is stated, in order: words, the event's name for its rate, and the finding."""
        found = [(WORDS[name], name, finding) for name, finding in self.findings.items()]
        if self.preventable is not None:
            words = f"{WORDS[self.event]}, preventable"
            return (*found, (words, None, self.preventable))
        return tuple(found)

    def rate(self, name: str, unit: str) -> Rate | None:
        """Return how often an event happens per hour or km; None where that is not known.

        Args:
            name: of the event.
            unit: "h" or "km".
        """
        met, p = self.exposure.encounters, self.probability(name)
        each = None if met is None else met.per_hour if unit == "h" else met.per_km
        if each is None or p is None:
            return None
        return each.of_which(p.estimate, p.low, p.high)

    @cached_property
    def parameters(self) -> tuple[ParameterShare, ...]:
        """How harmful rows differ from the road, the most different parameter first."""
        there = self._values(self.event) > 0.0
        X, weights = self._rows(self.event), self.weighted.weights[there]
        # What parameters do to harm is said of rows that are harmful; too few would show chance.
        if self.weighted.doubts or self.weighted.hits(self._values(self.event)) < FEWEST_HITS:
            return ()
        road = self.exposure.sample(COMPARED, self.seed).X
        found = [
            _share(name, self.exposure.space.parameters[name].unit, X[:, k], weights, road[:, k])
            for k, name in enumerate(self.exposure.space.names)
            if name in self.exposure.marginals
        ]
        return tuple(sorted(found, key=lambda share: -share.distance))

    def draws(self, name: str, random: np.random.Generator) -> tuple[Float, ...]:
        """Return draws of an event's probability, see `Weighted.draws`."""
        return self.weighted.draws(self._values(name), random, DRAWS)

    @cached_property
    def extreme(self) -> Extreme | None:
        """How likely a collision is by near misses; None if no row was drawn as on the road."""
        road = self.weighted.road
        return of_near_misses(road[:, Column.TTC], self.seed) if road.size else None

    def to_dict(self) -> dict[str, Any]:
        """Return what ``risk.json`` says."""
        exposure, weighted = self.exposure, self.weighted
        share, twins = exposure.feasible_share, exposure.parameterisation
        return {
            "scenario": exposure.scenario.name,
            "driver": self.driver,
            "crash_types": published(exposure.scenario.name),
            "exposure": {
                "source": exposure.source,
                "feasible_share": share.estimate,
                "parameterisation": twins.figures() if twins else None,
            },
            "event": self.event,
            "count": self.count,
            "method": self.estimated.method,
            "why": self.estimated.why,
            "believed": self.believed,
            "doubts": list(weighted.doubts),
            "evaluations": weighted.evaluations,
            "budget": self.budget,
            "seed": self.seed,
            "failed": self.failed,
            "implausible": self.implausible,
            "per_encounter": {name: _finding(finding) for name, finding in self.findings.items()},
            "preventable": None if self.preventable is None else _finding(self.preventable),
            "by_mode": {words: _finding(finding) for words, finding in self.by_mode.items()},
            "per_hour": {name: _rate(self.rate(name, "h")) for name in self.findings},
            "per_km": {name: _rate(self.rate(name, "km")) for name in self.findings},
            "parameters": {
                parameter.name: {
                    "unit": parameter.unit,
                    "distance": parameter.distance,
                    "harmful": list(parameter.harmful),
                    "road": list(parameter.road),
                }
                for parameter in self.parameters
            },
            "most_likely": [
                {
                    "mode": likely.mode,
                    "files": likely.name,
                    "values": exposure.space.values(likely.x),
                }
                for likely in self.most_likely
            ],
            "diagnostics": weighted.facts,
            "near_misses": None if self.extreme is None else self.extreme.to_dict(),
            "check": None
            if self.check is None
            else {
                **vars(self.check.probability(EVENTS[self.event].score)),
                "evaluations": self.check.evaluations,
            },
            "data": None if self.data is None else vars(self.data),
            "elsewhere": None if self.elsewhere is None else self.elsewhere.to_dict(),
            "command": self.command,
        }

    @property
    def work(self) -> str:
        """How much was simulated."""
        return f"{self.weighted.evaluations:,} simulations"

    def to_json(self) -> dict[str, Any]:
        """Return the same."""
        return self.to_dict()

    def shown(self) -> list[str | Table]:
        """Return what the terminal shows."""
        from bridgegen.jobs.risk import text

        return [*text.lines(self)]

    def judged(self) -> tuple[Judged, ...]:
        """Return the figures, of which none is believed where the aimed event's is not."""
        found = {"evaluations": float(self.weighted.evaluations)}
        for name, finding in self.findings.items():
            p, nan = finding.probability, float("nan")
            found[name] = nan if p is None else p.estimate
            found[f"{name}_upper"] = nan if p is None else p.upper
            for unit, words in (("h", "hour"), ("km", "km")):
                rate = self.rate(name, unit)
                found[f"{name}_per_{words}"] = nan if rate is None else rate.estimate
                found[f"{name}_per_{words}_upper"] = nan if rate is None else rate.high
        name, method = self.exposure.scenario.name, self.estimated.method
        return (
            Judged(
                suite=f"{name} risk",
                group=f"bridgegen.{name}.{self.driver.replace('.', '_')}",
                test="the interval is believed",
                holds=self.believed,
                details=self.findings[self.event].doubt or f"method {method}",
                figures={figure: found[figure] for figure in FIGURES},
                facts={
                    "scenario": name,
                    "ego": self.driver,
                    "method": method,
                    "command": self.command,
                },
            ),
        )

    def write(self) -> tuple[Path, ...]:
        """Write the record, the page and the table of harmful rows.

        Raises:
            StorageError: they cannot be written.
        """
        from bridgegen.jobs.risk.page import write_page

        paths = tuple(self.folder / name for name in (RECORD, PAGE, TABLE))
        write_whole(paths[0], [json.dumps(self.to_dict(), indent=1).encode()])
        write_page(paths[1], self)
        write_whole(paths[2], [self._table().encode()])
        return paths

    def _table(self) -> str:
        text = io.StringIO()
        out = writer(text, lineterminator="\n")
        names = self.exposure.space.names
        out.writerow([*names, "conflict", "severity", "mode", "weight"])
        Z, found = self.weighted.Z[:MOST_ROWS], self.weighted.outcomes[:MOST_ROWS]
        X = self.exposure.from_normal(Z) if len(Z) else np.empty((0, len(names)))
        for x, item, weight in zip(X, found, self.weighted.weights[:MOST_ROWS], strict=True):
            number = int(item[Column.MODE])
            mode = self.modes[number] if number >= 0 else ""
            kind = "collision" if item[Column.SCORE] >= EVENTS["collision"].score else "near miss"
            severity = repr(float(item[Column.SEVERITY]))
            out.writerow([*map(repr, x.tolist()), kind, severity, mode, repr(float(weight))])
        return text.getvalue()

    def _values(self, name: str) -> Float:
        """Return what an event's probability is the mean of, ``(M,)``."""
        if name == INJURY:
            # A serious injury is no event of its own in a simulation: its probability is the mean
            # of what the injury model says of collisions.
            return self.weighted.outcomes[:, Column.SEVERITY] * self._values("collision")
        return self.weighted.there(EVENTS[name].score)

    def _rows(self, name: str) -> Float:
        Z = self.weighted.Z[self._values(name) > 0.0]
        return (
            self.exposure.from_normal(Z)
            if len(Z)
            else np.empty((0, len(self.exposure.space.names)))
        )

    def _finding(self, values: Float) -> Finding:
        hits, weighted = self.weighted.hits(values), self.weighted
        if self.failed >= weighted.evaluations:
            return Finding(None, hits, f"none of {self.failed:,} simulations has a result")
        if weighted.doubts:  # of the aim; what comes with it is no surer
            return Finding(None, hits, weighted.doubts[0])
        counted = bool(weighted.rows) and (
            not weighted.weights.size or np.ptp(weighted.weights) == 0.0
        )
        if counted or hits >= FEWEST_HITS:
            return Finding(weighted.mean(values), hits)
        return Finding(None, hits, f"{hits:.0f} effective rows, and {FEWEST_HITS:.0f} are needed")


def _share(name: str, unit: str, values: Float, weights: Float, road: Float) -> ParameterShare:
    # Classes of equal probability on the road: a distance from even shares does not depend on
    # units, nor on how a parameter is distributed.
    edges = np.quantile(road, np.linspace(0.0, 1.0, BINS + 1)[1:-1])
    total = weights.sum()
    mine = np.bincount(np.searchsorted(edges, values), weights, BINS) / total
    usual = np.bincount(np.searchsorted(edges, road), minlength=BINS) / len(road)
    order = np.argsort(values)
    sums = np.cumsum(weights[order]) / total
    ends = (0.05, 0.5, 0.95)
    low, middle, high = values[order][np.minimum(np.searchsorted(sums, ends), len(values) - 1)]
    first, second, third = np.quantile(road, ends)
    distance = 0.5 * float(np.abs(mine - usual).sum())
    return ParameterShare(
        name,
        unit,
        distance,
        (float(low), float(middle), float(high)),
        (float(first), float(second), float(third)),
        mine,
    )


def _finding(finding: Finding) -> Mapping[str, Any]:
    found: dict[str, Any] = {"hits": finding.hits}
    if finding.probability is None:
        return found | {"estimate": None, "doubt": finding.doubt}
    return found | vars(finding.probability)


def _rate(rate: Rate | None) -> Mapping[str, float] | None:
    return None if rate is None else vars(rate)
