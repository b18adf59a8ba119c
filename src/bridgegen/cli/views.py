"""The commands that show what happens in a run: in the browser, as a film."""

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
from bridgegen.cli.groups import RESULTS


@app.command(rich_help_panel=RESULTS)
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


@app.command(rich_help_panel=RESULTS)
@with_map_folder()
def video(
    run: Annotated[Path, typer.Argument(help="The folder of a run, or an OpenSCENARIO file.")],
    out: Annotated[
        Path | None,
        typer.Option(
            help="The file: .gif, .webp, .mp4, .webm; or .png or .svg for one picture.",
            show_default="RUN-SCENARIO.gif in this folder",
        ),
    ] = None,
    evaluation: Annotated[
        int | None,
        typer.Option(
            help="Evaluation to show, counted from 1.", show_default="the worst exported scenario"
        ),
    ] = None,
    size: Annotated[str, typer.Option(help="Width and height [pixels].")] = "960x540",
    fps: Annotated[int, typer.Option(help="Frames per second.")] = 20,
    start: Annotated[
        float | None,
        typer.Option(
            "--from",
            help="Start of the film, or instant of the picture [s].",
            show_default="8 s before the conflict",
        ),
    ] = None,
    end: Annotated[
        float | None,
        typer.Option("--to", help="End of the film [s].", show_default="2 s after the conflict"),
    ] = None,
    ego: options.OwnEgo = None,
) -> None:
    """Film a scenario as GIF, WebP, MP4 or WebM.

    The view is the report's. It frames the ego and the participant that it meets.
    """
    from bridgegen.jobs.search.video import film

    width, _, height = size.partition("x")
    if not (width.isascii() and width.isdigit() and height.isascii() and height.isdigit()):
        raise InputError(f"--size must read WIDTHxHEIGHT, e.g. 960x540, got '{size}'")
    if max(len(width), len(height)) > 6:
        raise InputError(f"--size must have at most 6 digits each, got '{size}'")
    print(
        film(
            run,
            out,
            evaluation=evaluation,
            size=(int(width), int(height)),
            fps=fps,
            start=start,
            end=end,
            ego=ego,
        )
    )
