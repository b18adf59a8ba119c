"""What the mining of recordings can be asked, and the figures that it states."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from bridgegen.engine.options.forms import NUMBER, PATH, TEXT, WHOLE
from bridgegen.engine.options.option import DRIVER, OUTPUT, WHAT, option
from bridgegen.jobs.frame import PATHS, Job, JobOptions
from bridgegen.recordings import TIME_STEP


@dataclass(frozen=True, kw_only=True)
class MineOptions(JobOptions):
    """The options of ``mine``."""

    recordings: Path | str | Sequence[Path | str] = field(
        kw_only=False,
        metadata=option(
            PATHS,
            "Files of recorded traffic, or folders of such files.",
            group=WHAT,
            is_argument=True,
        ),
    )
    road_map: Path | str | None = field(
        default=None,
        metadata=option(
            PATH,
            "OpenDRIVE map of the place, in their coordinates.",
            spelling="--map",
            shown="the lanes that come with the recording, or inferred from its paths",
            group=WHAT,
        ),
    )
    time_step: float = field(
        default=TIME_STEP,
        metadata=option(NUMBER, "Resample at this time step [s].", spelling="--dt", group=WHAT),
    )
    scenarios: Path | str | Sequence[Path | str] = field(
        default=(),
        metadata=option(
            PATHS,
            "A scenario file whose events to look for, besides those that ship.",
            spelling="--scenario",
            hint="May be repeated.",
            group=WHAT,
        ),
    )
    update: Path | str | Sequence[Path | str] = field(
        default=(),
        metadata=option(
            PATHS,
            "A scenario file of yours: propose ranges that hold its events, as NAME.yaml.diff.",
            hint="May be repeated.",
            group=WHAT,
        ),
    )
    ego: str | None = field(
        default=None,
        metadata=option(
            TEXT,
            "Driver that takes the ego's place in the scenarios that are written.",
            shown="it does what was recorded",
            group=DRIVER,
            names="driver",
        ),
    )
    keep: int = field(
        default=10,
        metadata=option(
            WHOLE,
            "Number of the most critical events to write as scenarios.",
            limits=(0, 100_000),
            group=OUTPUT,
        ),
    )
    out: Path | str | None = field(
        default=None,
        metadata=option(
            PATH,
            "Folder for the page and the tables, new or an earlier one.",
            shown="mined",
            group=OUTPUT,
        ),
    )


JOB = Job(
    name="mine",
    options=MineOptions,
    function="bridgegen.jobs.mine.mine:mine",
    help="""Find events and near misses in recorded traffic, cleaned.

    Says what was recorded: hours, kilometres, participants by kind, and all that cleaning found.
    Lanes are those of the map, or of the recording, or inferred from its paths. Near misses are
    found as in a search; the most critical ones become OpenSCENARIO files that replay them.
    Files that cannot be read are left out and listed.
    The format is detected from the content: tables of states, esmini's log, levelX, NGSIM, SMARTS,
    CommonRoad, INTERACTION, SUMO FCD, Waymo motion as JSON, Argoverse 2, ScenarioNet.
    Finds events (cut-in, cut-out, lead-brakes, approach, following, lane-change)
    and the parameters of the scenarios that declare theirs. Makes a logical
    scenario of those with enough events: ranges, exposure, distribution.
    With --update, prints and writes new ranges for a file of yours as a diff.
    """,
    figures={
        "recordings": "recordings that were read",
        "skipped": "files left out, or what of them could not be read",
        "hours": "driven or walked, of all participants [h]",
        "kilometres": "the same [km]",
        "near_misses": "conflicts without contact",
        "contacts": "conflicts in which boxes touch",
        "events": "events of all kinds",
        "scenarios": "near misses that are written as scenarios",
        "mined": "logical scenarios that are made of events",
    },
    example="near_misses > 10",
)
