"""The command that validates findings in another simulator."""

from pathlib import Path
from typing import Annotated

import typer

from bridgegen.cli import options
from bridgegen.cli.app import FAILED, app
from bridgegen.cli.completion import completing
from bridgegen.cli.connection import (
    NO_CONNECTION,
    Connection,
    with_connection_options,
    with_map_folder,
)
from bridgegen.engine.options.option import SIMULATOR


@app.command()
@with_map_folder()
@with_connection_options
def confirm(
    run: Annotated[Path, typer.Argument(help="The folder of a run, finished or not.")],
    simulator: Annotated[
        str,
        typer.Option(
            help="The other simulator: see 'bridgegen list simulators'.",
            rich_help_panel=SIMULATOR,
            autocompletion=completing("simulator"),
        ),
    ],
    simulator_set: options.SimulatorSettings = None,
    connection: Connection = NO_CONNECTION,
    rows: Annotated[
        int | None,
        typer.Option(
            help="Number of the run's critical scenarios, the most critical ones.",
            show_default="the exported ones",
        ),
    ] = None,
    again: Annotated[bool, typer.Option("--again", help="Discard earlier confirmations.")] = False,
    ego: options.OwnEgo = None,
    workers: options.Workers = None,
    fail_if: options.ConfirmFailIf = None,
    junit: options.Junit = None,
    as_json: options.Json = False,
) -> None:
    """Simulate a run's scenarios in another simulator.

    Are its critical scenarios critical there, too?
    """
    from bridgegen.cli.terminal.confirmation import ConfirmationProgress, print_confirmation
    from bridgegen.cli.terminal.tables import print_outcomes
    from bridgegen.cli.verdict.of_confirmation import ConfirmationCriteria
    from bridgegen.jobs.search.confirm import confirm as confirm_run

    criteria = ConfirmationCriteria.read(fail_if or (), junit)
    choice = options.read_simulator(simulator, simulator_set, connection)
    assert choice is not None
    with ConfirmationProgress() as live:
        found = confirm_run(
            run,
            choice,
            rows=rows,
            again=again,
            ego=ego,
            workers=workers,
            stage=live.stage,
            progress=live.progress,
        )
    print_confirmation(found, as_json=as_json)
    if not print_outcomes(criteria.judge(found)):
        raise typer.Exit(FAILED)
