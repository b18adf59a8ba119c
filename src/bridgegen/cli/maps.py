"""The command that lists the junctions of a map."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from bridgegen.cli import options
from bridgegen.cli.app import app
from bridgegen.cli.completion import completing
from bridgegen.cli.groups import FILES


@app.command(rich_help_panel=FILES)
def junctions(
    road_map: Annotated[
        Path, typer.Argument(metavar="MAP", help="An OpenDRIVE map (.xodr), or its import (.owl).")
    ],
    scenario: Annotated[
        str | None,
        typer.Argument(
            help="Say which junctions this scenario fits: a catalogue name, or a YAML file.",
            autocompletion=completing("scenario"),
        ),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Draw the map with its junctions: an .svg file, new.")
    ] = None,
    as_json: options.Json = False,
) -> None:
    """List the junctions of a map.

    With a scenario: which of them it fits, at how many rotations of its legs, and what the others
    lack. What fits can be searched (search SCENARIO --map MAP --junction ID).
    """
    from bridgegen.campaign.junctions import junctions_of
    from bridgegen.odd.reader import load
    from bridgegen.report.map_picture import write_map_picture
    from bridgegen.screen.tables import print_table

    found, model, warnings = junctions_of(road_map, load(scenario) if scenario else None)
    for warning in warnings:
        print(f"bridgegen: warning: {warning}", file=sys.stderr)
    columns = ("junction", "legs", "lights")
    rows = [(one.id, ", ".join(one.legs), one.lights) for one in found]
    if scenario:
        fits = [
            (
                f"{one.rotations} of {len(one.legs)}" if one.rotations else "none",
                one.placed or one.lacks,
            )
            for one in found
        ]
        print_table(
            (*columns, "rotations that fit", "where, or what is missing"),
            [(*row, *fit) for row, fit in zip(rows, fits, strict=True)],
            as_json=as_json,
        )
    else:
        print_table(columns, rows, as_json=as_json)
    if picture is not None:
        fitting = {one.id for one in found if one.rotations} if scenario else None
        write_map_picture(picture, model, fitting)
        print(picture, file=sys.stderr if as_json else sys.stdout)
