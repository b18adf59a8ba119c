"""The command that makes a preventability map."""

from pathlib import Path
from typing import Annotated

import typer

from bridgegen.cli import options as common
from bridgegen.cli.app import FAILED, app
from bridgegen.cli.completion import completing
from bridgegen.cli.groups import SEARCH
from bridgegen.engine.options.forms import read_fixed, read_names
from bridgegen.engine.options.option import DRIVER, OUTPUT, WHAT


@app.command(rich_help_panel=SEARCH)
def preventability(
    scenario: Annotated[
        str,
        typer.Argument(
            help="A name of the catalogue or of a pack, r157/cut-in say, or the path of a file.",
            autocompletion=completing("scenario"),
        ),
    ],
    *,
    ego: Annotated[
        list[str],
        typer.Option(
            help="Driver under test; may be repeated, or several separated by commas: these are "
            "compared.",
            rich_help_panel=DRIVER,
            autocompletion=completing("driver"),
        ),
    ],
    grid: Annotated[
        list[str] | None,
        typer.Option(
            help="An axis: NAME=LOW:HIGH:N; may be repeated. The first is the pictures' X axis, "
            "the second Y; pictures differ in the others.",
            show_default="that of the regulation's scenario",
            rich_help_panel=WHAT,
        ),
    ] = None,
    models: Annotated[
        str,
        typer.Option(
            help="A collision is preventable if one of these drivers avoids it.",
            rich_help_panel=DRIVER,
            autocompletion=completing("driver"),
        ),
    ] = "un-r157,fsm",
    fix: Annotated[
        list[str] | None,
        typer.Option(
            help="Hold another parameter at a value: NAME=VALUE; may be repeated.",
            rich_help_panel=WHAT,
        ),
    ] = None,
    vehicle: common.Vehicle = None,
    others: common.Others = None,
    workers: common.Workers = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="The map's folder; a stopped map is resumed.",
            show_default="preventability/SCENARIO",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    fail_if: Annotated[
        list[str] | None,
        typer.Option(
            help="End with exit status 3 if this holds for a driver, e.g. 'preventable > 0'; may "
            "be repeated.",
            show_default=False,
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    junit: common.Junit = None,
    as_json: common.Json = False,
) -> None:
    """Map which scenarios of a grid a driver avoids.

    And which of its collisions the driver models of UN R157 avoid. Writes arrays and a page.
    """
    from bridgegen.cli.terminal.risk import MapScreen, print_map
    from bridgegen.cli.terminal.tables import print_outcomes
    from bridgegen.cli.verdict.of_map import MapCriteria
    from bridgegen.jobs.preventability import map_preventability

    judges = MapCriteria.read(fail_if or (), junit)
    with MapScreen() as screen:
        result = map_preventability(
            scenario,
            read_names(",".join(ego)),
            grid=grid,
            models=read_names(models),
            fixed=read_fixed(fix, "--fix"),
            vehicle=vehicle,
            others=others,
            workers=workers,
            out=out,
            callbacks=screen.callbacks,
        )
    print_map(result, screen.seconds, as_json=as_json)
    if not print_outcomes(judges.judge(result)):
        raise typer.Exit(FAILED)
