"""The command that compares algorithms."""

from pathlib import Path
from typing import Annotated

import typer

from bridgegen.cli.app import app
from bridgegen.cli.runs import Ideal, TimeLimit, _names, _numbers, _settings, _terms
from bridgegen.ego import split
from bridgegen.errors import InputError


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
    jobs: Annotated[
        int | None, typer.Option(help="Runs at a time.", show_default="one on each core")
    ] = None,
    distribution: Annotated[
        Path | None,
        typer.Option(help="How the parameters of an OpenSCENARIO file are distributed."),
    ] = None,
    ego: Annotated[
        str | None,
        typer.Option(help="Who drives, as for 'search'.", show_default="the scenario's choice"),
    ] = None,
    ideal: Ideal = None,
    time_limit: TimeLimit = None,
    axes: Annotated[
        str | None, typer.Option(help="What to search, e.g. static,participants,weather.")
    ] = None,
    fix: Annotated[
        list[str] | None, typer.Option(help="NAME=NUMBER; not searched; may be repeated.")
    ] = None,
    objective: Annotated[
        str | None, typer.Option(help="Metrics, with weights or without, as for 'search'.")
    ] = None,
    weights: Annotated[str | None, typer.Option(help="fixed, or entropy.")] = None,
    scale: Annotated[str | None, typer.Option(help="raw, or standardised.")] = None,
    objectives: Annotated[
        str | None,
        typer.Option(help="one, or many.", show_default="what each algorithm is made for"),
    ] = None,
    metrics: Annotated[str | None, typer.Option(help="Record these as well.")] = None,
    causes: Annotated[
        bool, typer.Option(help="Find the cause of each critical scenario; takes longer.")
    ] = False,
    cause: Annotated[
        str | None, typer.Option(help="Count only this cause's.", show_default="any")
    ] = None,
    adversary: Annotated[
        str | None,
        typer.Option(
            help="A vehicle that an adversary drives, as for 'search', with every algorithm.",
            show_default="none; with an algorithm that is one the first",
        ),
    ] = None,
    road_map: Annotated[
        Path | None, typer.Option("--map", help="A map (.xodr, or its import) to search on.")
    ] = None,
    junction: Annotated[str | None, typer.Option(help="Which junction of the map.")] = None,
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
    from bridgegen.cli.comparison_screen import ComparisonScreen, print_comparison

    with ComparisonScreen() as screen:
        result = comparison.compare(
            scenarios,
            algorithms=_names(algorithms),
            settings=_by_algorithm(settings or []),
            seeds=seeds,
            budget=budget,
            baseline=baseline,
            apart=distinct,
            jobs=jobs,
            out=out,
            distribution=distribution,
            ego=ego,
            ideal=split(ideal or ""),
            time_limit=time_limit,
            axes=axes.split(",") if axes else None,
            fixed=_numbers(fix or []),
            road_map=road_map,
            junction=junction,
            objective=_terms(objective) if objective else None,
            weights=weights,
            scale=scale,
            objectives=objectives,
            metrics=_names(metrics),
            causes=causes,
            cause=cause,
            adversary=adversary,
            watch=screen.watch,
        )
    print_comparison(result, screen.seconds)


def _by_algorithm(pairs: list[str]) -> dict[str, dict[str, bool | int | float | str]]:
    """Read ``algorithm.name=value`` pairs."""
    found: dict[str, dict[str, bool | int | float | str]] = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        algorithm, dot, setting = name.partition(".")
        if not (equals and dot and algorithm and setting):
            raise InputError(f"--set must read ALGORITHM.NAME=VALUE, got '{pair}'")
        found.setdefault(algorithm, {}).update(_settings([f"{setting}={value}"]))
    return found
