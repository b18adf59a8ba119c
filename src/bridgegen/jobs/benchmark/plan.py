"""The grid of a benchmark: scenarios × drivers × perception × seeds, and how long it will take."""

import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen import drivers as egos
from bridgegen.base.errors import BridgeGenError, InputError
from bridgegen.drivers.drivers import DRIVERS, Driver
from bridgegen.drivers.planners import DOMAINS, Planner, installed, missing, planners
from bridgegen.engine.domain import in_words
from bridgegen.engine.options import PipelineOptions, SearchOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Threads
from bridgegen.jobs.benchmark.options import BenchmarkOptions
from bridgegen.jobs.compare.plan import MAX_SEEDS, RUNS
from bridgegen.jobs.frame import command_of
from bridgegen.jobs.search.scenarios import is_file, load
from bridgegen.scenario.language.reader import names

FILE = "benchmark.json"
"""File in a benchmark's folder with the settings that are equal in all its runs."""

PERFECT, SENSED = "perfect", "sensed"
COLUMNS = {PERFECT: "perfect perception", SENSED: "with perception"}
"""Names of the columns: a driver is told the truth, or what sensors track."""

KEEP = 3
"""Scenarios that each run exports: each is tested on its neighbours, which takes time."""

QUICK_SCENARIOS = ("cut-in", "lead-brakes", "left-across-path", "pedestrian-behind-parked")
"""Scenarios of a quick benchmark: one of each part of the domain."""

QUICK_DRIVERS = ("reference", "un-r157")
QUICK_BUDGET, QUICK_SEEDS, QUICK_KEEP = 40, 1, 1
TRIAGE, QUICK_TRIAGE = "short", "none"
"""Triage efforts of a full and of a quick benchmark, of
`bridgegen.search.triage.effort.EFFORTS`."""


@dataclass(frozen=True)
class Entrant:
    """A driver that takes part.

    Attributes:
        name: as given to ``--ego``.
        slug: of its runs' names.
        planner: what is known of it, if others wrote it.
        perceives: whether it has two columns; else it is told the truth.
        domain: where it means to drive; one that does not say so, everywhere.
        problem: why it cannot be made; empty if it can.
    """

    name: str
    slug: str
    planner: Planner | None
    perceives: bool
    domain: frozenset[str]
    problem: str = ""

    @property
    def columns(self) -> tuple[str, ...]:
        """Its columns."""
        return tuple(COLUMNS) if self.perceives else (PERFECT,)


@dataclass(frozen=True)
class Cell:
    """One run of the grid.

    Attributes:
        scenario: the logical scenario's name.
        driver: its name.
        column: of `COLUMNS`.
        seed: of the run.
        name: of the run and of its folder.
    """

    scenario: str
    driver: str
    column: str
    seed: int
    name: str


@dataclass(frozen=True)
class Plan:
    """The plan of a benchmark.

    Attributes:
        out: its folder.
        scenarios: by name, as the user refers to each.
        fingerprints: digests of their contents, by name.
        needs: of each scenario, by name, the words of `DOMAINS` that it needs.
        entrants: the drivers, in the user's order.
        seeds: runs of each driver in each scenario and column.
        budget: evaluations of each run.
        algorithm: that searches.
        keep: scenarios that a run exports.
        triage: how much of the findings is simulated again.
    """

    out: Path
    scenarios: Mapping[str, str]
    fingerprints: Mapping[str, str]
    needs: Mapping[str, frozenset[str]]
    entrants: tuple[Entrant, ...]
    seeds: int
    budget: int
    algorithm: str
    keep: int
    triage: str

    @property
    def cells(self) -> tuple[Cell, ...]:
        """Every run, in execution order: seed by seed, so that intermediate results compare."""
        return tuple(
            self.cell(scenario, entrant, column, seed)
            for seed in range(self.seeds)
            for scenario in self.scenarios
            for entrant in self.entrants
            if self.is_applicable(entrant, scenario) and not entrant.problem
            for column in entrant.columns
        )

    def cell(self, scenario: str, entrant: Entrant, column: str, seed: int) -> Cell:
        """Return a run of the grid."""
        name = f"{scenario}-{entrant.slug}-{column}-{seed}"
        return Cell(scenario, entrant.name, column, seed, name)

    def is_applicable(self, entrant: Entrant, scenario: str) -> bool:
        """Return whether a scenario lies within a driver's stated domain."""
        return self.needs[scenario] <= entrant.domain

    def folder(self, cell: Cell) -> Path:
        """Return the folder of a run."""
        return self.out / RUNS / cell.name

    def options_of(self, cell: Cell) -> SearchOptions:
        """Return the options of a run."""
        perceives = next(
            entrant.perceives for entrant in self.entrants if entrant.name == cell.driver
        )
        return SearchOptions(
            ego=cell.driver,
            # A driver without sensors is told the truth anyway.
            ideal=("perception",) if perceives and cell.column == PERFECT else (),
            algorithm=self.algorithm,
            budget=self.budget,
            seed=cell.seed,
            keep=self.keep,
            triage=self.triage,
        )

    def command(self) -> str:
        """Return the command line that starts or resumes this benchmark."""
        given = BenchmarkOptions(
            tuple(entrant.name for entrant in self.entrants),
            scenarios=tuple(self.scenarios.values()),
            budget=self.budget,
            seeds=self.seeds,
            algorithm=self.algorithm,
            keep=self.keep,
            triage=self.triage,
        )
        return command_of("benchmark planners", given, self.out)

    def identity(self) -> dict[str, Any]:
        """Return what must be equal in all runs of one folder, as JSON's types."""
        same: dict[str, Any] = {
            "version": version("bridgegen"),
            "budget": self.budget,
            "algorithm": self.algorithm,
            "keep": self.keep,
            "triage": self.triage,
        }
        same |= {f"scenario {name}": mark for name, mark in self.fingerprints.items()}
        for entrant in self.entrants:
            if entrant.planner is not None and not missing(entrant.planner):
                same[f"planner {entrant.name}"] = installed(entrant.planner)
        return same


def entrants(chosen: Sequence[str] | None, ours: Sequence[str]) -> tuple[Entrant, ...]:
    """Return the drivers that take part.

    Args:
        chosen: their names; None: ``ours``, and all planners that are installed.
        ours: names of drivers that ship.

    Raises:
        UnknownNameError: no such driver.
        InputError: one that is named twice, is not installed, or is told apart by its folder only.
    """
    if chosen is None:
        there = [name for name, planner in planners().items() if not missing(planner)]
        chosen = [*there, *ours]
    if not chosen:
        raise InputError("a benchmark needs at least one driver")
    found = tuple(_entrant(egos.get(name)) for name in chosen)
    for entrant in found:
        same = [each.name for each in found if each.slug == entrant.slug]
        if len(same) > 1:
            raise InputError(f"drivers must have different names, got {', '.join(same)}")
    return found


def _entrant(driver: Driver) -> Entrant:
    if driver.home:
        raise InputError(f"the driver '{driver.name}' drives in {driver.home} alone")
    name = driver.name
    planner = planners()[name] if egos.is_planner(name) else None
    file, colon, cls = name.rpartition(":")
    label = f"{Path(file).stem}-{cls}" if colon and egos.is_spec(name) else Path(name).name
    slug = re.sub(r"[^\w.-]+", "-", label)
    domain = driver.domain or frozenset(DOMAINS)
    return Entrant(name, slug, planner, "perception" in driver.stages, domain)


def make_plan(
    scenarios: Sequence[str | Path],
    drivers: tuple[Entrant, ...],
    needs: Mapping[str, frozenset[str]],
    *,
    seeds: int,
    budget: int,
    algorithm: str,
    keep: int,
    triage: str,
    out: Path,
) -> Plan:
    """Return a plan.

    Args:
        scenarios: names of the catalogue, or paths.
        drivers: that take part.
        needs: of the scenarios, as given.
        seeds: see `Plan`, as for the rest.
        budget: likewise.
        algorithm: likewise.
        keep: likewise.
        triage: likewise.
        out: likewise.

    Raises:
        InputError: a scenario that breaks a rule, or two of one name.
    """
    loaded = [(str(scenario), load(scenario)) for scenario in scenarios]
    called = [scenario.name for _, scenario in loaded]
    if again := sorted({name for name in called if called.count(name) > 1}):
        raise InputError(*(f"scenario {name} must be named once" for name in again))
    return Plan(
        out=out,
        scenarios={
            scenario.name: str(Path(given).resolve()) if is_file(given) else given
            for given, scenario in loaded
        },
        fingerprints={scenario.name: scenario.fingerprint for _, scenario in loaded},
        needs={scenario.name: needs[given] for given, scenario in loaded},
        entrants=drivers,
        seeds=seeds,
        budget=budget,
        algorithm=algorithm,
        keep=keep,
        triage=triage,
    )


def number_problems(seeds: int, budget: int, keep: int) -> list[str]:
    """Return which numbers of a benchmark are out of their range."""
    limits = (("seeds", seeds, 1, MAX_SEEDS), ("budget", budget, 1, 10**7), ("keep", keep, 1, 1000))
    return [
        f"{low} <= {name} <= {high} must hold, got {value}"
        for name, value, low, high in limits
        if not low <= value <= high
    ]


def ours() -> tuple[str, ...]:
    """Return the names of the drivers that ship and drive in the embedded simulator."""
    return tuple(DRIVERS)


def catalogue() -> tuple[str, ...]:
    """Return the scenarios of the catalogue."""
    return names()


def why_not(plan: Plan, entrant: Entrant, scenario: str) -> str:
    """Return why a scenario is not applicable to a driver."""
    outside = plan.needs[scenario] - entrant.domain
    return f"{in_words(outside)} is outside its domain ({in_words(entrant.domain)})"


# --- How long a benchmark will take, from the speed of each driver on this machine ---


FEW, MANY = 4, 32
"""Random rows in the two batches that measure a driver's speed."""

SLOW = 10.0
"""Time beyond which the larger batch is not driven [s]: the smaller one says enough."""

TESTED = {"full": 2000, "short": 800, "none": 0}
"""Approximate number of rows that a triage simulates again, by effort: neighbours, causes, minimal
scenarios. Measured: 260 to 3,800 a run if full, 0 to 1,200 if short."""

BESIDE = 8.0
"""Time that a run takes besides evaluations [s]: to begin, export and report. Measured on one
core."""


@dataclass(frozen=True)
class Speed:
    """The speed of a driver.

    Attributes:
        seconds: of one evaluation, in one thread.
        runs: that it has to make.
    """

    seconds: float
    runs: int


def measured(plan: Plan, say: Callable[[str], None]) -> tuple[Plan, dict[str, Speed]]:
    """Return the plan, with the drivers that cannot be made, and the speed of each other one.

    Each drives some random rows of the first scenario that is applicable to it.

    Args:
        plan: of the benchmark.
        say: called with each driver's name.
    """
    found, speeds = [], {}
    for entrant in plan.entrants:
        say(entrant.name)
        runs = sum(cell.driver == entrant.name for cell in plan.cells)
        scenario = next((s for s in plan.scenarios if plan.is_applicable(entrant, s)), None)
        if scenario is None:
            found.append(entrant)
            continue
        try:
            seconds = _seconds(entrant, plan.scenarios[scenario])
        except BridgeGenError as error:
            found.append(replace(entrant, problem=str(error)))
            continue
        found.append(entrant)
        speeds[entrant.name] = Speed(seconds, runs)
    return replace(plan, entrants=tuple(found)), speeds


def seconds_of(plan: Plan, speeds: dict[str, Speed], at_once: int) -> float:
    """Return how many seconds the whole benchmark takes, about.

    Each run makes its evaluations; about one of those of each driver, scenario and column is
    tested, too.
    """
    total = 0.0
    for speed in speeds.values():
        tested = speed.runs / plan.seeds * TESTED[plan.triage]
        total += speed.seconds * (speed.runs * plan.budget + tested) + speed.runs * BESIDE
    return total / at_once


def _seconds(entrant: Entrant, scenario: str) -> float:
    """Return the seconds of one evaluation among others; failed rows count as well."""
    logical = load(scenario)
    ideal = ("perception",) if entrant.perceives else ()
    options = PipelineOptions(ego=entrant.name, ideal=ideal)
    pipeline = Pipeline(logical, logical.space(), options, workers=Threads(1))
    pipeline.warm_up()
    U = np.random.default_rng(0).random((MANY, pipeline.space.n_var))
    X = pipeline.space.decode(U)
    took = {}
    for n in (FEW, MANY):
        start = time.perf_counter()
        pipeline.rollout(X[:n])
        took[n] = time.perf_counter() - start
        if took[n] > SLOW:
            break
    pipeline.runner.simulator.stop()
    # Of the larger batch: the time to begin a batch weighs least there.
    return took[max(took)] / max(took)
