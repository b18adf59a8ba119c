"""The command that reads recorded traffic."""

from pathlib import Path
from typing import Annotated

import typer

from bridgegen.cli import options as common
from bridgegen.cli.app import app
from bridgegen.cli.completion import completing
from bridgegen.cli.groups import FILES


@app.command(rich_help_panel=FILES)
def mine(
    recordings: Annotated[
        list[Path], typer.Argument(help="Files of recorded traffic, or folders of such files.")
    ],
    out: Annotated[
        Path, typer.Option(help="Folder for the page and the tables, new or an earlier one.")
    ] = Path("mined"),
    road_map: Annotated[
        Path | None,
        typer.Option("--map", help="OpenDRIVE map of the place, in their coordinates."),
    ] = None,
    lenient: Annotated[
        bool,
        typer.Option("--lenient", help="Skip files that cannot be read, and list them."),
    ] = False,
    dt: Annotated[float, typer.Option(help="Resample at this time step [s].")] = 0.05,
    scenario: Annotated[
        list[Path] | None,
        typer.Option(help="A scenario file whose events to look for, too. May be repeated."),
    ] = None,
    update: Annotated[
        list[Path] | None,
        typer.Option(help="A scenario file of yours: propose ranges that hold its events."),
    ] = None,
    keep: Annotated[
        int, typer.Option(help="Number of the most critical events to write as scenarios.")
    ] = 10,
    ego: Annotated[
        str | None,
        typer.Option(
            help="Driver that takes the ego's place in them, see 'bridgegen list drivers'.",
            autocompletion=completing("driver"),
        ),
    ] = None,
    as_json: common.Json = False,
) -> None:
    """Find events and near misses in recorded traffic, cleaned.

    Says what was recorded: hours, kilometres, participants by kind, and all that cleaning found.
    Lanes are those of the map, or of the recording, or inferred from its paths. Near misses are
    found as in a search; the most critical ones become OpenSCENARIO files that replay them.
    The format is told by the content: tables of states, esmini's log, levelX, NGSIM, SMARTS,
    CommonRoad, INTERACTION, SUMO FCD, Waymo motion as JSON, Argoverse 2, ScenarioNet.
    Finds events (cut-in, cut-out, lead-brakes, approach, following, lane-change)
    and the parameters of the scenarios that declare theirs. Makes a logical
    scenario of those with enough events: ranges, exposure, distribution.
    With --update, prints and writes new ranges for a file of yours as a diff.
    """
    from bridgegen.cli.terminal.recordings import RecordingsScreen, print_mined
    from bridgegen.jobs.mine.mine import mine as mine_recordings

    with RecordingsScreen() as screen:
        mined = mine_recordings(
            recordings,
            out=out,
            road_map=road_map,
            lenient=lenient,
            time_step=dt,
            scenarios=scenario or (),
            update=update or (),
            keep=keep,
            ego=ego,
            progress=screen.progress,
            fitting=screen.fitting,
        )
    print_mined(mined, as_json=as_json)
