"""The command that compares drivers by what a search finds of each."""

from pathlib import Path
from typing import Annotated

import typer

from bridgegen.cli.app import benchmarks
from bridgegen.cli.completion import completing
from bridgegen.engine.options.option import DRIVER, OUTPUT, SEARCH, WHAT


@benchmarks.command("planners")
def planners(
    ego: Annotated[
        list[str] | None,
        typer.Option(
            help="Driver to test, see 'bridgegen list drivers'; or your own. May be repeated.",
            show_default="all planners that are installed, and ours",
            rich_help_panel=DRIVER,
            autocompletion=completing("driver"),
        ),
    ] = None,
    scenario: Annotated[
        list[str] | None,
        typer.Option(
            help="A name of the catalogue or a file; may be repeated.",
            show_default="the catalogue",
            rich_help_panel=WHAT,
            autocompletion=completing("scenario"),
        ),
    ] = None,
    budget: Annotated[
        int | None,
        typer.Option(help="Evaluations of each run.", show_default="1000", rich_help_panel=SEARCH),
    ] = None,
    seeds: Annotated[
        int | None,
        typer.Option(
            help="Runs of each driver in each scenario.", show_default="3", rich_help_panel=SEARCH
        ),
    ] = None,
    algorithm: Annotated[
        str,
        typer.Option(
            help="Search algorithm, see 'bridgegen list algorithms'.",
            rich_help_panel=SEARCH,
            autocompletion=completing("algorithm"),
        ),
    ] = "pso",
    quick: Annotated[
        bool,
        typer.Option(
            "--quick",
            help="Four scenarios, 40 evaluations, one seed, no triage: minutes.",
            rich_help_panel=SEARCH,
        ),
    ] = False,
    keep: Annotated[
        int | None,
        typer.Option(
            help="Scenarios that each run exports.", show_default="3", rich_help_panel=OUTPUT
        ),
    ] = None,
    triage: Annotated[
        str | None,
        typer.Option(
            help="How much of the findings is simulated again: full, short or none.",
            show_default="short",
            rich_help_panel=OUTPUT,
            autocompletion=completing("triage"),
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            help="Runs at a time, each in a process. No result depends on it.",
            show_default="one on each core",
            rich_help_panel=SEARCH,
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder; a stopped benchmark is resumed.",
            show_default="benchmarks/planners",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
) -> None:
    """Compare planners by the failures that a search finds.

    Each driver drives each scenario within its domain, with perfect perception and with perception.
    Writes tables, a page, and scripts that reproduce the failures.
    """
    from bridgegen.cli.terminal.benchmark import BenchmarkScreen, print_benchmark
    from bridgegen.jobs.benchmark import benchmark_planners

    with BenchmarkScreen() as screen:
        result = benchmark_planners(
            ego,
            scenarios=scenario,
            budget=budget,
            seeds=seeds,
            algorithm=algorithm,
            keep=keep,
            triage=triage,
            quick=quick,
            workers=workers,
            out=out,
            callbacks=screen.callbacks,
        )
    print_benchmark(result, screen.seconds)
