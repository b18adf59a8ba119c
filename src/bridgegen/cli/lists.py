"""The commands that list scenarios, algorithms, drivers, simulators and metrics."""

import json
from typing import Annotated

import typer

from bridgegen.cli import options
from bridgegen.cli.app import listing
from bridgegen.cli.completion import completing


@listing.command("scenarios")
def list_scenarios(as_json: options.Json = False) -> None:
    """Logical scenarios of the catalogue."""
    from bridgegen.cli.terminal.tables import print_table
    from bridgegen.scenario.language.reader import load, names

    rows = [(name, load(name).title) for name in names()]
    print_table(("scenario", "title"), rows, as_json=as_json)


@listing.command("packs")
def list_packs(as_json: options.Json = False) -> None:
    """Logical scenarios of the packs, by regulation."""
    from bridgegen.cli.terminal.tables import print_table
    from bridgegen.scenario.language.reader import load, pack_names

    rows = [(name, load(name).title) for name in pack_names()]
    print_table(("scenario", "title"), rows, as_json=as_json)


@listing.command("algorithms")
def list_algorithms(as_json: options.Json = False) -> None:
    """Search algorithms."""
    from bridgegen.cli.terminal.tables import print_table
    from bridgegen.search import algorithms as toolkit

    rows = []
    for kind in (toolkit.get(name) for name in toolkit.names()):
        settings = ", ".join(f"{name}={json.dumps(s.default)}" for name, s in kind.settings.items())
        rows.append((kind.name, kind.description, settings, kind.source))
    print_table(("algorithm", "description", "settings", "source"), rows, as_json=as_json)


@listing.command("drivers")
def list_drivers(as_json: options.Json = False) -> None:
    """Drivers of the ego, planners among them; of others.

    Of planners that others wrote: whether they are installed, or how to get them.
    """
    from bridgegen.cli.terminal.tables import print_entries
    from bridgegen.drivers.drivers import HEAD, listed

    print_entries(HEAD, listed(), as_json=as_json)


@listing.command("simulators")
def list_simulators(as_json: options.Json = False) -> None:
    """Simulators that can run the scenarios."""
    from bridgegen.cli.terminal.tables import print_table
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
    print_table(("simulator", "description", "options", "settings"), rows, as_json=as_json)


@listing.command("metrics")
def list_metrics(as_json: options.Json = False) -> None:
    """Criticality metrics."""
    from bridgegen.assess.conflict.quantities import MEASURED, QUANTITIES
    from bridgegen.assess.metrics import TABLE_I
    from bridgegen.cli.terminal.tables import print_table

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
    head = ("metric", "unit", "more critical if", "description", "needs", "recorded")
    print_table(head, rows, as_json=as_json)


@listing.command("sight")
def list_sight(as_json: options.Json = False) -> None:
    """Distances at which the reference driver detects.

    A car and a pedestrian, in each weather [m].
    """
    from bridgegen.cli.terminal.tables import print_table
    from bridgegen.drivers.sight import HEAD, table

    print_table(HEAD, list(table()), as_json=as_json)


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
