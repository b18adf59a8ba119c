"""The commands that make and look at runs."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from bridgegen.cli.app import Json, app
from bridgegen.ego import split
from bridgegen.errors import InputError

TimeLimit = Annotated[
    float | None,
    typer.Option(
        help="Seconds that a call of a driver of your own may take; of a compiled one, a scenario.",
        show_default="10",
    ),
]
Ideal = Annotated[
    str | None,
    typer.Option(
        help="Stages of the driver that work without fault: perception, prediction, control, "
        "separated by commas.",
        show_default="none of them",
    ),
]


@app.command()
def search(
    scenario: Annotated[
        str,
        typer.Argument(help="A catalogue name, or the path of a YAML or an OpenSCENARIO file."),
    ],
    distribution: Annotated[
        Path | None,
        typer.Option(
            help="How the parameters of an OpenSCENARIO file are distributed: a file with a "
            "ParameterValueDistribution."
        ),
    ] = None,
    algorithm: Annotated[str, typer.Option(help="See 'bridgegen list algorithms'.")] = "pso",
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", help="A setting of the algorithm, NAME=VALUE; may be repeated."),
    ] = None,
    budget: Annotated[
        int | None,
        typer.Option(
            help="Evaluations, exactly.", show_default="1000, or a distribution's test runs"
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(
            help="The same seed gives the same result.", show_default="0, or a distribution's"
        ),
    ] = None,
    ego: Annotated[
        str | None,
        typer.Option(
            help="Who drives: see 'bridgegen list drivers'; or your own: module:Class, "
            "file.py:Class (or a compiled driver's function), file.fmu.",
            show_default="the scenario's choice",
        ),
    ] = None,
    ideal: Ideal = None,
    time_limit: TimeLimit = None,
    axes: Annotated[
        str | None,
        typer.Option(help="What to search, e.g. static,participants,weather."),
    ] = None,
    fix: Annotated[
        list[str] | None,
        typer.Option(help="Hold a parameter, e.g. --fix fog_density=80; may be repeated."),
    ] = None,
    objective: Annotated[
        str | None,
        typer.Option(
            help="Metrics and weights, e.g. d_min=0.8,v_d=0.2, or d_min,ttc with --weights entropy."
        ),
    ] = None,
    weights: Annotated[
        str | None, typer.Option(help="fixed, or entropy (from a random sample).")
    ] = None,
    scale: Annotated[str | None, typer.Option(help="raw, or standardised (by a sample).")] = None,
    objectives: Annotated[
        str | None,
        typer.Option(
            help="one: the metrics' weighted sum; many: each metric by itself.",
            show_default="what the algorithm is made for",
        ),
    ] = None,
    metrics: Annotated[
        str | None,
        typer.Option(help="Record these as well, e.g. pet,drac; see 'bridgegen list metrics'."),
    ] = None,
    causes: Annotated[
        bool, typer.Option(help="Find the cause of each critical scenario, by replaying it.")
    ] = True,
    cause: Annotated[
        str | None,
        typer.Option(
            help="Count only this cause's: perception, planning, control or unavoidable.",
            show_default="any",
        ),
    ] = None,
    adversary: Annotated[
        str | None,
        typer.Option(
            help="A vehicle that an adversary drives instead of the scenario's events.",
            show_default="none; with ppo-adversary the first",
        ),
    ] = None,
    road_map: Annotated[
        Path | None, typer.Option("--map", help="A map (.xodr, or its import) to search on.")
    ] = None,
    junction: Annotated[str | None, typer.Option(help="Which junction of the map.")] = None,
    keep: Annotated[int, typer.Option(help="How many critical scenarios to hand over.")] = 10,
    out: Annotated[Path | None, typer.Option(help="The run's folder, new.")] = None,
) -> None:
    """Search a logical scenario for its critical concrete ones."""
    from bridgegen import campaign
    from bridgegen.screen import Screen, print_summary

    fixed = _numbers(fix or [])
    terms = _terms(objective) if objective else None
    with Screen(budget) as screen:
        run = campaign.run_search(
            scenario,
            distribution=distribution,
            algorithm=algorithm,
            settings=_settings(settings or []),
            budget=budget,
            seed=seed,
            ego=ego,
            ideal=split(ideal or ""),
            time_limit=time_limit,
            axes=axes.split(",") if axes else None,
            fixed=fixed,
            road_map=road_map,
            junction=junction,
            keep=keep,
            out=out,
            objective=terms,
            weights=weights,
            scale=scale,
            objectives=objectives,
            metrics=_names(metrics),
            causes=causes,
            cause=cause,
            adversary=adversary,
            watch=screen.watch,
        )
    print_summary(run, screen.seconds)


@app.command()
def new(
    name: Annotated[str, typer.Argument(help="Of your scenario; NAME.yaml is written.")],
    like: Annotated[
        str | None, typer.Option(help="Start from a copy of this one of the catalogue.")
    ] = None,
) -> None:
    """Write a commented scenario file to start from."""
    from bridgegen.odd.starter import start_scenario

    path = start_scenario(name, like=like)
    print(f"{path}: check it with 'bridgegen validate {path}', then 'bridgegen search {path}'")


@app.command()
def resume(
    folder: Annotated[Path, typer.Argument(help="The folder of a run.")],
    ego: Annotated[
        str | None, typer.Option(help="The run's driver, where it is one of your own.")
    ] = None,
) -> None:
    """Go on with a run that was interrupted; the result is as if it had not been."""
    from bridgegen import campaign
    from bridgegen.screen import Screen, print_summary

    with Screen() as screen:
        run = campaign.resume(folder, ego=ego, watch=screen.watch)
    print_summary(run, screen.seconds)


@app.command()
def coverage(
    run: Annotated[Path, typer.Argument(help="The folder of a run.")],
    bins: Annotated[
        int, typer.Option(help="Equal bins per parameter; whole numbers have one each.")
    ] = 5,
    strength: Annotated[
        int, typer.Option(help="Count combinations of up to so many parameters' bins: 1, 2, 3.")
    ] = 3,
    as_json: Json = False,
) -> None:
    """Show which bins, and combinations of bins, a run evaluated and where it was critical."""
    from bridgegen.campaign.coverage import coverage_of
    from bridgegen.screen import print_coverage

    settings, found = coverage_of(run, bins=bins, strength=strength)
    print_coverage(run, settings, found, as_json=as_json)


@app.command()
def regions(
    run: Annotated[Path, typer.Argument(help="The folder of a run, finished or not.")],
    samples: Annotated[
        int, typer.Option(help="Fresh random scenarios to simulate in each region.")
    ] = 300,
    at_least: Annotated[
        float,
        typer.Option(
            help="The share of critical scenarios that makes a region critical; the fresh ones "
            "must show it with 95 % confidence."
        ),
    ] = 0.5,
    seed: Annotated[
        int | None,
        typer.Option(help="Of the fresh scenarios.", show_default="the run's"),
    ] = None,
    ego: Annotated[
        str | None, typer.Option(help="The run's driver, where it is one of your own.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Find where scenarios are critical: readable rules, each verified by fresh scenarios."""
    from bridgegen.campaign.regions import regions_of
    from bridgegen.screen import Bar, print_regions

    with Bar("simulating") as bar:
        found = regions_of(
            run,
            ego=ego,
            samples=samples,
            at_least=at_least,
            seed=seed,
            stage=bar.stage,
            progress=bar.progress,
        )
    print_regions(found, as_json=as_json)


@app.command()
def simulate(
    file: Annotated[Path, typer.Argument(help="An OpenSCENARIO file (.xosc).")],
    ego: Annotated[
        str | None, typer.Option(help="Who drives; what the file says by default.")
    ] = None,
    ideal: Ideal = None,
    time_limit: TimeLimit = None,
    dt: Annotated[
        float | None,
        typer.Option(help="Time step [s].", show_default="what the file's header says, or 0.05"),
    ] = None,
    trace: Annotated[
        Path | None,
        typer.Option(help="A new .csv of every entity's time, x, y, h and speed."),
    ] = None,
    metrics: Annotated[
        str | None, typer.Option(help="Only these, e.g. pet,drac.", show_default="all there are")
    ] = None,
    lenient: Annotated[
        bool, typer.Option("--lenient", help="Leave out what is not supported, with a warning.")
    ] = False,
    as_json: Json = False,
) -> None:
    """Run one scenario file and print its metrics."""
    from bridgegen.screen import print_file_result
    from bridgegen.simulate import simulate_file
    from bridgegen.simulation.trace import write_trace

    stages = None if ideal is None else split(ideal)
    skipped: list[str] | None = [] if lenient else None
    result = simulate_file(
        file,
        ego=ego,
        ideal=stages,
        time_limit=time_limit,
        metrics=_names(metrics),
        time_step=dt,
        skipped=skipped,
    )
    for one in skipped or ():
        print(f"bridgegen: warning: left out: {one}", file=sys.stderr)
    if trace is not None:
        write_trace(trace, result.rollout)
    if as_json:
        facts: dict[str, object] = {
            "file": str(file),
            "ego": result.driver,
            "status": result.status,
        }
        values = {k: v if abs(v) < float("inf") else None for k, v in result.metrics.items()}
        facts |= {"cause": result.cause, "parameters": result.parameters, "metrics": values}
        print(json.dumps(facts, indent=2))
    else:
        print_file_result(file, result)


@app.command("check-driver")
def check_driver(
    driver: Annotated[
        str, typer.Argument(help="module:Class, file.py:Class, file.py:function, file.fmu.")
    ],
    scenario: Annotated[
        list[str] | None,
        typer.Option(help="Try it in this one; may be repeated.", show_default="four that ship"),
    ] = None,
    time_limit: TimeLimit = None,
    as_json: Json = False,
) -> None:
    """Try a driver of your own: does a scenario's result depend on that scenario alone?"""
    from bridgegen.campaign.driver_contract import SCENARIOS, check_driver
    from bridgegen.screen import print_checks

    checks = check_driver(driver, scenario or SCENARIOS, time_limit=time_limit)
    if not print_checks(checks, as_json=as_json):
        raise typer.Exit(1)


def _terms(text: str) -> dict[str, float | None]:
    """Read ``metric=weight,…`` or ``metric,…``."""
    pairs = [pair.strip() for pair in text.split(",")]
    weighted = _numbers([pair for pair in pairs if "=" in pair], "--objective")
    return {name: weighted.get(name) for name in (pair.partition("=")[0] for pair in pairs)}


def _names(text: str | None) -> list[str]:
    """Read ``name,…``; nothing is none."""
    return [name.strip() for name in text.split(",")] if text else []


def _settings(pairs: list[str]) -> dict[str, bool | int | float | str]:
    """Read ``name=value`` pairs; a value is a number, true, false, or a text."""
    values: dict[str, bool | int | float | str] = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if not equals:
            raise InputError(f"--set must read NAME=VALUE, got '{pair}'")
        try:
            value = json.loads(text)
        except json.JSONDecodeError:
            value = text
        values[name] = value if isinstance(value, bool | int | float | str) else text
    return values


def _numbers(pairs: list[str], option: str = "--fix") -> dict[str, float]:
    """Read ``name=value`` pairs."""
    values, problems = {}, []
    for pair in pairs:
        name, equals, text = pair.partition("=")
        try:
            values[name] = float(text)
        except ValueError:
            equals = ""
        if not equals:
            problems.append(f"{option} must read NAME=NUMBER, got '{pair}'")
    if problems:
        raise InputError(*problems)
    return values
