"""The risk of many scenarios: one number, the sum of their rates weighted by how often each is met.

The budget is shared out in rounds, by Neyman's rule: the more to a scenario the more its part of
the sum leaves open. Only rows of the last round count, since those that decide how many rows a
scenario gets would bias the sum. Each scenario's part of it is a risk of its own (`finish`).
"""

import json
import math
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
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
from bridgegen.jobs.risk.extremes import Extreme
from bridgegen.jobs.risk.ledger import SETTINGS
from bridgegen.jobs.risk.options import FIGURES, WORDS, RiskOptions
from bridgegen.jobs.risk.outcomes import EVENTS
from bridgegen.jobs.risk.result import PAGE, RECORD, Risk
from bridgegen.jobs.risk.risk import (
    LEAST_EVALUATIONS,
    Asked,
    estimate_risk,
    finish,
    named_exposures,
    prepare,
    require,
)
from bridgegen.jobs.suite.entries import find_entries
from bridgegen.pages.templates import counted, number
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

KEYS = {"h": "hour", "km": "km", "": "encounter"}
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
    def driver(self) -> str:
        """The driver of the ego; all, where scenarios have their own."""
        return ", ".join(dict.fromkeys(risk.driver for risk in self.risks.values()))

    @property
    def units(self) -> tuple[str, ...]:
        """The units of sums: hours and kilometres as far as known, else encounters."""
        return tuple(unit for unit in ("h", "km") if self.members(unit)) or ("",)

    def members(self, unit: str) -> list[str]:
        """Return the scenarios whose rate of encounters per unit is known; "": per encounter."""
        met = {name: risk.exposure.encounters for name, risk in self.risks.items()}
        return [name for name, one in met.items() if not unit or _amount(one, unit)]

    @cached_property
    def totals(self) -> Mapping[tuple[str, str], Total | None]:
        """The sums of an event's rates, by event and unit; None: not all of it is believed."""
        return {
            (name, unit): self.total(name, unit, self.members(unit))
            for name in WORDS
            for unit in self.units
        }

    def total(self, name: str, unit: str, of: Sequence[str]) -> Total | None:
        """Return the sum of the rates of some scenarios.

        Args:
            name: of the event, or of a serious injury; "": collisions by near misses.
            unit: "h", "km", or "" for encounters of which each scenario has as many.
            of: names.
        """
        parts = []
        for each in of:
            risk, met = self.risks[each], self.risks[each].exposure.encounters
            random = block_of(risk.seed, 0, _STREAM)
            rate = 1.0 / len(self.members(unit))
            rates: tuple[Float, ...] = (np.full(DRAWS, rate),) * 2
            if unit and met is not None:
                rate = met.count / _amount(met, unit)
                rates = rates_of(met.count, _amount(met, unit), random)
            if not name and (extreme := _extreme(risk)):
                draws = (random.choice(extreme.resampled, DRAWS),) * 3
                parts.append(Part(rate, rates, extreme.estimate, draws))
            elif name and (p := risk.probability(name)):
                parts.append(Part(rate, rates, p.estimate, risk.draws(name, random)))
            else:
                return None
        return total_of(parts) if parts else None

    @property
    def sentence(self) -> str:
        """What it says, in some sentences."""
        of, rate = [*self.risks.values()], "mean probability" if self.units == ("",) else "rate"
        what = f"The {rate} of {text.what(self.event, of[0].count)}"
        said = []
        for unit in self.units:
            if (found := self.totals[self.event, unit]) is not None:
                words, size = UNITS[unit]
                low, middle, high, upper = (
                    number(end * size)
                    for end in (found.low, found.estimate, found.high, found.upper)
                )
                is_zero = found.estimate == 0.0
                ends = f"below {upper} per {words} (95 %)" if is_zero else f"{middle} per {words}"
                said.append(ends if is_zero else f"{ends} (95 %: {low} to {high})")
        doubts = [
            f"{name}: {risk.findings[self.event].doubt}"
            for name, risk in self.risks.items()
            if not risk.believed
        ]
        found_ = f"is {' and '.join(said)}, over {counted(len(of), 'scenario')}."
        if not said:
            found_ = f"is not known: {'; '.join(doubts)}."
        return " ".join([f"{what} {found_}", *self.remarks()])

    def remarks(self) -> Iterator[str]:
        """Yield what is not as one would expect, a sentence each."""
        if self.units == ("",):
            yield "No rate of encounters is known, so each is met as often as the others."
        for name, why in self.left_out.items():
            yield f"Not in the sum: {name} ({why})."
        for unit in self.units:
            if missing := [name for name in self.risks if name not in self.members(unit)]:
                yield f"Not in the sum per {UNITS[unit][0]}: {', '.join(missing)}."
        if self.uniform:
            names_ = ", ".join(self.uniform)
            yield f"Uniform over the ranges, without an exposure, as no road is: {names_}."

    @property
    def narrowed(self) -> dict[str, float]:
        """By which share more budget, all for one scenario, would narrow the interval, by name."""
        of, found = self.members(self.units[0]), self.totals[self.event, self.units[0]]
        if found is None:
            return {}
        spent = np.array([self.risks[name].weighted.evaluations for name in of])
        more, simulated = MORE * spent.sum(), np.array(found.simulated)
        gone = simulated * more / (spent + more) / (simulated.sum() + sum(found.counted))
        return dict(zip(of, (1.0 - np.sqrt(1.0 - gone)).tolist(), strict=True))

    @property
    def advice(self) -> str:
        """What would narrow the interval most, in a sentence; "" where no sum is known."""
        found, narrower = self.totals[self.event, self.units[0]], self.narrowed
        if found is None:
            return ""
        best = max(narrower, key=narrower.__getitem__)
        said = (
            f"{percent(MORE)} more simulations narrow the interval most in {best}, by "
            f"{percent(narrower[best])}."
        )
        share = sum(found.counted) / (sum(found.simulated) + sum(found.counted))
        if share > 0.5:
            most = self.members(self.units[0])[int(np.argmax(found.counted))]
            said += (
                f" {percent(share)} of its variance is how few encounters were counted, most of "
                f"all of {most}: further recordings narrow it more."
            )
        return said

    def near_misses(self) -> Iterator[str]:
        """Yield what near misses say, a sentence for each unit, and of how many scenarios."""
        for unit in self.units:
            of = [name for name in self.members(unit) if _extreme(self.risks[name])]
            if (found := self.total("", unit, of)) is not None:
                yield text.near_misses(found, self.total("collision", unit, of), *UNITS[unit])
        if silent := sum(not _extreme(risk) for risk in self.risks.values()):
            yield (
                f"Near misses say nothing of {silent} of {counted(len(self.risks), 'scenario')}, "
                "which are left out on both sides; their pages say why."
            )

    def rows(self) -> tuple[list[str], list[list[str]]]:
        """Return a table of the scenarios: its head and its rows, the largest shares first."""
        unit, found, narrower = self.units[0], self.totals[self.event, self.units[0]], self.narrowed
        shares = dict(zip(self.members(unit), found.shares, strict=True)) if found else {}
        words, size = UNITS[unit]
        head = ["scenario", f"encounters per {words}", "per encounter", "95 %", "share of the sum"]
        rows = []
        for name in sorted(self.risks, key=lambda each: -shares.get(each, 0.0)):
            risk, met = self.risks[name], self.risks[name].exposure.encounters
            amount = _amount(met, unit)
            rate = number(met.count / amount * size) if met and amount else "–"
            parts = [percent(of[name]) if name in of else "–" for of in (shares, narrower)]
            value, width, _ = text.interval(risk.probability(self.event))
            row = [name, rate, value, width, parts[0], f"{risk.weighted.evaluations:,}", parts[1]]
            rows.append(row)
        head += ["simulations", f"{percent(MORE)} more narrow it by"]
        at = 1 if unit else 2  # per encounter there is no rate of encounters
        return [head[0], *head[at:]], [[row[0], *row[at:]] for row in rows]

    @property
    def work(self) -> str:
        """How much was simulated."""
        return f"{self.spent:,} simulations"

    def shown(self) -> list[str | Table]:
        """Return what the terminal shows."""
        lines = [f"{'near misses':<12}{line}" for line in self.near_misses()]
        lines += [f"{'sharper':<12}{self.advice}"] if self.advice else []
        lines.append(f"{'page':<12}{self.folder / PAGE}")
        return [f"{self.sentence}\n", Table(*self.rows()), "", *lines]

    def to_json(self) -> dict[str, Any]:
        """Return what ``risk.json`` says."""
        return {
            "event": self.event,
            "sentence": self.sentence,
            "advice": self.advice,
            "near_misses": [*self.near_misses()],
            "narrowed": self.narrowed,
            **{
                f"per_{key}": {
                    name: found
                    and vars(found)
                    | {"shares": dict(zip(self.members(unit), found.shares, strict=True))}
                    for (name, of), found in self.totals.items()
                    if of == unit
                }
                for unit, key in KEYS.items()
                if unit in self.units
            },
            "left_out": dict(self.left_out),
            "uniform": list(self.uniform),
            "evaluations": self.spent,
            "scenarios": {name: risk.to_dict() for name, risk in self.risks.items()},
            "command": self.command,
        }

    def judged(self) -> tuple[Judged, ...]:
        """Return the figures of the sums; those that are not known are NaN."""
        figures = dict.fromkeys(FIGURES, math.nan) | {"evaluations": float(self.spent)}
        for (name, unit), found in self.totals.items():
            end = f"_per_{KEYS[unit]}" if unit else ""
            if found is not None:
                figures |= {f"{name}{end}": found.estimate, f"{name}{end}_upper": found.upper}
        driver = self.driver
        return (
            Judged(
                suite="total risk",
                group=f"bridgegen.total.{driver.replace('.', '_')}",
                test="the interval is believed",
                holds=self.totals[self.event, self.units[0]] is not None,
                details=self.sentence,
                figures=figures,
                facts={"ego": driver, "command": self.command},
            ),
        )

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
    found = None if met is None or not unit else met.hours if unit == "h" else met.km
    return found or 0.0


def _extreme(risk: Risk) -> Extreme | None:
    return risk.extreme if risk.extreme is not None and not risk.extreme.doubt else None


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
    exposures, uniform = _exposures(given, scenarios)
    folder = Path("risk", "total") if given.out is None else Path(given.out)
    command = command_of("risk", given, folder, exposure=named_exposures(given))
    asked: dict[str, Asked] = {}
    problems: list[str] = []
    with open_workers(given.workers) as hands:
        for name, scenario in scenarios.items():
            own = replace(given, scenario=(scenario,), exposure=exposures[name], every=False)
            try:
                asked[name] = prepare(own, hands)
            except BridgeGenError as error:
                problems += [f"{name}: {problem}" for problem in error.problems]
        rated = {name: one for name, one in asked.items() if one.exposure.encounters is not None}
        left_out |= {name: "no rate of encounters" for name in asked if rated and name not in rated}
        asked = rated or asked
        if (least := 4 * LEAST_EVALUATIONS * len(asked)) > given.budget and not problems:
            problems.append(
                f"--budget must be at least {least} for {len(asked)} scenarios, got {given.budget}"
            )
        if problems:
            raise InputError(*problems)
        claim(
            folder,
            {name: one.settings(given) for name, one in asked.items()},
            file=SETTINGS,
            what="total risk",
            pieces=SCENARIOS,
            belongs=lambda name: name in (RECORD, PAGE, ROUNDS),
        )
        rounds = _Rounds(asked, given, folder)
        try:
            risks = rounds.risks()
        except (Interrupted, KeyboardInterrupt):
            raise Interrupted(folder, rounds.spent, given.budget, command=command) from None
    result = TotalRisk(risks, left_out, uniform, given.event, rounds.spent, command, folder)
    result.write()
    return result


def _scenarios(given: RiskOptions) -> tuple[dict[str, str], dict[str, str]]:
    """Return the scenarios by name, and why there can be no risk of the others."""
    named = as_names(given.scenario)
    if given.every == bool(named):
        raise InputError("one of both must be given: SCENARIO, or --catalogue for all that ship")
    found, left_out = dict[str, str](), dict[str, str]()
    for entry in find_entries(names() if given.every else named):
        if entry.problem or entry.scenario.lower().endswith(".xosc"):
            left_out[entry.name] = entry.problem or "an OpenSCENARIO file, which has no exposure"
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
    found: dict[str, tuple[Any, ...]] = {}
    problems = []
    for item in as_names(given.exposure):
        if item == UNIFORM:
            continue
        of = item.scenario.name if isinstance(item, Exposure) else scenario_of(item)
        mine = [name for name, one in loaded.items() if one.name == of]
        if not mine:
            problems.append(f"{item}: an exposure of {of}, which is none of the scenarios")
        elif mine[0] in found:
            problems.append(f"{of} has two exposures: {found[mine[0]][0]} and {item}")
        found |= dict.fromkeys(mine, (item,))
    if problems:
        raise InputError(*problems)
    without = [name for name, one in loaded.items() if name not in found and one.exposure is None]
    found |= dict.fromkeys(without, (UNIFORM,))
    return {name: found.get(name, ()) for name in loaded}, tuple(without)


class _Rounds:
    """The rounds in which a budget is shared out.

    Args:
        asked: the scenarios.
        given: the options.
        folder: of the total.
    """

    def __init__(self, asked: Mapping[str, Asked], given: RiskOptions, folder: Path) -> None:
        self._asked, self._given, self._folder = asked, given, folder
        self.spent = 0
        self._roads: dict[str, list[Float]] = {name: [] for name in asked}
        self._spreads, self._means = dict.fromkeys(asked, 1.0), dict.fromkeys(asked, 0.0)

    def risks(self) -> dict[str, Risk]:
        """Return the risk of each scenario, by the last round."""
        given, k = self._given, len(self._asked)
        budget, least = given.budget, LEAST_EVALUATIONS * k
        even = max(int(FIRST * budget), min(ENOUGH * k, int(AT_MOST * budget)), least)
        for turn, (rows, method) in enumerate(((even, "mc"), (int(SECOND * budget), given.method))):
            for name, own in self._shared(turn, rows, method):
                self._look(name, own, self._folder / ROUNDS / str(turn + 1) / name)
        left = max(budget - self.spent, least)
        if given.precision > 0.0 and (mean := sum(self._means.values())) > 0.0:
            needed = (_NORMAL * sum(self._spreads.values()) / (given.precision * mean)) ** 2
            left = min(left, max(int(_MARGIN * needed), least))
        found = {}
        for name, own in self._shared(2, left, given.method):
            place, road = self._folder / SCENARIOS / name, self._roads[name]
            one = replace(self._asked[name], given=replace(own, out=place))
            found[name] = finish(one, place, np.concatenate(road) if road else None)
            self.spent += found[name].weighted.evaluations
        return found

    def _shared(self, turn: int, rows: int, method: str) -> Iterator[tuple[str, RiskOptions]]:
        """Yield the options of each scenario in a round."""
        say = self._given.callbacks
        shares = shared_out(rows, [*self._spreads.values()], LEAST_EVALUATIONS)
        for (name, one), n in zip([*self._asked.items()], shares, strict=True):
            calls = replace(say, progress=self._progress(name))
            # Each scenario's random numbers are its own, and each round's: equal ones would make
            # their errors alike.
            entropy = (self._given.seed, turn, zlib.crc32(name.encode()))
            seed = int(np.random.SeedSequence(entropy).generate_state(1)[0])
            yield (
                name,
                replace(
                    one.given, callbacks=calls, method=method, budget=n, seed=seed, precision=0.0
                ),
            )

    def _progress(self, name: str) -> Callable[[str, int, int, str], None]:
        say, before, budget = self._given.callbacks.progress, self.spent, self._given.budget
        return lambda what, done, total, facts: say(what, before + done, budget, name)

    def _look(self, name: str, own: RiskOptions, place: Path) -> None:
        """Estimate how much a scenario's part leaves open."""
        one = self._asked[name]
        experiment = one.experiment(own, place, own.budget)
        found = one.estimate(own, experiment).weighted
        self.spent += experiment.evaluations
        self._roads[name] += [found.road] if found.road.size else []
        if not found.doubts:
            there = found.there(EVENTS[own.event].score)
            draws = found.draws(there, block_of(own.seed, 0, _STREAM), 1000)
            open_ = max(draws[0].std(), draws[2].std())  # of nothing and of all one is 0
            met = one.exposure.encounters
            # Encounters per hour; those per km count beside others as if driven at 50 km/h.
            rate = (met.count + 1) / (met.hours or (met.km or 0.0) / SPEED) if met else 1.0
            self._spreads[name] = rate * float(open_) * math.sqrt(max(found.evaluations, 1))
            self._means[name] = rate * found.mean(there).estimate
