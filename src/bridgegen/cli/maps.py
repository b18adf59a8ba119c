"""The command that lists the places of a map."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bridgegen.cli import options
from bridgegen.cli.app import listing
from bridgegen.cli.completion import completing
from bridgegen.cli.connection import with_map_folder

if TYPE_CHECKING:
    from bridgegen.jobs.search.places import PlaceFit


@listing.command("places")
@with_map_folder()
def places(
    road_map: Annotated[
        Path, typer.Argument(metavar="MAP", help="An OpenDRIVE map (.xodr), or its import (.owl).")
    ],
    scenario: Annotated[
        str | None,
        typer.Argument(
            help="Say which places this scenario fits: a catalogue name, or a YAML file.",
            autocompletion=completing("scenario"),
        ),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Draw the map with its places: an .svg file, new.")
    ] = None,
    as_json: options.Json = False,
) -> None:
    """List the places of a map: junctions, roads and others.

    Also roundabouts, and merges. With a scenario: which of them it fits (junctions at how many
    rotations of its legs), and what the others lack. What fits can be searched (search SCENARIO
    --map MAP --place ID).
    """
    from bridgegen.cli.terminal.tables import print_table
    from bridgegen.jobs.search.places import places_of
    from bridgegen.pages.map_picture import write_map_picture
    from bridgegen.scenario.language.reader import load

    found, model, warnings = places_of(road_map, load(scenario) if scenario else None)
    for warning in warnings:
        print(f"bridgegen: warning: {warning}", file=sys.stderr)
    if scenario and not found and not as_json:
        print(
            f"{road_map}: nothing of the kind of place that {scenario} needs; "
            f"'bridgegen list places {road_map}' lists what there is"
        )
    elif scenario:
        print_table(
            ("place", "what there is", "fits", "where, or what is missing"),
            [
                (fit.id, fit.size, _fits(fit), fit.placed or fit.lacks)
                for fit in sorted(found, key=lambda fit: not fit.rotations)
            ],
            as_json=as_json,
        )
    else:
        print_table(
            ("place", "kind", "what there is", "roads"),
            [(fit.id, fit.kind, fit.size, ", ".join(fit.legs)) for fit in found],
            as_json=as_json,
        )
    if picture is not None:
        fits = [fit for fit in found if fit.rotations]
        junctions = {fit.id for fit in fits if fit.kind == "junction"} if scenario else None
        roads = {fit.id: fit.legs[0] for fit in fits if fit.kind != "junction"}
        write_map_picture(picture, model, junctions, roads)
        # With --json, stdout holds JSON and nothing else.
        print(picture, file=sys.stderr if as_json else sys.stdout)


def _fits(place: "PlaceFit") -> str:
    """Return whether a scenario fits a place, in a word: a junction at how many rotations."""
    if not place.rotations:
        return "no"
    return (
        "yes"
        if place.kind in ("road", "merge")
        else f"{place.rotations} of {len(place.legs)} rotations"
    )
