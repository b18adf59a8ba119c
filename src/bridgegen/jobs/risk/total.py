"""The risk of many scenarios: one number, the sum of their rates weighted by how often each is met.

The budget is shared out in rounds, by Neyman's rule: the more to a scenario the more its part of
the sum leaves open. Only rows of the last round count, since those that decide how many rows a
scenario gets would bias the sum. Each scenario's part of it is a risk of its own (`finish`).
"""

import json
import math
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.disk import write_whole
from bridgegen.base.errors import BridgeGenError, InputError, Interrupted
from bridgegen.base.units import percent
from bridgegen.engine.options import called_with
from bridgegen.engine.workers import open_workers
from bridgegen.jobs.frame import Judged, Table, as_names, command_of
from bridgegen.jobs.risk import text
from bridgegen.jobs.risk.estimators.problem import block_of
from bridgegen.jobs.risk.estimators.total import DRAWS, Part, Total, rates_of, shared_out, total_of
from bridgegen.jobs.risk.ledger import SETTINGS
from bridgegen.jobs.risk.options import FIGURES, WORDS, RiskOptions
from bridgegen.jobs.risk.outcomes import EVENTS, INJURY
from bridgegen.jobs.risk.result import PAGE, RECORD, Risk
from bridgegen.jobs.risk.risk import (
    LEAST_EVALUATIONS,
    Asked,
    estimate_risk,
    finish,
    prepare,
    require,
)
from bridgegen.jobs.suite.entries import find_entries
from bridgegen.pages.templates import number
from bridgegen.results.folder import claim
from bridgegen.scenario.exposure import Exposure
from bridgegen.scenario.exposure.exposure import Encounters
from bridgegen.scenario.exposure.reader import UNIFORM, scenario_of
from bridgegen.scenario.language.reader import load, names, pack_names

FIRST, SECOND = 0.1, 0.2
"""Shares of the budget of the first round, which is even, and of the second; the rest counts."""
ENOUGH, AT_MOST = 500, 0.25
"""Rows of each scenario in the first round, for near misses, up to this share of the budget."""
MORE = 0.1
"""Share of the budget of which it is stated by how much it would narrow the interval."""
SPEED = 50.0  # km/h, with which rates per km share out the budget beside others per hour
SCENARIOS, ROUNDS = "scenarios", "rounds"
_NORMAL = 1.96
_MARGIN = 1.2  # of the rows for a precision: what first rounds say of them is uncertain
_STREAM = 6  # of random numbers, beside those of estimators

UNITS = {"h": ("hour", 1.0), "km": ("1,000 km", 1000.0), "": ("encounter", 1.0)}
"""Units of a sum: its name in words, and how many of them that is."""


@dataclass(frozen=True)
class TotalRisk:
    """How often harm happens in several scenarios together, for one driver.

    Attributes:
        risks: of each scenario whose rate of encounters is known, by name; of all, if none is.
        left_out: the scenarios that are not in the sum: why, by name.
        uniform: names of those without an exposure, which is then uniform over the ranges.
        event: that was aimed at.
        spent: evaluations, of all rounds.
        command: makes it again.
        folder: of its files.
    """

    risks: Mapping[str, Risk]
    left_out: Mapping[str, str]
    uniform: tuple[str, ...]
    event: str
    spent: int
    command: str
    folder: Path

    @property
    def units(self) -> tuple[str, ...]:
        """The units of sums: hours and kilometres as far as known, else encounters."""
        return tuple(unit for unit in ("h", "km") if self.members(unit)) or ("",)

    def members(self, unit: str) -> list[str]:
        """Return the scenarios whose rate of encounters per unit is known; "": per encounter."""
        met = {name: risk.exposure.encounters for name, risk in self.risks.items()}
        return [name for name, one in met.items() if not unit or _amount(one, unit)]

    @cached_property
    def _sums(self) -> dict[tuple[str, str], Total | None]:
        return {}

    def total(self, name: str, unit: str) -> Total | None:
        """Return the sum of an event's rates per unit; None where a part of it is not believed.

        Args:
            name: of the event, or of a serious injury.
            unit: "h", "km", or "" for encounters of which each scenario has as many.
        """
        if (name, unit) not in self._sums:
            of = self.members(unit)
            known = of and all(self.risks[each].probability(name) for each in of)
            self._sums[name, unit] = total_of(self._parts(name, unit, of)) if known else None
        return self._sums[name, unit]

    def _parts(self, name: str, unit: str, of: Sequence[str]) -> list[Part]:
        """Return the parts of a sum; without an event's name, those of near misses."""
        parts = []
        for each in of:
            risk, met = self.risks[each], self.risks[each].exposure.encounters
            random = block_of(risk.seed, 0, _STREAM)
            rate = 1.0 / len(self.members(unit))
            rates: tuple[Float, ...] = (np.full(DRAWS, rate),) * 2
            if unit and met is not None:
                rate = met.count / _amount(met, unit)
                rates = rates_of(met.count, _amount(met, unit), random)
            p, extreme = risk.probability(name) if name else None, risk.extreme
            if p is not None:
                parts.append(Part(rate, rates, p.estimate, risk.draws(name, random)))
            elif extreme is not None:
                draws = random.choice(extreme.resampled, DRAWS)
                parts.append(Part(rate, rates, extreme.estimate, (draws,) * 3))
        return parts

    def narrowed(self, unit: str) -> dict[str, float]:
        """Return by which share of its width more budget, all for it, would narrow the interval."""
        found = self.total(self.event, unit)
        if found is None:
            return {}
        whole = sum(found.simulated) + sum(found.counted)
        spent = [self.risks[name].weighted.evaluations for name in self.members(unit)]
        more = MORE * sum(spent)
        gone = [v * more / (n + more) for v, n in zip(found.simulated, spent, strict=True)]
        narrower = [1.0 - math.sqrt(max(1.0 - v / whole, 0.0)) if whole else 0.0 for v in gone]
        return dict(zip(self.members(unit), narrower, strict=True))

    def extreme(self, unit: str) -> tuple[Total | None, Total | None]:
        """Return collisions by near misses, and by the simulations of the same scenarios.

        None, and None, where near misses say nothing of any.
        """
        of = [name for name in self.members(unit) if _says(self.risks[name])]
        known = all(self.risks[name].probability("collision") for name in of)
        parts = self._parts("", unit, of)
        return (
            total_of(parts) if of else None,
            total_of(self._parts("collision", unit, of)) if of and known else None,
        )

    # -- in words ------------------------------------------------------------------------------

    @property
    def sentence(self) -> str:
        """What it says, in some sentences."""
        what = WORDS[self.event]
        one = next(iter(self.risks.values()), None)
        if one is not None and one.count == "ego":
            what = f"{what} that the ego is responsible for or could have prevented"
        said = []
        for unit in self.units:
            found, (words, size) = self.total(self.event, unit), UNITS[unit]
            if found is not None:
                zero = found.estimate == 0.0
                each = (
                    f"below {number(found.upper * size)}" if zero else number(found.estimate * size)
                )
                ends = f"{number(found.low * size)} to {number(found.high * size)}"
                said.append(f"{each} per {words} (95 %{'' if zero else f': {ends}'})")
        if not said:
            bad = [n for n in self.members(self.units[0]) if not self.risks[n].believed]
            why = "; ".join(f"{n}: {self.risks[n].findings[self.event].doubt}" for n in bad)
            text_ = f"How often {what} happens is not known: {why or 'no scenario is in the sum'}."
        else:
            of = f"{len(self.members(self.units[0]))} scenarios"
            text_ = f"The rate of {what} is {' and '.join(said)}, summed over {of}."
            if self.units == ("",):
                text_ = text_.replace("summed over", "the mean over").replace("rate", "probability")
                text_ += " No rate of encounters is known, so each is met as often as the others."
        return " ".join([text_, *self.remarks])

    @property
    def remarks(self) -> list[str]:
        """What is not as one would expect, a sentence each."""
        found = [f"Not in the sum: {name} ({why})." for name, why in self.left_out.items()]
        for unit in self.units:
            if missing := [name for name in self.risks if name not in self.members(unit)]:
                found.append(f"Not in the sum per {UNITS[unit][0]}: {', '.join(missing)}.")
        if self.uniform:
            found.append(
                f"Without an exposure, uniform over the ranges, which no road is like: "
                f"{', '.join(self.uniform)}."
            )
        return found

    @property
    def advice(self) -> str:
        """What would narrow the interval most, in a sentence; "" where no sum is known."""
        unit = self.units[0]
        found, narrower = self.total(self.event, unit), self.narrowed(unit)
        if found is None:
            return ""
        whole = sum(found.simulated) + sum(found.counted)
        share = sum(found.counted) / whole if whole else 0.0
        best = max(narrower, key=narrower.__getitem__)
        most = self.members(unit)[int(np.argmax(found.counted))]
        said = (
            f"{percent(MORE)} more simulations narrow the interval most in {best}, by "
            f"{percent(narrower[best])}."
        )
        if share > 0.5:
            said += (
                f" {percent(share)} of its variance is how few encounters were counted, most of "
                f"all of {most}: further recordings narrow it more."
            )
        return said

    def rows(self) -> tuple[list[str], list[list[Any]]]:
        """Return a table of the scenarios: its head and its rows, the largest shares first."""
        unit = self.units[0]
        words, size = UNITS[unit]
        found, narrower = self.total(self.event, unit), self.narrowed(unit)
        shares = dict(zip(self.members(unit), found.shares, strict=True)) if found else {}
        head = ["scenario", f"encounters per {words}", "per encounter", "95 %", "share"]
        head += ["simulations", f"{percent(MORE)} more narrow by"]
        rows: list[list[Any]] = []
        for name in sorted(self.risks, key=lambda each: -shares.get(each, 0.0)):
            risk = self.risks[name]
            met = risk.exposure.encounters
            amount = _amount(met, unit) if unit else 0.0
            value, width, _ = text.interval(risk.probability(self.event))
            rate = number(met.count / amount * size) if met is not None and amount else "–"
            share, less = (percent(of[name]) if name in of else "–" for of in (shares, narrower))
            rows.append([name, rate, value, width, share, f"{risk.weighted.evaluations:,}", less])
        return head, rows

    def near_misses(self) -> list[str]:
        """Return what near misses say, a sentence for each unit, and of how many scenarios."""
        said = []
        for unit in self.units:
            found, beside = self.extreme(unit)
            if found is not None:
                said.append(text.near_misses(found, beside, *UNITS[unit]))
        silent = [name for name, risk in self.risks.items() if not _says(risk)]
        if silent:
            said.append(
                f"Near misses say nothing of {len(silent)} of {len(self.risks)} scenarios, which "
                "are in neither; their pages say why."
            )
        return said

    # -- as a result of a job ------------------------------------------------------------------

    @property
    def work(self) -> str:
        """How much was simulated."""
        return f"{self.spent:,} simulations"

    def shown(self) -> list[str | Table]:
        """Return what the terminal shows."""
        head, rows = self.rows()
        lines = [f"{'near misses':<12}{line}" for line in self.near_misses()]
        lines += [f"{'sharper':<12}{self.advice}"] if self.advice else []
        return [
            f"{self.sentence}\n",
            Table(head, rows),
            "",
            *lines,
            f"{'page':<12}{self.folder / PAGE}",
        ]

    def to_json(self) -> dict[str, Any]:
        """Return what ``risk.json`` says."""
        totals = {}
        for unit in self.units:
            key = {"h": "per_hour", "km": "per_km", "": "per_encounter"}[unit]
            evt, _ = self.extreme(unit)
            totals[key] = {
                **{name: _plain(self.total(name, unit), self.members(unit)) for name in WORDS},
                "near_misses": _plain(evt, ()),
                "narrowed": self.narrowed(unit),
            }
        return {
            "event": self.event,
            "sentence": self.sentence,
            "advice": self.advice,
            **totals,
            "left_out": dict(self.left_out),
            "uniform": list(self.uniform),
            "evaluations": self.spent,
            "scenarios": {name: risk.to_dict() for name, risk in self.risks.items()},
            "command": self.command,
        }

    def judged(self) -> tuple[Judged, ...]:
        """Return the figures of the sums; those that are not known are NaN."""
        found = dict.fromkeys(FIGURES, math.nan) | {"evaluations": float(self.spent)}
        for name in (*EVENTS, INJURY):
            for unit in self.units:
                end = {"h": "_per_hour", "km": "_per_km", "": ""}[unit]
                if (total := self.total(name, unit)) is not None:
                    found[f"{name}{end}"] = total.estimate
                    found[f"{name}{end}_upper"] = total.upper
        one = next(iter(self.risks.values()), None)
        driver = one.driver if one else ""
        return (
            Judged(
                suite="total risk",
                group=f"bridgegen.total.{driver.replace('.', '_')}",
                test="the interval is believed",
                holds=self.total(self.event, self.units[0]) is not None and self.whole,
                details=self.sentence,
                figures=found,
                facts={"ego": driver, "command": self.command},
            ),
        )

    @property
    def whole(self) -> bool:
        """Whether all scenarios whose rate of encounters is known are in the sum."""
        return all(risk.believed for risk in self.risks.values())

    def write(self) -> None:
        """Write the record and the page.

        Raises:
            StorageError: they cannot be written.
        """
        from bridgegen.jobs.risk.page import write_total

        write_whole(self.folder / RECORD, [json.dumps(self.to_json(), indent=1).encode()])
        write_total(self.folder / PAGE, self)


def _amount(met: Encounters | None, unit: str) -> float:
    """Return in how many hours or kilometres encounters were counted; 0 where it is not known."""
    found = None if met is None else met.hours if unit == "h" else met.km
    return found or 0.0


def _says(risk: Risk) -> bool:
    return risk.extreme is not None and not risk.extreme.doubt


def _plain(found: Total | None, members: Sequence[str]) -> dict[str, Any] | None:
    if found is None:
        return None
    ends = {key: getattr(found, key) for key in ("estimate", "low", "high", "upper")}
    return {**ends, "shares": dict(zip(members, found.shares, strict=False))}


# --- The job ---


@called_with(RiskOptions)
def estimate_any_risk(given: RiskOptions) -> Risk | TotalRisk:
    """Estimate the risk of one scenario, or the total of several."""
    named = as_names(given.scenario)
    is_one = len(named) == 1 and not Path(named[0]).is_dir() and not given.every
    if is_one and not any(name.startswith(f"{named[0]}/") for name in pack_names()):
        return estimate_risk(**vars(given))
    return estimate_total_risk(**vars(given))


@called_with(RiskOptions)
def estimate_total_risk(given: RiskOptions) -> TotalRisk:
    """Estimate how often harm happens in several scenarios together, with one interval.

    Called again with the same arguments after it was stopped, it resumes.

    Returns:
        The total; its record and page are written, and those of each scenario.

    Raises:
        InputError: an invalid argument or file; all that are.
        StorageError: the folder holds something else, or cannot be written.
        Interrupted: Ctrl-C; what is done is kept.
    """
    require(given)
    alone = {"--from": given.start, "--events": given.events, "--simulator": given.simulator}
    if used := [name for name, value in {**alone, "--check": given.check}.items() if value]:
        raise InputError(f"{', '.join(used)}: for one scenario, not for the sum of several")
    scenarios, left_out = _scenarios(given)
    folder = Path("risk", "total") if given.out is None else Path(given.out)
    exposures, uniform = _exposures(given, scenarios)
    command = command_of(
        "risk",
        given,
        folder,
        exposure=["EXPOSURE" if isinstance(x, Exposure) else x for x in as_names(given.exposure)],
    )
    with open_workers(given.workers) as hands:
        asked: dict[str, Asked] = {}
        problems: list[str] = []
        for name, scenario in scenarios.items():
            own = replace(given, scenario=(scenario,), exposure=exposures[name], every=False)
            try:
                asked[name] = prepare(own, hands)
            except BridgeGenError as error:
                problems += [f"{name}: {problem}" for problem in error.problems]
        if problems:
            raise InputError(*problems)
        rated = {name: one for name, one in asked.items() if one.exposure.encounters is not None}
        left_out |= {name: "no rate of encounters" for name in asked if rated and name not in rated}
        asked = rated or asked
        if (least := 4 * LEAST_EVALUATIONS * len(asked)) > given.budget:
            raise InputError(
                f"--budget must be at least {least} for {len(asked)} scenarios, got {given.budget}"
            )
        claim(
            folder,
            {name: one.settings(given) for name, one in asked.items()},
            file=SETTINGS,
            what="total risk",
            pieces=SCENARIOS,
            belongs=lambda name: name in (RECORD, PAGE, ROUNDS),
        )
        try:
            risks, spent = _in_rounds(asked, given, folder)
        except (Interrupted, KeyboardInterrupt) as stop:
            done = stop.evaluations if isinstance(stop, Interrupted) else 0
            raise Interrupted(folder, done, given.budget, command=command) from None
    result = TotalRisk(risks, left_out, uniform, given.event, spent, command, folder)
    result.write()
    return result


def _scenarios(given: RiskOptions) -> tuple[dict[str, str], dict[str, str]]:
    """Return the scenarios by name, and those of which there can be no risk."""
    named = as_names(given.scenario)
    if given.every and named:
        raise InputError(f"--catalogue has every scenario of the catalogue: no {named[0]}")
    if not named and not given.every:
        raise InputError("missing: SCENARIO, or --catalogue for all that ship")
    found: dict[str, str] = {}
    left_out: dict[str, str] = {}
    for entry in find_entries(names() if given.every else named):
        if entry.scenario.lower().endswith(".xosc"):
            left_out[entry.name] = "an OpenSCENARIO file, which has no exposure"
        elif entry.problem:
            left_out[entry.name] = entry.problem
        else:
            found[entry.name] = entry.scenario
    if not found:
        raise InputError("no logical scenario (.yaml), of which there could be a risk")
    return found, left_out


def _exposures(
    given: RiskOptions, scenarios: Mapping[str, str]
) -> tuple[dict[str, tuple[Any, ...]], tuple[str, ...]]:
    """Return the exposure of each scenario, and the names of those whose is uniform.

    Raises:
        InputError: an exposure of none of the scenarios, or two of one.
    """
    loaded = {name: load(scenario) for name, scenario in scenarios.items()}
    by_name: dict[str, Any] = {}
    problems = []
    known = {one.name for one in loaded.values()}
    for item in as_names(given.exposure):
        if item == UNIFORM:
            continue
        of = item.scenario.name if isinstance(item, Exposure) else scenario_of(item)
        if of not in known:
            problems.append(f"{item}: an exposure of {of}, which is none of the scenarios")
        elif of in by_name:
            problems.append(f"{of} has two exposures: {by_name[of]} and {item}")
        by_name[of] = item
    if problems:
        raise InputError(*problems)
    found, uniform = {}, []
    for name, one in loaded.items():
        chosen = by_name.get(one.name)
        if chosen is None and one.exposure is None:
            chosen = UNIFORM
            uniform.append(name)
        found[name] = () if chosen is None else (chosen,)
    return found, tuple(uniform)


def _in_rounds(
    asked: Mapping[str, Asked], given: RiskOptions, folder: Path
) -> tuple[dict[str, Risk], int]:
    """Return the risk of each scenario, of the last round, and the evaluations of all."""
    k, budget, say = len(asked), given.budget, given.callbacks
    weights = {name: _weight(one.exposure.encounters) for name, one in asked.items()}
    roads: dict[str, list[Float]] = {name: [] for name in asked}
    spreads = dict.fromkeys(asked, 1.0)
    means = dict.fromkeys(asked, 0.0)
    spent = 0

    def of_round(turn: int, name: str, **changes: Any) -> RiskOptions:
        before = spent
        calls = replace(
            say, progress=lambda what, n, _, facts: say.progress(what, before + n, budget, name)
        )
        # Each scenario's random numbers are its own, and those of each round: equal ones would
        # make their errors alike.
        seed = np.random.SeedSequence((given.seed, turn, zlib.crc32(name.encode())))
        return replace(
            asked[name].given,
            seed=int(seed.generate_state(1)[0]),
            precision=0.0,
            callbacks=calls,
            **changes,
        )

    even = max(int(FIRST * budget / k), min(ENOUGH, int(AT_MOST * budget / k)), LEAST_EVALUATIONS)
    for turn, method in enumerate(("mc", given.method)):
        rows = [even] * k
        if turn:
            rows = shared_out(int(SECOND * budget), [*spreads.values()], LEAST_EVALUATIONS)
        for name, n in zip(asked, rows, strict=True):
            own = of_round(turn, name, method=method, budget=n)
            place = folder / ROUNDS / str(turn + 1) / name
            experiment = asked[name].experiment(own, place, n)
            try:
                found = asked[name].estimate(own, experiment).weighted
            except KeyboardInterrupt:
                raise Interrupted(folder, spent + experiment.evaluations, budget) from None
            spent += experiment.evaluations
            roads[name] += [found.road] if found.road.size else []
            if not found.doubts:
                there = found.there(EVENTS[given.event].score)
                draws = found.draws(there, block_of(own.seed, 0, _STREAM), 1000)[2]
                used = max(found.evaluations, 1)
                spreads[name] = weights[name] * float(draws.std()) * math.sqrt(used)
                means[name] = weights[name] * found.mean(there).estimate
    left = max(budget - spent, LEAST_EVALUATIONS * k)
    if given.precision > 0.0 and (sum_ := sum(means.values())) > 0.0:
        needed = (_NORMAL * sum(spreads.values()) / (given.precision * sum_)) ** 2
        left = min(left, max(int(_MARGIN * needed), LEAST_EVALUATIONS * k))
    risks = {}
    rows = shared_out(left, [*spreads.values()], LEAST_EVALUATIONS)
    for name, n in zip(asked, rows, strict=True):
        own = of_round(2, name, budget=n, out=folder / SCENARIOS / name)
        try:
            road = np.concatenate(roads[name]) if roads[name] else None
            risks[name] = finish(replace(asked[name], given=own), folder, road)
        except Interrupted as stop:
            raise Interrupted(folder, spent + stop.evaluations, budget) from None
        spent += risks[name].weighted.evaluations
    return risks, spent


def _weight(met: Encounters | None) -> float:
    """Return how much an encounter counts when the budget is shared out."""
    if met is None:
        return 1.0
    hours = met.hours or (met.km or 0.0) / SPEED
    return (met.count + 1) / hours
