"""The commands that look at results: a run in the browser, in figures, in another simulator."""

from pathlib import Path
from typing import Annotated

import typer

from bridgegen.base.errors import InputError
from bridgegen.cli import options
from bridgegen.cli.app import FAILED, analyses, app
from bridgegen.cli.completion import completing
from bridgegen.cli.connection import (
    NO_CONNECTION,
    Connection,
    read_access,
    with_connection_options,
    with_device,
    with_map_folder,
)
from bridgegen.engine.options.forms import read_names
from bridgegen.engine.options.option import SIMULATOR


@app.command("open")
@with_map_folder()
@with_connection_options
def view(
    run: Annotated[
        Path,
        typer.Argument(
            metavar="FOLDER",
            help="A project: a folder with results; or a run, which may still grow.",
        ),
    ] = Path(),
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
    """Open a project or a run in the browser.

    A project's home page has its verdict, all runs and other results, the dashboard, and searches
    as they run. The status and comment of a failure mode are set by click, and kept in
    failures.yaml. A run's report updates while the search runs, and plays any of its scenarios.
    """
    from bridgegen.cli.terminal.view import serve
    from bridgegen.jobs.dashboard.home import Home
    from bridgegen.jobs.view.overview import is_run
    from bridgegen.jobs.view.run_view import RunView
    from bridgegen.jobs.view.server import Server

    access = read_access(connection)
    if run.is_dir() and not is_run(run):
        if (evaluation, ego, access) != (None, None, None):
            raise InputError(
                f"{run}: holds no run itself: --evaluation, --ego and --simulator are for one run"
            )
        serve(Server(Home(run), port), browser=browser)
        return
    site = RunView(run, ego=ego, simulator=access)
    fragment = "" if evaluation is None else site.fragment(evaluation)
    serve(Server(site, port), browser=browser, fragment=fragment)


@analyses.command()
def coverage(
    run: Annotated[Path, typer.Argument(help="The folder of a run.")],
    bins: Annotated[
        int, typer.Option(help="Equal bins per parameter; whole numbers have one each.")
    ] = 5,
    strength: Annotated[
        int, typer.Option(help="Maximum number of parameters in a combination of bins: 1, 2, 3.")
    ] = 3,
    exposure: options.Exposure = None,
    as_json: options.Json = False,
) -> None:
    """Show which bins of the parameters a run evaluated.

    Also shows which combinations of bins, and which of them are critical; with an
    exposure, how much of what is met on the road these are.
    """
    from bridgegen.cli.terminal.search import print_coverage
    from bridgegen.jobs.search.coverage import coverage_of

    settings, found, of_odd = coverage_of(run, bins=bins, strength=strength, exposure=exposure)
    print_coverage(run, settings, found, of_odd, as_json=as_json)


@analyses.command()
@with_device
@with_connection_options
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
        typer.Option(help="Seed of the fresh scenarios.", show_default="the run's"),
    ] = None,
    exposure: options.Exposure = None,
    ego: options.OwnEgo = None,
    worse_than: options.OwnBaseline = None,
    metrics: options.OwnMetrics = None,
    connection: Connection = NO_CONNECTION,
    workers: options.Workers = None,
    as_json: options.Json = False,
) -> None:
    """Find regions in which most scenarios are critical.

    Each is a readable rule, verified by fresh scenarios; with an exposure, with the
    share of encounters that lie in it.
    """
    from bridgegen.cli.terminal.regions import RegionsProgress, print_regions
    from bridgegen.jobs.search.regions import regions_of

    with RegionsProgress() as live:
        found = regions_of(
            run,
            ego=ego,
            worse_than=worse_than,
            metrics=read_names(metrics),
            simulator=read_access(connection),
            samples=samples,
            at_least=at_least,
            seed=seed,
            exposure=exposure,
            workers=workers,
            stage=live.stage,
            progress=live.progress,
        )
    print_regions(found, as_json=as_json)


@analyses.command()
def sensitivity(
    run: Annotated[Path, typer.Argument(help="The folder of a finished run.")],
    findings: Annotated[int, typer.Option(help="Findings that are analysed, at most.")] = 20,
    trajectories: Annotated[
        int, typer.Option(help="Trajectories of Morris's design, at least 2.")
    ] = 4,
    budget: Annotated[int, typer.Option(help="Number of evaluations, at most.")] = 10_000,
    seed: Annotated[
        int | None, typer.Option(help="Seed of the trajectories.", show_default="the run's")
    ] = None,
    ego: options.OwnEgo = None,
    metrics: options.OwnMetrics = None,
    as_json: options.Json = False,
) -> None:
    """Find constants of the models that the verdicts of a run hang on.

    Reaction times, friction, sizes, thresholds: each is moved within its plausible range, alone
    and together with all others and the scenario's parameters.
    """
    from bridgegen.cli.terminal.sensitivity import SensitivityProgress, print_sensitivity
    from bridgegen.jobs.search.sensitivity import sensitivity_of

    with SensitivityProgress() as live:
        found = sensitivity_of(
            run,
            findings=findings,
            trajectories=trajectories,
            budget=budget,
            seed=seed,
            ego=ego,
            metrics=read_names(metrics),
            say=live.say,
            progress=live.progress,
        )
    print_sensitivity(run, found, as_json=as_json)


@app.command()
@with_map_folder()
@with_connection_options
def confirm(
    run: Annotated[Path, typer.Argument(help="The folder of a run, finished or not.")],
    simulator: Annotated[
        str,
        typer.Option(
            help="The other simulator: see 'bridgegen list simulators'.",
            rich_help_panel=SIMULATOR,
            autocompletion=completing("simulator"),
        ),
    ],
    simulator_set: options.SimulatorSettings = None,
    connection: Connection = NO_CONNECTION,
    rows: Annotated[
        int | None,
        typer.Option(
            help="Number of the run's critical scenarios, the most critical ones.",
            show_default="the exported ones",
        ),
    ] = None,
    again: Annotated[bool, typer.Option("--again", help="Discard earlier confirmations.")] = False,
    ego: options.OwnEgo = None,
    metrics: options.OwnMetrics = None,
    workers: options.Workers = None,
    fail_if: options.ConfirmFailIf = None,
    junit: options.Junit = None,
    as_json: options.Json = False,
) -> None:
    """Simulate a run's scenarios in another simulator.

    Are its critical scenarios critical there, too?
    """
    from bridgegen.cli.terminal.confirmation import ConfirmationProgress, print_confirmation
    from bridgegen.cli.terminal.tables import print_outcomes
    from bridgegen.cli.verdict.of_confirmation import ConfirmationCriteria
    from bridgegen.jobs.search.confirm import confirm as confirm_run

    criteria = ConfirmationCriteria.read(fail_if or (), junit)
    choice = options.read_simulator(simulator, simulator_set, connection)
    assert choice is not None
    with ConfirmationProgress() as live:
        found = confirm_run(
            run,
            choice,
            rows=rows,
            again=again,
            ego=ego,
            metrics=read_names(metrics),
            workers=workers,
            stage=live.stage,
            progress=live.progress,
        )
    print_confirmation(found, as_json=as_json)
    if not print_outcomes(criteria.judge(found)):
        raise typer.Exit(FAILED)
