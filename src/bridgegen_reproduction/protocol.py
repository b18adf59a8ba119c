"""What is run: three comparisons over the same scenarios and seeds, each with another driver."""

import importlib.util
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bridgegen.base.errors import InputError
from bridgegen.jobs.compare.plan import MAX_SEEDS, RUNS, Cell
from bridgegen_reproduction.paper import (
    ITERATIONS,
    MAIN,
    METHODS,
    POPULATION,
    PPO,
    RS,
    SCENARIOS,
    shipped,
    short,
)

NEEDED_BY_PPO = ("torch", "stable_baselines3", "gymnasium")

MAX_ITERATIONS = 10_000


@dataclass(frozen=True)
class Part:
    """One comparison of the evaluation.

    Attributes:
        name: of its folder.
        title: what it is, in a few words.
        ego: who drives.
        ideal: the driver's stages that are ideal.
        causes: whether each critical scenario is replayed to find its cause.
        algorithms: that search; None: all there are.
    """

    name: str
    title: str
    ego: str
    ideal: tuple[str, ...] = ()
    causes: bool = False
    algorithms: tuple[str, ...] | None = None


PRINTED = Part("as-printed", "Section V as printed", "route-follower")
PERCEIVING = Part(
    "with-perception", "the reference driver and its perception", "reference", causes=True
)
IDEAL = Part(
    "ideal-perception",
    "the same random scenarios, perceived ideally",
    "reference",
    ideal=("perception",),
    algorithms=(RS.algorithm,),
)

PARTS = (PRINTED, PERCEIVING, IDEAL)


@dataclass(frozen=True)
class Protocol:
    """How much of Section V is run, and where.

    Attributes:
        out: the reproduction's folder.
        seeds: runs of each method in each scenario; their seeds are 0, 1, 2 …
        iterations: of each run, 40 evaluations each.
        scenarios: that the paper examines in detail first.
        algorithms: those that can be run here.
        road_map: a map to run on, None for a generated crossroads.
        junction: which junction of it.
    """

    out: Path
    seeds: int
    iterations: int
    scenarios: tuple[str, ...]
    algorithms: tuple[str, ...]
    road_map: Path | None
    junction: str | None

    @property
    def budget(self) -> int:
        """Evaluations of a run."""
        return self.iterations * POPULATION

    @property
    def missing(self) -> tuple[str, ...]:
        """Algorithms of the paper that cannot be run here."""
        return tuple(m.algorithm for m in METHODS if m.algorithm not in self.algorithms)

    def folder(self, part: Part) -> Path:
        """Return the folder of a comparison."""
        return self.out / part.name

    def algorithms_of(self, part: Part) -> tuple[str, ...]:
        """Return those that search in one part."""
        return tuple(a for a in self.algorithms if part.algorithms is None or a in part.algorithms)

    def cells(self) -> Iterator[tuple[Part, Cell]]:
        """Yield every run, in the order of running."""
        for part in PARTS:
            for seed in range(self.seeds):
                for scenario in self.scenarios:
                    for algorithm in self.algorithms_of(part):
                        yield part, Cell(scenario, algorithm, seed)

    def run_folder(self, part: Part, cell: Cell) -> Path:
        """Return the folder of a run."""
        return self.folder(part) / RUNS / cell.name

    def arguments(self, part: Part) -> dict[str, Any]:
        """Return the arguments of ``compare`` that make one part's runs."""
        return {
            "scenarios": tuple(map(shipped, self.scenarios)),
            "algorithms": self.algorithms_of(part),
            "seeds": self.seeds,
            "budget": self.budget,
            "ego": part.ego,
            "ideal": part.ideal,
            "causes": part.causes,
            "objective": {"paper": None},
            "road_map": self.road_map,
            "junction": self.junction,
            "out": self.folder(part),
        }

    def command(self) -> str:
        """Return the command line that begins this reproduction, or goes on with it."""
        words = ["bridgegen", "reproduce", "--seeds", str(self.seeds)]
        if self.iterations != ITERATIONS:
            words += ["--iterations", str(self.iterations)]
        if self.scenarios != SCENARIOS:
            words += ["--scenarios", ",".join(map(short, self.scenarios))]
        if self.road_map:
            words += ["--map", str(self.road_map)]
        if self.junction:
            words += ["--place", self.junction]
        return shlex.join([*words, "--out", str(self.out)])


def make_protocol(
    *,
    seeds: int,
    iterations: int,
    scenarios: tuple[str, ...],
    out: Path,
    road_map: Path | None,
    junction: str | None,
) -> Protocol:
    """Return a protocol, its numbers and names checked.

    Raises:
        InputError: a number out of range, a scenario that Section V does not have or that is named
            twice, or none of them is the main one.
    """
    problems = [
        f"1 <= {name} <= {high} must hold, got {value}"
        for name, value, high in (
            ("seeds", seeds, MAX_SEEDS),
            ("iterations", iterations, MAX_ITERATIONS),
        )
        if not 1 <= value <= high
    ]
    known = [short(name) for name in SCENARIOS]
    if strange := [name for name in scenarios if name not in known]:
        problems.append(
            f"Section V has the scenarios {', '.join(sorted(known))}, got {', '.join(strange)}"
        )
    if len(set(scenarios)) < len(scenarios):
        problems.append(f"each scenario must be named once, got {', '.join(scenarios)}")
    if short(MAIN) not in scenarios:
        problems.append(f"{short(MAIN)} must be among the scenarios: the paper's numbers are of it")
    if problems:
        raise InputError(*problems)
    return Protocol(
        out=out,
        seeds=seeds,
        iterations=iterations,
        scenarios=tuple(name for name in SCENARIOS if short(name) in scenarios),
        algorithms=available(),
        road_map=road_map,
        junction=junction,
    )


def available() -> tuple[str, ...]:
    """Return the paper's algorithms that can be run with what is installed."""
    has_ppo = all(importlib.util.find_spec(name) for name in NEEDED_BY_PPO)
    return tuple(m.algorithm for m in METHODS if m is not PPO or has_ppo)
