"""The commands that list what there is: scenarios, drivers, places of a map …, the installation."""

import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from bridgegen.cli import options
from bridgegen.cli.app import app, listing
from bridgegen.cli.completion import completing
from bridgegen.cli.connection import with_map_folder

if TYPE_CHECKING:
    from bridgegen.jobs.search.places import PlaceFit

Listed = tuple[Sequence[str], Sequence[Any]]
"""The head of a list, and its rows."""


def _of(name: str, *, entries: bool = False) -> Callable[[Callable[[], Listed]], None]:
    """Return what makes a command of a function: a table, or an entry for each row."""

    def decorate(made: Callable[[], Listed]) -> None:
        def command(as_json: options.Json = False) -> None:
            from bridgegen.cli.terminal.tables import print_entries, print_table

            (print_entries if entries else print_table)(*made(), as_json=as_json)

        command.__doc__ = made.__doc__
        listing.command(name)(command)

    return decorate


@listing.command("scenarios")
def list_scenarios(
    typology: Annotated[
        bool,
        typer.Option("--typology", help="Which types of crashes they realise, and which not."),
    ] = False,
    as_json: options.Json = False,
) -> None:
    """Logical scenarios of the catalogue."""
    from bridgegen.cli.terminal.tables import print_entries, print_table
    from bridgegen.scenario.language.reader import names
    from bridgegen.scenario.typology import typologies

    if not typology:
        rows = [(name, _file(name)["title"]) for name in names()]
        print_table(("scenario", "title"), rows, as_json=as_json)
    elif as_json:
        print(json.dumps([asdict(each) for each in typologies().values()], indent=2))
    else:
        print_entries(*_typologies(names()), as_json=False)


def _file(name: str) -> dict[str, Any]:
    """Return what a scenario that ships states; to read it as a scenario takes 30 times as long."""
    from bridgegen.scenario.language.reader import document_of

    return cast(dict[str, Any], document_of(name)[0].data)


def _typologies(scenarios: Sequence[str]) -> Listed:
    """Return how much of each typology the scenarios cover, and what they do not."""
    from bridgegen.scenario.typology import named, said, typologies

    rows = []
    for each in typologies().values():
        of_it = {name for kind in each.types for name in kind.scenarios}
        # Of a typology of some crashes only, it says nothing that most scenarios are in none.
        rest = sorted(set(scenarios) - of_it) if len(of_it) > len(scenarios) / 2 else []
        left = "; ".join(map(named, each.uncovered))
        facts = (each.counts, each.source, each.known)
        rows.append((each.title, said(each), left, ", ".join(rest), *facts))
    head = ("description", "not covered", "in none of these types", "shares of", "source")
    return ("typology", *head, "figures"), rows


@_of("packs")
def _packs() -> Listed:
    """Logical scenarios of the packs, with their clauses."""
    from bridgegen.scenario.language.reader import names, pack_names, pack_tables

    files = {name: _file(name) for name in (*names(), *pack_names())}
    rows = []
    for name in pack_names():
        ids = ", ".join(clause["id"] for clause in files[name].get("clauses", []))
        rows.append((name, files[name]["title"], ids))
    for pack, table in pack_tables().items():
        for entry, (scenario, keys) in table.entries.items():
            ids = ", ".join(map(table.id_of, keys))
            rows.append((f"{pack}/{entry}", files[scenario]["title"], ids))
        rows += [(f"{pack}: not answered", text, id) for id, text, _ in table.unanswered]
    return ("scenario", "title", "clauses"), rows


@_of("algorithms")
def _algorithms() -> Listed:
    """Search algorithms."""
    from bridgegen.search import algorithms as toolkit

    rows = []
    for kind in (toolkit.get(name) for name in toolkit.names()):
        settings = ", ".join(f"{name}={json.dumps(s.default)}" for name, s in kind.settings.items())
        rows.append((kind.name, kind.description, settings, kind.source))
    return ("algorithm", "description", "settings", "source"), rows


@_of("drivers", entries=True)
def _drivers() -> Listed:
    """Drivers of the ego, planners among them; of others.

    Of planners that others wrote: whether they are installed, or how to get them.
    """
    from bridgegen.drivers.drivers import HEAD, listed

    return HEAD, listed()


@_of("simulators")
def _simulators() -> Listed:
    """Simulators that can run the scenarios."""
    from bridgegen.simulation.choice import SIMULATORS

    rows = [
        (
            simulator.name,
            simulator.description,
            ", ".join(simulator.access),
            "; ".join(f"{name}: {what}" for name, what in simulator.settings.items()),
        )
        for simulator in SIMULATORS.values()
    ]
    return ("simulator", "description", "options", "settings"), rows


@_of("metrics")
def _metrics() -> Listed:
    """Criticality metrics."""
    from bridgegen.assess.conflict.quantities import MEASURED, QUANTITIES
    from bridgegen.assess.metrics import TABLE_I

    rows = [
        (
            m.name,
            m.unit,
            m.sense,
            m.description,
            getattr(m, "needs", None),
            "always" if m.name in (*TABLE_I, *MEASURED) else "on request",
        )
        for m in QUANTITIES.values()
    ]
    return ("metric", "unit", "more critical if", "description", "needs", "recorded"), rows


@_of("sight")
def _sight() -> Listed:
    """Distances at which the reference driver detects.

    A car and a pedestrian, in each weather [m].
    """
    from bridgegen.drivers.sight import HEAD, table

    return HEAD, list(table())


@_of("exposures", entries=True)
def _exposures() -> Listed:
    """Examples of exposures; none is used unless named."""
    from bridgegen.scenario.exposure import example_names, read_exposure

    made = [(name, read_exposure(name)) for name in example_names()]
    rows = [(name, f"of {exposure.scenario.name}", exposure.source) for name, exposure in made]
    return ("exposure", "description", "source"), rows


@listing.command("parameters")
def list_parameters(
    scenario: Annotated[
        str,
        typer.Argument(
            help="A catalogue name, or the path of a YAML file.",
            autocompletion=completing("scenario"),
        ),
    ],
    as_json: options.Json = False,
) -> None:
    """Parameters of a scenario: ranges and constraints."""
    from bridgegen.cli.terminal.tables import print_parameters
    from bridgegen.scenario.language.reader import load

    print_parameters(load(scenario).table(), as_json=as_json)


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


@app.command()
def doctor(as_json: options.Json = False) -> None:
    """Examine this installation: versions, cache, extras.

    Ends with status 2 if something keeps a search from working, or compiles at each start.
    """
    from bridgegen.cli.installation import examine
    from bridgegen.cli.terminal.tables import print_table

    found = list(examine())
    rows = [(finding.subject, finding.value, finding.advice) for finding in found]
    print_table(("subject", "value", "advice"), rows, as_json=as_json)
    if any(finding.is_problem for finding in found):
        raise typer.Exit(2)
