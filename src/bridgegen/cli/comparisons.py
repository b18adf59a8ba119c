"""The command that compares algorithms."""

from pathlib import Path
from typing import Annotated

import typer

from bridgegen.cli import options as common
from bridgegen.cli.app import app
from bridgegen.cli.completion import completing
from bridgegen.cli.connection import with_map_folder
from bridgegen.cli.declared import with_declared_options
from bridgegen.cli.groups import SEARCH
from bridgegen.engine.options import CommonOptions
from bridgegen.engine.options.forms import read_names
from bridgegen.engine.options.option import OUTPUT, WHAT
from bridgegen.engine.options.option import SEARCH as HOW


@app.command(rich_help_panel=SEARCH)
@with_map_folder(WHAT)
@with_declared_options
def compare(
    scenarios: Annotated[
        list[str],
        typer.Argument(
            help="Catalogue names, or paths of YAML or OpenSCENARIO files.",
            autocompletion=completing("scenario"),
        ),
    ],
    *,
    algorithms: Annotated[
        str,
        typer.Option(
            help="See 'bridgegen list algorithms'; or your own: module:Class, file.py:Class. "
            "Separated by commas.",
            rich_help_panel=HOW,
            autocompletion=completing("algorithm"),
        ),
    ] = "random,pso",
    seeds: Annotated[
        int, typer.Option(help="Runs of each, with the seeds 0, 1, 2 …", rich_help_panel=HOW)
    ] = 10,
    budget: Annotated[
        int, typer.Option(help="Evaluations of each run, exactly.", rich_help_panel=HOW)
    ] = 1000,
    baseline: Annotated[
        str | None,
        typer.Option(
            help="Baseline of the tests.",
            show_default="the first algorithm",
            rich_help_panel=OUTPUT,
            autocompletion=completing("algorithm"),
        ),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="ALGORITHM.NAME=VALUE, of your own CLASS.NAME=VALUE; may be repeated.",
            rich_help_panel=HOW,
        ),
    ] = None,
    distinct: Annotated[
        float,
        typer.Option(
            help="Critical scenarios are different if their searched parameters differ by this "
            "share of their ranges, in root mean square.",
            rich_help_panel=OUTPUT,
        ),
    ] = 0.1,
    options: CommonOptions,
    workers: common.RunWorkers = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="The comparison's folder; a stopped comparison is resumed.",
            show_default="comparisons/SCENARIOS",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
) -> None:
    """Compare algorithms over several seeds.

    Writes a table, tests, figures and a page.
    """
    from bridgegen.cli.terminal.comparison import ComparisonScreen, print_comparison
    from bridgegen.jobs import compare as comparison

    with ComparisonScreen() as screen:
        result = comparison.compare(
            scenarios,
            algorithms=read_names(algorithms),
            settings=common.read_algorithm_settings(settings),
            seeds=seeds,
            budget=budget,
            baseline=baseline,
            apart=distinct,
            workers=workers,
            out=out,
            **vars(options),
            callbacks=screen.callbacks,
        )
    print_comparison(result, screen.seconds)
