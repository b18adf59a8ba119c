"""What a dashboard can be asked, and the figures that it states."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bridgegen.engine.options.forms import CRITERIA, FLAG, ODD, PATH
from bridgegen.engine.options.option import OBJECTIVE, OUTPUT, WHAT, option
from bridgegen.jobs.frame import Job, JobOptions


@dataclass(frozen=True, kw_only=True)
class DashboardOptions(JobOptions):
    """The options of ``build_dashboard``."""

    folder: Path | str = field(
        kw_only=False,
        metadata=option(
            PATH,
            "The folder of a project: runs, suites, maps, comparisons below it.",
            group=WHAT,
            is_argument=True,
        ),
    )
    out: Path | str | None = field(
        default=None,
        metadata=option(
            PATH, "The page (.html) to write.", shown="dashboard.html in the folder", group=OUTPUT
        ),
    )
    criteria: Sequence[Mapping[str, str | Sequence[str]]] = field(
        default=(),
        metadata=option(
            CRITERIA,
            "A requirement of the project, tested or not: a file of criteria, or 'ID: FORMULA'.",
            spelling="--criterion",
            hint="May be repeated.",
            group=OBJECTIVE,
        ),
    )
    odd: Mapping[str, Any] | Path | str | None = field(
        default=None,
        metadata=option(
            ODD,
            "The project's operational design domain: a file in ASAM OpenODD 1.0's YAML.",
            shown="that of the first run that has one",
            group=WHAT,
        ),
    )
    update: bool = field(
        default=False,
        metadata=option(
            FLAG,
            "Add failure modes that no failures.yaml names to that in the folder, as new.",
            group=OUTPUT,
        ),
    )


JOB = Job(
    name="dashboard",
    options=DashboardOptions,
    function="bridgegen.jobs.dashboard.dashboard:build_dashboard",
    help="""Show all results of a project on one page.

    What fails now, trends over driver versions, requirements by scenario, coverage of the
    operational design domain. The statuses of failure modes are those of failures.yaml, in the
    folder and in suites that grow, which are yours.
    """,
    figures={
        "new": "failure modes of current results with the status new, or with none",
        "known": "failure modes of current results with the status known",
        "accepted": "failure modes of current results with the status accepted",
        "fixed": "failure modes with the status fixed that no current result has",
        "regressions": "failure modes with the status fixed that a current result has",
        "failing": "all failure modes of current results",
        "worst_severity": "the worst probability of MAIS3+ of these",
        "requirements": "requirements",
        "violated_requirements": "requirements that a driver violates",
        "untested_requirements": "requirements that no scenario tests",
        "scenarios_without_requirement": "scenarios that test no requirement",
        "runs": "runs",
        "suites": "suites",
        "maps": "preventability maps",
        "comparisons": "comparisons of algorithms",
        "scenarios": "scenarios that runs and suites test",
        "drivers": "drivers, each version by itself",
        "evaluations": "evaluations of runs and variations of suites",
        "problems": "folders and scenarios that cannot be read",
    },
    example="new > 0",
    has_folder=False,
)
