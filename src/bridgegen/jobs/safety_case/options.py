"""What a safety case can be asked, and the figures that it states."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from bridgegen.engine.options.forms import PATH
from bridgegen.engine.options.option import OUTPUT, WHAT, option
from bridgegen.jobs.frame import PATHS, Job, JobOptions


@dataclass(frozen=True, kw_only=True)
class SafetyCaseOptions(JobOptions):
    """The options of ``export_safety_case``."""

    runs: Path | str | Sequence[Path | str] = field(
        kw_only=False,
        metadata=option(PATHS, "Folders of finished runs.", group=WHAT, is_argument=True),
    )
    out: Path | str | None = field(
        default=None,
        metadata=option(
            PATH,
            "Folder for the files.",
            shown="RUN/safety-case, or safety-case for several runs",
            group=OUTPUT,
        ),
    )


JOB = Job(
    name="safety-case",
    options=SafetyCaseOptions,
    function="bridgegen.jobs.safety_case.export:export_safety_case",
    help="""Export what runs support: claims with evidence.

    As Goal Structuring Notation, JSON and a page, with a script that recomputes every number.
    """,
    figures={
        "supported": "goals that the evidence supports: the top one, those next below each run's",
        "not_supported": "goals that evidence speaks against",
        "incomplete": "goals that nothing speaks against, above an undeveloped one",
        "undeveloped": "goals for which there is no evidence",
    },
    example="not_supported > 0",
    fails="a run could not be judged: it supports nothing",
)
