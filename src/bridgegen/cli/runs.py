"""The commands that make and look at runs."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bridgegen.cli import options
from bridgegen.cli.app import FAILED, app
from bridgegen.cli.where import NOWHERE, Where, located, read_access
from bridgegen.ego import split

if TYPE_CHECKING:
    from bridgegen.verdict.criteria import Outcome


@app.command()
@located
def search(
    scenario: Annotated[
        str,
        typer.Argument(help="A catalogue name, or the path of a YAML or an OpenSCENARIO file."),
    ],
    distribution: options.Distribution = None,
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
    causes: options.Causes = True,
    cause: options.Cause = None,
    adversary: options.Adversary = None,
    others: options.Others = None,
    simulator: options.Simulator = None,
    simulator_set: options.SimulatorSettings = None,
    where: Where = NOWHERE,
    road_map: options.RoadMap = None,
    junction: options.Junction = None,
    keep: Annotated[int, typer.Option(help="How many critical scenarios to hand over.")] = 10,
    workers: options.Workers = None,
    out: Annotated[Path | None, typer.Option(help="The run's folder, new.")] = None,
    fail_if: options.FailIf = None,
    junit: options.Junit = None,
) -> None:
    """Search a logical scenario for its critical concrete ones."""
    from bridgegen import campaign
    from bridgegen.screen.search import SearchScreen, print_summary
    from bridgegen.verdict.of_run import Gate

    gate = Gate.read(fail_if or (), junit, causes=causes)
    with SearchScreen(budget) as screen:
        run = campaign.run_search(
            scenario,
            distribution=distribution,
            algorithm=algorithm,
            settings=options.read_settings(settings),
            budget=budget,
            seed=seed,
            ego=ego,
            ideal=split(ideal or ""),
            time_limit=time_limit,
            axes=axes.split(",") if axes else None,
            fixed=options.read_fixed(fix),
            road_map=road_map,
            junction=junction,
            keep=keep,
            out=out,
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
            simulator=options.read_simulator(simulator, simulator_set, where),
            workers=workers,
            watch=screen.watch,
        )
    print_summary(run, screen.seconds)
    _end(gate.judge(run))


@app.command()
def new(
    name: Annotated[
        str,
        typer.Argument(help="Of your scenario; NAME.yaml is written, and a schema for editors."),
    ],
    like: Annotated[
        str | None, typer.Option(help="Start from a copy of this one of the catalogue.")
    ] = None,
) -> None:
    """Write a commented scenario file to start from."""
    from bridgegen.odd.starter import start_scenario

    path = start_scenario(name, like=like)
    print(f"{path}: check it with 'bridgegen validate {path}', then 'bridgegen search {path}'")


@app.command()
@located
def resume(
    folder: Annotated[Path, typer.Argument(help="The folder of a run.")],
    ego: options.OwnEgo = None,
    where: Where = NOWHERE,
    workers: options.Workers = None,
    fail_if: options.FailIf = None,
    junit: options.Junit = None,
) -> None:
    """Go on with a run that was interrupted; the result is as if it had not been."""
    from bridgegen import campaign
    from bridgegen.screen.search import SearchScreen, print_summary
    from bridgegen.verdict.of_run import Gate

    gate = Gate.of_run(fail_if or (), junit, folder)
    with SearchScreen() as screen:
        run = campaign.resume(
            folder,
            ego=ego,
            simulator=read_access(where),
            workers=workers,
            watch=screen.watch,
        )
    print_summary(run, screen.seconds)
    _end(gate.judge(run))


@app.command()
@located
def view(
    run: Annotated[Path, typer.Argument(help="The folder of a run, which may still grow.")],
    port: Annotated[int, typer.Option(help="On 127.0.0.1.", show_default="one that is free")] = 0,
    browser: Annotated[bool, typer.Option(help="Open the page in your browser.")] = True,
    evaluation: Annotated[
        int | None, typer.Option(help="Show this evaluation's scenario, counted from 1.")
    ] = None,
    ego: options.OwnEgo = None,
    where: Where = NOWHERE,
) -> None:
    """Serve a run's report on this machine, live while the search goes on; any scenario plays."""
    from bridgegen.screen.view import serve
    from bridgegen.view.run_view import RunView
    from bridgegen.view.server import Server

    site = RunView(
        run,
        ego=ego,
        simulator=read_access(where),
    )
    fragment = "" if evaluation is None else site.fragment(evaluation)
    serve(Server(site, port), browser=browser, fragment=fragment)


@app.command()
def coverage(
    run: Annotated[Path, typer.Argument(help="The folder of a run.")],
    bins: Annotated[
        int, typer.Option(help="Equal bins per parameter; whole numbers have one each.")
    ] = 5,
    strength: Annotated[
        int, typer.Option(help="Count combinations of up to so many parameters' bins: 1, 2, 3.")
    ] = 3,
    as_json: options.Json = False,
) -> None:
    """Show which bins, and combinations of bins, a run evaluated and where it was critical."""
    from bridgegen.campaign.coverage import coverage_of
    from bridgegen.screen.coverage import print_coverage

    settings, found = coverage_of(run, bins=bins, strength=strength)
    print_coverage(run, settings, found, as_json=as_json)


@app.command()
@located
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
    ego: options.OwnEgo = None,
    where: Where = NOWHERE,
    workers: options.Workers = None,
    as_json: options.Json = False,
) -> None:
    """Find where scenarios are critical: readable rules, each verified by fresh scenarios."""
    from bridgegen.campaign.regions import regions_of
    from bridgegen.screen.regions import RegionsScreen, print_regions

    with RegionsScreen() as screen:
        found = regions_of(
            run,
            ego=ego,
            simulator=read_access(where),
            samples=samples,
            at_least=at_least,
            seed=seed,
            workers=workers,
            stage=screen.stage,
            progress=screen.progress,
        )
    print_regions(found, as_json=as_json)


@app.command()
@located
def simulate(
    file: Annotated[Path, typer.Argument(help="An OpenSCENARIO file (.xosc).")],
    ego: Annotated[
        str | None, typer.Option(help="Who drives; what the file says by default.")
    ] = None,
    ideal: options.Ideal = None,
    others: options.Others = None,
    time_limit: options.TimeLimit = None,
    dt: Annotated[
        float | None,
        typer.Option(help="Time step [s].", show_default="what the file's header says, or 0.05"),
    ] = None,
    trace: Annotated[
        Path | None,
        typer.Option(help="A new .csv of every entity's time, x, y, h and speed."),
    ] = None,
    metrics: options.OnlyMetrics = None,
    simulator: options.Simulator = None,
    simulator_set: options.SimulatorSettings = None,
    where: Where = NOWHERE,
    lenient: Annotated[
        bool, typer.Option("--lenient", help="Leave out what is not supported, with a warning.")
    ] = False,
    fail_if: options.FileFailIf = None,
    junit: options.Junit = None,
    as_json: options.Json = False,
) -> None:
    """Run one scenario file and print its conflict and its metrics."""
    from bridgegen.screen.files import conflict_facts, print_file_result
    from bridgegen.simulate import simulate_file
    from bridgegen.simulation.choice import EMBEDDED
    from bridgegen.simulation.trace import write_trace
    from bridgegen.verdict.of_file import FileGate

    gate = FileGate.read(fail_if or (), junit)
    stages = None if ideal is None else split(ideal)
    skipped: list[str] | None = [] if lenient else None
    result = simulate_file(
        file,
        ego=ego,
        ideal=stages,
        others=others,
        time_limit=time_limit,
        metrics=options.read_names(metrics),
        also=gate.metrics,
        time_step=dt,
        skipped=skipped,
        simulator=options.read_simulator(simulator, simulator_set, where) or EMBEDDED,
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
        facts |= conflict_facts(result.conflicts)
        if result.incidents:
            step = result.rollout.time_step
            facts["incidents"] = [
                {"time": one.step * step, "kind": one.kind, "what": one.what}
                for one in result.incidents
            ]
        print(json.dumps(facts, indent=2))
    else:
        print_file_result(file, result)
    _end(gate.judge(file, result))


@app.command("check-driver")
def check_driver(
    driver: Annotated[
        str, typer.Argument(help="module:Class, file.py:Class, file.py:function, file.fmu.")
    ],
    scenario: Annotated[
        list[str] | None,
        typer.Option(help="Try it in this one; may be repeated.", show_default="four that ship"),
    ] = None,
    time_limit: options.TimeLimit = None,
    as_json: options.Json = False,
) -> None:
    """Try a driver of your own: does a scenario's result depend on that scenario alone?"""
    from bridgegen.campaign.driver_contract import SCENARIOS, check_driver
    from bridgegen.screen.files import print_checks

    checks = check_driver(driver, scenario or SCENARIOS, time_limit=time_limit)
    if not print_checks(checks, as_json=as_json):
        raise typer.Exit(1)


def _end(outcomes: "Sequence[Outcome]") -> None:
    """Print what the criteria came to; end with the exit status for it if one failed."""
    from bridgegen.screen.verdict import print_outcomes

    if not print_outcomes(outcomes):
        raise typer.Exit(FAILED)
