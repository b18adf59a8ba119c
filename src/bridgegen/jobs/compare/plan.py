"""The grid of runs of a comparison: scenarios × algorithms × seeds, and its identity."""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.base.plugins import file_of, label_of
from bridgegen.engine.options import CommonOptions, SearchOptions
from bridgegen.jobs.compare.options import CompareOptions
from bridgegen.jobs.frame import command_of
from bridgegen.jobs.search.scenarios import is_file, load
from bridgegen.results.folder import claim
from bridgegen.results.store.run_file import FILE as RUN_FILE
from bridgegen.search import algorithms as toolkit
from bridgegen.search.algorithms.algorithm import Problem, Value, resolve

FILE = "compare.json"
"""File in a comparison's folder with the settings of all its runs."""

RUNS = "runs"
"""Folder in a comparison's folder that holds the folders of its runs."""

RUN_PATTERN = f"*/{RUN_FILE}"
"""Path of a run's file in that folder, as a pattern."""

MAX_SEEDS = 1000


@dataclass(frozen=True)
class Cell:
    """One run of the grid.

    Attributes:
        scenario: the logical scenario's name.
        algorithm: that searches it, by its name in the comparison.
        seed: of the run.
    """

    scenario: str
    algorithm: str
    seed: int

    @property
    def name(self) -> str:
        """The name of the run and of its folder."""
        return f"{self.scenario}-{self.algorithm}-{self.seed}"


@dataclass(frozen=True)
class Plan:
    """The plan of a comparison.

    Attributes:
        out: the comparison's folder.
        scenarios: by name, as the user refers to each.
        fingerprints: digests of their contents, by name.
        algorithms: the user's settings of each, by its name; in the user's order.
        methods: what the user called each, by its name: the same, or where the user's own is.
        seeds: runs of each algorithm in each scenario; their seeds are 0, 1, 2 …
        budget: evaluations of each run.
        baseline: the algorithm that the others are tested against.
        apart: minimum distance of two different critical scenarios.
        options: of all runs.
    """

    out: Path
    scenarios: Mapping[str, str]
    fingerprints: Mapping[str, str]
    algorithms: Mapping[str, Mapping[str, Value]]
    methods: Mapping[str, str]
    seeds: int
    budget: int
    baseline: str
    apart: float
    options: CommonOptions

    @property
    def cells(self) -> tuple[Cell, ...]:
        """Every run, in execution order: seed by seed, so that intermediate results compare."""
        return tuple(
            Cell(scenario, algorithm, seed)
            for seed in range(self.seeds)
            for scenario in self.scenarios
            for algorithm in self.algorithms
        )

    @property
    def cells_in_order(self) -> tuple[Cell, ...]:
        """Every run, in display order: by scenario, algorithm and seed."""
        scenarios, algorithms = list(self.scenarios), list(self.algorithms)

        def place(cell: Cell) -> tuple[int, int, int]:
            return scenarios.index(cell.scenario), algorithms.index(cell.algorithm), cell.seed

        return tuple(sorted(self.cells, key=place))

    def folder(self, cell: Cell) -> Path:
        """Return the folder of a run."""
        return self.out / RUNS / cell.name

    def options_of(self, cell: Cell) -> SearchOptions:
        """Return the options of a run.

        Weights are for algorithms that minimise one sum; a multi-objective one does not get any,
        unless the user chooses many objectives for all algorithms.
        """
        options = self.options
        method = self.methods[cell.algorithm]
        of_many = toolkit.get(method).objectives == "many"
        if of_many and options.objectives is None:
            terms = options.objective and dict.fromkeys(options.objective)
            options = replace(options, weights=None, objective=terms)
        return SearchOptions.of(
            options,
            algorithm=method,
            settings=self.algorithms[cell.algorithm],
            budget=self.budget,
            seed=cell.seed,
        )

    def command(self) -> str:
        """Return the command line that starts or resumes this comparison."""
        given = CompareOptions.of(
            self.options,
            scenarios=tuple(self.scenarios.values()),
            algorithms=tuple(self.methods.values()),
            settings={name: algorithm for name, algorithm in self.algorithms.items() if algorithm},
            baseline=None if self.baseline == next(iter(self.algorithms)) else self.baseline,
            apart=self.apart,
            seeds=self.seeds,
            budget=self.budget,
        )
        return command_of("benchmark algorithms", given, self.out)

    def identity(self) -> dict[str, Any]:
        """Return what must be equal in all runs of one folder, as JSON's types."""
        given = asdict(self.options)
        road_map = given.pop("road_map")
        same = {
            "version": version("bridgegen"),
            "budget": self.budget,
            **given,
            # By content: a map that was moved is the same, one that was edited is not.
            "map": None if road_map is None else _digest(Path(road_map)),
        }
        same |= {f"scenario {name}": mark for name, mark in self.fingerprints.items()}
        for name, settings in self.algorithms.items():
            method = self.methods[name]
            # A setting that is given its default is the same as one that is not given.
            known = {key: setting.default for key, setting in toolkit.get(method).settings.items()}
            same[f"settings of {name}"] = {**known, **settings}
            # A user's own algorithm has no version: its file's content stands for it.
            if (file := file_of(method)) is not None:
                same[f"algorithm {name}"] = _digest(file)
        return _plain(same)


def make_plan(
    scenarios: Sequence[str | Path],
    algorithms: Sequence[str],
    *,
    settings: Mapping[str, Mapping[str, Value]],
    seeds: int,
    budget: int,
    baseline: str | None,
    apart: float,
    out: Path | None,
    options: CommonOptions,
) -> Plan:
    """Return a plan, its names and numbers checked.

    Raises:
        InputError: a name twice or missing, a value out of range; a scenario that breaks a rule.
        UnknownNameError: no such scenario, algorithm or setting.
    """
    methods = {label_of(algorithm): algorithm for algorithm in algorithms}
    problems = _twice("scenario", [str(scenario) for scenario in scenarios])
    problems += _twice("algorithm", [label_of(algorithm) for algorithm in algorithms])
    problems += [
        f"{low} <= {name} <= {high} must hold, got {value}"
        for name, value, low, high in (("seeds", seeds, 1, MAX_SEEDS), ("budget", budget, 1, 10**7))
        if not low <= value <= high
    ]
    if not 0.0 < apart <= 1.0:
        problems.append(f"0 < distinct <= 1 must hold, got {apart:g}")
    if options.distribution and len(scenarios) > 1:
        problems.append("a distribution belongs to one scenario file; compare that one alone")
    if problems:
        raise InputError(*problems)
    first = label_of(baseline or algorithms[0])
    for name, method in methods.items():
        # Only for what it refuses, before anything is run.
        resolve(toolkit.get(method), Problem.unnamed(1), 0, settings.get(name, {}))
    for name in [*settings, first]:
        if name not in methods:
            raise UnknownNameError("algorithm of this comparison", name, methods)
    loaded = [(str(scenario), load(scenario, options.distribution)) for scenario in scenarios]
    if problems := _twice("scenario called", [scenario.name for _, scenario in loaded]):
        raise InputError(*problems)
    return Plan(
        out=out or Path("comparisons") / "-".join(scenario.name for _, scenario in loaded),
        scenarios={
            scenario.name: str(Path(given).resolve()) if is_file(given) else given
            for given, scenario in loaded
        },
        fingerprints={scenario.name: scenario.fingerprint for _, scenario in loaded},
        algorithms={name: dict(settings.get(name, {})) for name in methods},
        methods=methods,
        seeds=seeds,
        budget=budget,
        baseline=first,
        apart=apart,
        options=options,
    )


def begin(plan: Plan) -> None:
    """Create a comparison's folder, or check that it holds this comparison.

    The plan may have more scenarios, algorithms and seeds than before: the grid grows.

    Raises:
        StorageError: the folder holds something else, or runs with other settings.
    """
    claim(
        plan.out,
        plan.identity(),
        file=FILE,
        what="comparison",
        pieces=RUNS,
        kept=RUN_PATTERN,
        grows=True,
        defaults=asdict(CommonOptions()),
    )


def _plain(value: Any) -> dict[str, Any]:
    """Return an object as JSON's types."""
    # What is compared with a file must have passed through JSON: tuples become lists there.
    plain: dict[str, Any] = json.loads(json.dumps(value))
    return plain


def _twice(what: str, names: Iterable[str]) -> list[str]:
    names = list(names)
    if not names:
        return [f"a comparison needs at least one {what}"]
    again = {name for name in names if names.count(name) > 1}
    return [f"{what} {name} must be named once" for name in sorted(again)]


def _digest(path: Path) -> str:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
