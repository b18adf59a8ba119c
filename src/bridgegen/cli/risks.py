"""The command that estimates how likely harm is."""

from pathlib import Path
from typing import Annotated

import typer

from bridgegen.cli import options as common
from bridgegen.cli.app import FAILED, app
from bridgegen.cli.completion import completing
from bridgegen.cli.connection import NO_CONNECTION, Connection, with_connection_options
from bridgegen.cli.groups import SEARCH
from bridgegen.engine.options.option import DRIVER, OUTPUT, SIMULATOR, WHAT


@app.command(rich_help_panel=SEARCH)
@with_connection_options
def risk(
    scenario: Annotated[
        str,
        typer.Argument(
            help="A name of the catalogue or of a pack, or the path of a YAML file.",
            autocompletion=completing("scenario"),
        ),
    ],
    *,
    ego: Annotated[
        str | None,
        typer.Option(
            help="Driver under test.",
            rich_help_panel=DRIVER,
            show_default="the scenario's choice",
            autocompletion=completing("driver"),
        ),
    ] = None,
    exposure: Annotated[
        str | None,
        typer.Option(
            help="How its parameters are distributed: a file (.yaml), an example of 'bridgegen "
            "list exposures', or uniform.",
            show_default="the exposure in the scenario's file",
            rich_help_panel=WHAT,
        ),
    ] = None,
    event: Annotated[
        str, typer.Option(help="Aimed at: conflict or collision.", rich_help_panel=WHAT)
    ] = "collision",
    count: Annotated[
        str,
        typer.Option(
            help="Conflicts that count: ego (it is responsible, or could prevent them), or any.",
            rich_help_panel=WHAT,
        ),
    ] = "ego",
    method: Annotated[
        str,
        typer.Option(help="auto, mc, subset, importance or stratified.", rich_help_panel=WHAT),
    ] = "auto",
    precision: Annotated[
        float,
        typer.Option(
            help="Stop when half of the 95 % interval is this part of the estimate; 0: never.",
            rich_help_panel=WHAT,
        ),
    ] = 0.2,
    budget: Annotated[
        int, typer.Option(help="Simulations of the estimate, at most.", rich_help_panel=WHAT)
    ] = 200_000,
    seed: Annotated[int, typer.Option(help="Of all random numbers.", rich_help_panel=WHAT)] = 0,
    start: Annotated[
        Path | None,
        typer.Option(
            "--from",
            help="Run of a search, whose harmful scenarios importance sampling may use.",
            rich_help_panel=WHAT,
        ),
    ] = None,
    check: Annotated[
        int,
        typer.Option(
            help="Also estimate by so many plain Monte Carlo simulations, to compare.",
            show_default="none",
            rich_help_panel=WHAT,
        ),
    ] = 0,
    events: Annotated[
        Path | None,
        typer.Option(
            help="The table (.csv) that the exposure was fitted to: says how much few data leave "
            "open.",
            rich_help_panel=WHAT,
        ),
    ] = None,
    vehicle: common.Vehicle = None,
    others: common.Others = None,
    simulator: Annotated[
        str | None,
        typer.Option(
            help="Also simulate rows around the harmful ones in this simulator, and say by which "
            "factor the event is more or less likely there.",
            show_default="none",
            rich_help_panel=SIMULATOR,
            autocompletion=completing("simulator"),
        ),
    ] = None,
    simulator_rows: Annotated[
        int, typer.Option(help="How many rows there.", rich_help_panel=SIMULATOR)
    ] = 200,
    simulator_set: common.SimulatorSettings = None,
    connection: Connection = NO_CONNECTION,
    workers: common.Workers = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="The risk's folder; a stopped estimate is resumed.",
            show_default="risk/SCENARIO",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    fail_if: Annotated[
        list[str] | None,
        typer.Option(
            help="End with exit status 3 if this holds, e.g. 'collision_upper > 1e-4'; may be "
            "repeated.",
            show_default=False,
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    junit: common.Junit = None,
    as_json: common.Json = False,
) -> None:
    """Estimate how likely harm is per encounter, with an interval.

    And per hour and kilometre, where the exposure says how often the scenario is met. Writes a
    record, a page, the harmful rows, and the most likely one of each failure mode as a scenario.
    """
    from bridgegen.cli.terminal.risk import RiskScreen, print_risk
    from bridgegen.cli.terminal.tables import print_outcomes
    from bridgegen.cli.verdict.of_risk import RiskCriteria
    from bridgegen.jobs.risk.risk import estimate_risk

    judges = RiskCriteria.read(fail_if or (), junit)
    elsewhere = common.read_simulator(simulator, simulator_set, connection)
    with RiskScreen() as screen:
        result = estimate_risk(
            scenario, ego=ego, exposure=exposure, event=event, count=count, method=method,
            precision=precision, budget=budget, seed=seed, start=start, check=check,
            events=events, vehicle=vehicle, others=others, simulator=elsewhere,
            simulator_rows=simulator_rows, workers=workers, out=out, callbacks=screen.callbacks,
        )  # fmt: skip
    print_risk(result, screen.seconds, as_json=as_json)
    if not print_outcomes(judges.judge(result)):
        raise typer.Exit(FAILED)
