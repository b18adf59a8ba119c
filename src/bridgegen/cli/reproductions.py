"""The command that reproduces the paper's evaluation, a package beside this one."""

from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

from bridgegen.base.errors import InputError
from bridgegen.cli import options
from bridgegen.cli.app import app
from bridgegen.engine.options.forms import read_names

PACKAGE = "bridgegen_reproduction"
"""Package of the reproductions, as a name, since nothing of this package imports it."""


@app.command(hidden=True)
def reproduce(
    quick: Annotated[
        bool, typer.Option("--quick", help="One seed of everything, in a minute or two.")
    ] = False,
    seeds: Annotated[
        int | None,
        typer.Option(
            help="Runs of each method in each scenario, with the seeds 0, 1, 2 …",
            show_default="10",
        ),
    ] = None,
    iterations: Annotated[
        int, typer.Option(help="Iterations of each run, 40 evaluations each; the paper has 25.")
    ] = 25,
    scenarios: Annotated[
        str | None,
        typer.Option(
            help="Scenarios, of crossroads-s1 to -s4; S4 must be among them.", show_default="all"
        ),
    ] = None,
    workers: options.RunWorkers = None,
    road_map: options.RoadMap = None,
    junction: options.Junction = None,
    out: Annotated[
        Path, typer.Option(help="The reproduction's folder; a stopped one is resumed.")
    ] = Path("reproduction"),
) -> None:
    """Reproduce the paper's evaluation, Section V.

    Writes its tables, figures and a page.
    """
    if quick and seeds is not None:
        raise InputError(f"--quick is one seed; leave out --seeds {seeds}, or --quick")
    terminal = import_module(f"{PACKAGE}.terminal")
    chosen = {} if scenarios is None else {"scenarios": read_names(scenarios)}
    result = terminal.reproduce_and_print(
        seeds=1 if quick else 10 if seeds is None else seeds,
        iterations=iterations,
        **chosen,
        workers=workers,
        road_map=road_map,
        junction=junction,
        out=out,
    )
    if result.gaps:
        raise typer.Exit(1)
