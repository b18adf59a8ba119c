"""The command that shows what happens in a run in the browser."""

from pathlib import Path
from typing import Annotated

import typer

from bridgegen.base.errors import InputError
from bridgegen.cli import options
from bridgegen.cli.app import app
from bridgegen.cli.connection import (
    NO_CONNECTION,
    Connection,
    read_access,
    with_connection_options,
    with_map_folder,
)


@app.command("open")
@with_map_folder()
@with_connection_options
def view(
    run: Annotated[
        Path,
        typer.Argument(
            metavar="FOLDER", help="The folder of a run, which may still grow; or of many runs."
        ),
    ],
    port: Annotated[
        int, typer.Option(help="TCP port of the local server.", show_default="any free one")
    ] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page in your browser.")] = True,
    evaluation: Annotated[
        int | None, typer.Option(help="Show this evaluation's scenario, counted from 1.")
    ] = None,
    ego: options.OwnEgo = None,
    connection: Connection = NO_CONNECTION,
) -> None:
    """Serve a run's report in the browser, or a list of runs.

    A report updates while the search runs, and plays any scenario of the run. Of a folder that
    holds runs, the page lists them, leads to their reports and shows two side by side.
    """
    from bridgegen.cli.terminal.view import serve
    from bridgegen.jobs.view.folder_view import FolderView
    from bridgegen.jobs.view.overview import is_run
    from bridgegen.jobs.view.run_view import RunView
    from bridgegen.jobs.view.server import Server

    access = read_access(connection)
    if run.is_dir() and not is_run(run):
        if (evaluation, ego, access) != (None, None, None):
            raise InputError(
                f"{run}: holds no run itself: --evaluation, --ego and --simulator are for one run"
            )
        serve(Server(FolderView(run), port), browser=browser)
        return
    site = RunView(run, ego=ego, simulator=access)
    fragment = "" if evaluation is None else site.fragment(evaluation)
    serve(Server(site, port), browser=browser, fragment=fragment)
