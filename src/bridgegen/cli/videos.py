"""The command that films a scenario."""

from pathlib import Path
from typing import Annotated

import typer

from bridgegen.cli import options
from bridgegen.cli.app import app
from bridgegen.cli.groups import RESULTS
from bridgegen.errors import InputError


@app.command(rich_help_panel=RESULTS)
def video(
    run: Annotated[Path, typer.Argument(help="The folder of a run.")],
    out: Annotated[
        Path | None,
        typer.Option(
            help="The file: .gif, .webp, or .png for one picture.",
            show_default="RUN-SCENARIO.gif in this folder",
        ),
    ] = None,
    evaluation: Annotated[
        int | None,
        typer.Option(help="Which, counted from 1.", show_default="the worst exported scenario"),
    ] = None,
    size: Annotated[str, typer.Option(help="Width and height [pixels].")] = "960x540",
    fps: Annotated[int, typer.Option(help="Frames per second.")] = 20,
    start: Annotated[
        float | None,
        typer.Option("--from", help="Start [s].", show_default="8 s before the conflict"),
    ] = None,
    end: Annotated[
        float | None, typer.Option("--to", help="End [s].", show_default="2 s after the conflict")
    ] = None,
    ego: options.OwnEgo = None,
) -> None:
    """Film a scenario of a run as GIF or WebP.

    The view is the report's. It frames the ego and the participant that it meets.
    """
    from bridgegen.campaign.video import film

    width, _, height = size.partition("x")
    if not (width.isascii() and width.isdigit() and height.isascii() and height.isdigit()):
        raise InputError(f"--size must read WIDTHxHEIGHT, e.g. 960x540, got '{size}'")
    if max(len(width), len(height)) > 6:
        raise InputError(f"--size must have at most 6 digits each, got '{size}'")
    print(film(run, out, evaluation=evaluation, size=(int(width), int(height)), fps=fps,
               start=start, end=end, ego=ego))  # fmt: skip
