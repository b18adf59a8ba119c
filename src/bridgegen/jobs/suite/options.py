"""What a suite, and a difference of two drivers on one, can be asked; and the figures of both."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from bridgegen.engine.options import CommonOptions
from bridgegen.engine.options.forms import FLAG, PATH, TEXT, WHOLE
from bridgegen.engine.options.forms import SIMULATOR as CHOICE
from bridgegen.engine.options.option import DRIVER, OUTPUT, SEARCH, SIMULATOR, WHAT, option
from bridgegen.engine.options.search import MAX_BUDGET, OF_ODD, SearchOptions
from bridgegen.jobs.frame import DRIVERS, SCENARIOS, Job, SimulatingOptions
from bridgegen.simulation.choice import EMBEDDED, SimulatorChoice

BUDGET = 300
"""Number of evaluations of a search for where one driver is worse than another, each with both."""

SAMPLES, MAX_SAMPLES = 100, 10**7


def _of_search(name: str) -> Mapping[str, Any]:
    """Return the declaration of an option that searches have, too."""
    (declared,) = (item.metadata for item in fields(SearchOptions) if item.name == name)
    return declared


@dataclass(frozen=True, kw_only=True)
class ScenariosOptions(SimulatingOptions):
    """The options of what runs many scenarios with all their variations."""

    files: str | Path | Sequence[str | Path] = field(
        kw_only=False,
        metadata=option(
            SCENARIOS,
            "Folders, scenario files (.xosc, .yaml), distribution files, names of the catalogue, "
            "packs.",
            names="suite",
            group=WHAT,
            is_argument=True,
        ),
    )
    egos: str | Sequence[str] = field(
        default=(),
        metadata=option(
            DRIVERS,
            "Driver of the ego; may be repeated: several are run side by side.",
            spelling="--ego",
            shown="each scenario's own",
            group=DRIVER,
            names="driver",
        ),
    )
    ideal: Sequence[str] = field(default=(), metadata=_of_search("ideal"))
    vehicle: str | None = field(default=None, metadata=_of_search("vehicle"))
    others: str | None = field(default=None, metadata=_of_search("others"))
    time_limit: float | None = field(default=None, metadata=_of_search("time_limit"))
    repeats: int | None = field(default=None, metadata=_of_search("repeats"))
    criteria: Sequence[Mapping[str, str | Sequence[str]]] = field(
        default=(), metadata=_of_search("criteria")
    )
    critical: str | None = field(default=None, metadata=_of_search("critical"))
    count: str | None = field(default=None, metadata=_of_search("count"))
    empty_trigger: str | None = field(default=None, metadata=_of_search("empty_trigger"))
    odd: Mapping[str, Any] | Path | str | None = field(default=None, metadata=OF_ODD)
    matrix: str | None = field(
        default=None,
        metadata=option(
            TEXT,
            "Edition of the scenarios' matrices, such as 2026; 'none' for --samples instead.",
            shown="all editions",
            group=SEARCH,
        ),
    )
    samples: int = field(
        default=SAMPLES,
        metadata=option(
            WHOLE,
            "Evenly spread variations of each logical scenario without a matrix, besides its "
            "defaults.",
            limits=(0, MAX_SAMPLES),
            group=SEARCH,
        ),
    )
    seed: int = field(default=0, metadata=option(WHOLE, "Seed of the variations.", group=SEARCH))
    workers: int | None = field(
        default=None,
        metadata=option(
            WHOLE,
            "Scenarios at a time, each in a process. No result depends on it.",
            shown="one on each core",
            limits=(1, 10_000),
            group=SEARCH,
        ),
    )
    out: Path | str | None = field(
        default=None,
        metadata=option(
            PATH,
            "Folder of the results; those of a stopped one are resumed.",
            shown="suites/NAME",
            group=OUTPUT,
        ),
    )

    @property
    def of_each(self) -> CommonOptions:
        """How each scenario is run and judged."""
        return CommonOptions.of(self)

    @property
    def more_figures(self) -> Sequence[str]:
        """The figures that these options add to those of the job."""
        return [f"criterion:{criterion['id']}" for criterion in self.criteria]


@dataclass(frozen=True, kw_only=True)
class SuiteOptions(ScenariosOptions):
    """The options of ``run_suite``."""

    simulator: SimulatorChoice = field(
        default=EMBEDDED,
        metadata=option(
            CHOICE,
            "See 'bridgegen list simulators'.",
            shown="embedded",
            group=SIMULATOR,
            names="simulator",
        ),
    )
    driver_name: str | None = field(default=None, metadata=_of_search("driver_name"))
    assessor: Path | None = field(
        default=None,
        metadata=option(
            PATH,
            "Run what an assessor's key ('suite commit') draws instead, and seal the result.",
            group=SEARCH,
        ),
    )
    with_maps: bool = field(
        default=False,
        metadata=option(
            FLAG,
            "Draw the preventability map of each scenario that has a grid of its own.",
            spelling="--preventability",
            group=OUTPUT,
        ),
    )


@dataclass(frozen=True, kw_only=True)
class DiffOptions(ScenariosOptions):
    """The options of ``compare_drivers``."""

    egos: str | Sequence[str] = field(
        metadata=option(
            DRIVERS,
            "Driver of the ego; given twice: the one to compare with, then the new one.",
            spelling="--ego",
            group=DRIVER,
            names="driver",
        ),
    )
    samples: int = field(
        default=1000,
        metadata=option(
            WHOLE,
            "Evenly spread variations of each logical scenario without a matrix, besides its "
            "defaults.",
            limits=(0, MAX_SAMPLES),
            group=SEARCH,
        ),
    )
    budget: int = field(
        default=BUDGET,
        metadata=option(
            WHOLE,
            "Evaluations of the search of each logical scenario for where the second is worse; 0: "
            "none is searched.",
            limits=(0, MAX_BUDGET),
            group=SEARCH,
        ),
    )
    seed: int = field(
        default=0, metadata=option(WHOLE, "Seed of the variations, and of searches.", group=SEARCH)
    )


SUITE = Job(
    name="suite",
    options=SuiteOptions,
    function="bridgegen.jobs.suite.suite:run_suite",
    help="""Run many scenario files with all their variations.

    Finds scenarios and distributions in folders, runs them in parallel, and judges each variation:
    the ego fails if it is critical, or if a pass criterion is violated.
    """,
    figures={
        "entries": "scenarios with their variations, of all egos",
        "variations": "variations, of all egos",
        "passed": "variations that pass",
        "failed": "variations that fail: critical, or a pass criterion or clause is violated",
        "known": "failed ones that the suite's index calls known or accepted",
        "regressions": "failed ones that the suite's index calls fixed",
        "new_failures": "the other failed ones",
        "not_judged": "variations that could not be judged: they say nothing of the ego",
        "not_judged_entries": "entries that could not be judged",
        "flaky": "variations whose repeats disagree: they neither pass nor fail",
        "not_run": "variations that did not run; an entry that cannot run is one",
        "failed_entries": "entries in which a variation fails",
        "failed_clauses": "clauses of a regulation that an ego fails",
        "critical": "variations that are critical",
        "collisions": "variations in which the ego collides",
        "mitigated": "variations in which it hits something, slower than at the start",
        "not_avoided": "variations in which it hits something, not slower than at the start",
        "worst_impact": "the fastest impact [m/s]",
        "worst_severity": "the worst probability of MAIS3+",
    },
    example="failed > 2",
    fails="a variation fails or did not run, or a scenario is not judged",
)

DIFF = Job(
    name="diff",
    options=DiffOptions,
    function="bridgegen.jobs.suite.difference:compare_drivers",
    help="""Compare two drivers on the same variations.

    Lists what the second breaks and fixes, with the confidence of either share. Then searches the
    logical scenarios for where the second is worse.
    """,
    figures={
        "broken": "variations that the first ego passes and the second fails",
        "fixed": "variations that the first ego fails and the second passes",
        "both_fail": "variations that both fail",
        "both_pass": "variations that both pass",
        "not_comparable": "variations that could not be judged with one of them, or did not run",
        "not_run": "variations that one of them did not run",
        "not_judged_entries": "entries of which fewer than half of the variations could be "
        "compared",
        "more_severe": "variations in which the second's severity is larger",
        "less_severe": "variations in which the second's severity is smaller",
        "p_value": "of McNemar's exact test",
        "worse": "evaluations of the searches that the second ego fails and the first passes",
        "worse_modes": "failure modes that they make up",
        "worse_scenarios": "scenarios in which a search finds any",
        "not_searched": "scenarios whose search failed, or could not be judged",
    },
    example="broken > 0",
    fails="too few can be compared; with --junit, that one is broken or a search finds where",
)
