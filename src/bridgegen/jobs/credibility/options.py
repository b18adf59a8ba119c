"""What a credibility dossier can be asked, and the figures that it states."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from bridgegen.engine.options.forms import FLAG, PATH
from bridgegen.engine.options.option import OUTPUT, WHAT, option
from bridgegen.jobs.frame import PATHS, Job, JobOptions


@dataclass(frozen=True, kw_only=True)
class CredibilityOptions(JobOptions):
    """The options of ``export_credibility``."""

    runs: Path | str | Sequence[Path | str] = field(
        kw_only=False,
        default=(),
        metadata=option(
            PATHS,
            "Folders of finished runs, or of projects with runs in them.",
            shown="none, which --validate allows",
            group=WHAT,
            is_argument=True,
        ),
    )
    validate: bool = field(
        default=False,
        metadata=option(
            FLAG,
            "Run the validation suite: does this installation give answers that are known? Its "
            "protocol is validation.json.",
            group=WHAT,
        ),
    )
    out: Path | str | None = field(
        default=None,
        metadata=option(
            PATH,
            "Folder for the files.",
            shown="RUN/dossier, or dossier for several runs, a project or none",
            group=OUTPUT,
        ),
    )


JOB = Job(
    name="credibility",
    options=CredibilityOptions,
    function="bridgegen.jobs.credibility.export:export_credibility",
    help="""Export a dossier on the tool, with figures.

    In the chapters that authorities ask for, as JSON and a page, with a script that recomputes
    every figure, and a form for what people must state.
    """,
    figures={
        "filled": "items that figures of these runs, or the installed package, fill",
        "partly": "items that they fill in part",
        "stated": "items that people have filled, in yours.yaml",
        "yours": "items that people have yet to fill",
        "gap": "items that nothing fills",
        "gaps": "what is missing: items that nothing fills, and runs or parts that are not read",
        "runs": "runs that are read",
        "unread": "runs that are not",
        "findings": "findings that were simulated at fractions of the time step",
        "flips": "of them, those whose verdict or kind of conflict depends on the time step",
        "sample_flips": "evaluations without failure, of a sample, that depend on it",
        "refused": "comparisons with real tests whose area is beyond its threshold",
        "cases": "cases of the validation suite; with --validate",
        "wrong": "of them, those with a wrong answer",
        "other_bits": "of them, those with other bits than the published ones",
    },
    example="flips > 0",
    fails="a run could not be read, a case of the validation suite fails",
)
