"""The command that compares algorithms."""

from pathlib import Path
from typing import Annotated

import typer

from bridgegen.cli import options
from bridgegen.cli.app import app
from bridgegen.ego import split


@app.command()
def compare(
    scenarios: Annotated[
        list[str],
        typer.Argument(help="Catalogue names, or paths of YAML or OpenSCENARIO files."),
    ],
    algorithms: Annotated[
        str, typer.Option(help="See 'bridgegen list algorithms'; separated by commas.")
    ] = "random,pso",
    seeds: Annotated[int, typer.Option(help="Runs of each, with the seeds 0, 1, 2 …")] = 10,
    budget: Annotated[int, typer.Option(help="Evaluations of each run, exactly.")] = 1000,
    baseline: Annotated[
        str | None,
        typer.Option(help="What the others are tested against.", show_default="the first"),
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", help="ALGORITHM.NAME=VALUE; may be repeated."),
    ] = None,
    distinct: Annotated[
        float,
        typer.Option(
            help="Critical scenarios are different if their searched parameters differ by this "
            "share of their ranges, in root mean square."
        ),
    ] = 0.1,
    workers: options.RunWorkers = None,
    distribution: options.Distribution = None,
    ego: options.Ego = None,
    ideal: options.Ideal = None,
    time_limit: options.TimeLimit = None,
    axes: options.Axes = None,
    fix: options.Fix = None,
    objective: options.Objective = None,
    weights: options.Weights = None,
    scale: options.Scale = None,
    objectives: options.Objectives = None,
    count: options.Count = None,
    metrics: options.Metrics = None,
    causes: options.Causes = False,
    cause: options.Cause = None,
    adversary: options.Adversary = None,
    others: options.Others = None,
    road_map: options.RoadMap = None,
    junction: options.Junction = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="The comparison's folder; one that was stopped goes on.",
            show_default="comparisons/SCENARIOS",
        ),
    ] = None,
) -> None:
    """Compare algorithms over several seeds: table, tests, figures and a page."""
    from bridgegen import comparison
    from bridgegen.screen.comparison import ComparisonScreen, print_comparison

    with ComparisonScreen() as screen:
        result = comparison.compare(
            scenarios,
            algorithms=options.read_names(algorithms),
            settings=options.read_algorithm_settings(settings),
            seeds=seeds,
            budget=budget,
            baseline=baseline,
            apart=distinct,
            workers=workers,
            out=out,
            distribution=distribution,
            ego=ego,
            ideal=split(ideal or ""),
            time_limit=time_limit,
            axes=axes.split(",") if axes else None,
            fixed=options.read_fixed(fix),
            road_map=road_map,
            junction=junction,
            objective=options.read_terms(objective),
            weights=weights,
            scale=scale,
            objectives=objectives,
            count=count,
            metrics=options.read_names(metrics),
            causes=causes,
            cause=cause,
            adversary=adversary,
            others=others,
            watch=screen.watch,
        )
    print_comparison(result, screen.seconds)
