"""What a benchmark of drivers can be asked, and the figures that it states."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bridgegen.engine.options.forms import FLAG, PATH, TEXT, WHOLE
from bridgegen.engine.options.option import DRIVER, OUTPUT, SEARCH, WHAT, option
from bridgegen.jobs.frame import ANY, DRIVERS, SCENARIOS, Job, SimulatingOptions


@dataclass(frozen=True, kw_only=True)
class BenchmarkOptions(SimulatingOptions):
    """The options of ``benchmark_planners``."""

    drivers: Sequence[str] = field(
        default=(),
        kw_only=False,
        metadata=option(
            DRIVERS,
            "Driver to test, see 'bridgegen list drivers'; or your own. May be repeated.",
            spelling="--ego",
            shown="all planners that are installed, and ours",
            group=DRIVER,
            names="driver",
        ),
    )
    scenarios: Sequence[str | Path] = field(
        default=(),
        metadata=option(
            SCENARIOS,
            "A name of the catalogue or a file; may be repeated.",
            spelling="--scenario",
            shown="the catalogue",
            group=WHAT,
            names="scenario",
        ),
    )
    budget: int | None = field(
        default=None,
        metadata=option(WHOLE, "Evaluations of each run.", shown="1000", group=SEARCH),
    )
    seeds: int | None = field(
        default=None,
        metadata=option(WHOLE, "Runs of each driver in each scenario.", shown="3", group=SEARCH),
    )
    algorithm: str = field(
        default="pso",
        metadata=option(
            TEXT,
            "Search algorithm, see 'bridgegen list algorithms'.",
            group=SEARCH,
            names="algorithm",
        ),
    )
    quick: bool = field(
        default=False,
        metadata=option(
            FLAG,
            "Four scenarios, two of our drivers, 40 evaluations, one seed, no triage: minutes.",
            group=SEARCH,
        ),
    )
    keep: int | None = field(
        default=None,
        metadata=option(WHOLE, "Scenarios that each run exports.", shown="3", group=OUTPUT),
    )
    triage: str | None = field(
        default=None,
        metadata=option(
            TEXT,
            "How much of the findings is simulated again: full, short or none.",
            shown="short",
            group=OUTPUT,
            names="triage",
        ),
    )
    workers: Any = field(
        default=None,
        metadata=option(
            ANY,
            "Runs at a time, each in a process. No result depends on it.",
            shown="one on each core",
            group=SEARCH,
        ),
    )
    out: Path | str | None = field(
        default=None,
        metadata=option(
            PATH,
            "Folder; a stopped benchmark is resumed.",
            shown="benchmarks/planners, or -quick",
            group=OUTPUT,
        ),
    )


JOB = Job(
    name="benchmark planners",
    options=BenchmarkOptions,
    function="bridgegen.jobs.benchmark.benchmark:benchmark_planners",
    help="""Compare planners by the failures that a search finds.

    Each driver drives each scenario within its domain, with perfect perception and with perception.
    Writes tables, a page, and scripts that reproduce the failures.
    """,
    figures={
        "modes": "failure modes for which the driver is responsible",
        "robust": "of them, those most neighbours of whose scenario fail, too",
        "severity": "the worst, probability of MAIS3+",
        "failures": "evaluations in which it failed and was responsible",
        "failed_rows": "evaluations without a result",
        "no_result": "scenarios without a result",
    },
    example="modes > 0",
)
