"""The commands that run many scenario files: suites, and two egos compared on one."""

from pathlib import Path
from typing import Annotated

import typer

from bridgegen.base.errors import InputError
from bridgegen.cli import options as common
from bridgegen.cli.app import FAILED, app, suites
from bridgegen.cli.completion import completing
from bridgegen.cli.connection import (
    NO_CONNECTION,
    Connection,
    with_connection_options,
    with_map_folder,
)
from bridgegen.cli.declared import with_options
from bridgegen.cli.groups import DEFAULT, SEARCH, DefaultCommand
from bridgegen.engine.options import CommonOptions
from bridgegen.engine.options.option import DRIVER, OUTPUT, WHAT
from bridgegen.engine.options.option import SEARCH as HOW
from bridgegen.simulation.choice import EMBEDDED

Files = Annotated[
    list[str],
    typer.Argument(
        help="Folders, scenario files (.xosc, .yaml), distribution files, names of the catalogue, "
        "packs.",
        autocompletion=completing("suite"),
    ),
]
Samples = Annotated[
    int,
    typer.Option(
        help="Evenly spread variations of each logical scenario without a matrix, besides its "
        "defaults.",
        rich_help_panel=HOW,
    ),
]
Matrix = Annotated[
    str | None,
    typer.Option(
        help="Edition of the scenarios' matrices, such as 2026; 'none' for --samples instead.",
        show_default="all editions",
        rich_help_panel=HOW,
    ),
]
Seed = Annotated[int, typer.Option(help="Seed of these variations.", rich_help_panel=HOW)]
AtOnce = Annotated[
    int | None,
    typer.Option(
        "--workers",
        help="Scenarios at a time, each in a process. No result depends on it.",
        show_default="one on each core",
        rich_help_panel=HOW,
    ),
]
Out = Annotated[
    Path | None,
    typer.Option(
        help="Folder of the results; those of a stopped one are resumed.",
        show_default="suites/NAME",
        rich_help_panel=OUTPUT,
    ),
]

of_all_scenarios = with_options(
    "ideal", "vehicle", "others", "time_limit", "criteria", "critical", "count", "empty_trigger"
)
"""Gives a command the options of how each scenario is run and judged."""


@suites.command(DEFAULT, cls=DefaultCommand)
@with_map_folder(WHAT)
@with_connection_options
@of_all_scenarios
def suite(
    files: Files,
    options: CommonOptions,
    ego: Annotated[
        list[str] | None,
        typer.Option(
            help="Driver of the ego; may be repeated: several are run side by side.",
            show_default="each scenario's own",
            rich_help_panel=DRIVER,
            autocompletion=completing("driver"),
        ),
    ] = None,
    matrix: Matrix = None,
    samples: Samples = 100,
    seed: Seed = 0,
    simulator: common.Simulator = None,
    simulator_set: common.SimulatorSettings = None,
    connection: Connection = NO_CONNECTION,
    workers: AtOnce = None,
    out: Out = None,
    fail_if: Annotated[
        list[str] | None,
        typer.Option(
            help="End with exit status 3 if this holds, e.g. 'failed > 2'; may be repeated.",
            show_default="a variation fails or did not run, or a scenario is not judged",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    junit: common.Junit = None,
    with_map: Annotated[
        bool,
        typer.Option(
            "--map",
            help="Draw the preventability map of each scenario that has a grid of its own.",
            rich_help_panel=OUTPUT,
        ),
    ] = False,
    as_json: common.Json = False,
) -> None:
    """Run many scenario files with all their variations.

    Finds scenarios and distributions in folders, runs them in parallel, and judges each variation:
    the ego fails if it is critical, or if a pass criterion is violated.
    """
    from bridgegen.cli.terminal.suite import SuiteScreen, print_suite
    from bridgegen.cli.terminal.tables import print_outcomes
    from bridgegen.cli.verdict.of_suite import SuiteCriteria
    from bridgegen.jobs.suite.maps import map_suite
    from bridgegen.jobs.suite.page import write_suite_page
    from bridgegen.jobs.suite.suite import run_suite

    judges = SuiteCriteria.read(
        fail_if or (), junit, [f"criterion:{one['id']}" for one in options.criteria]
    )
    with SuiteScreen() as screen:
        found = run_suite(
            files,
            egos=ego or (),
            options=options,
            matrix=matrix,
            samples=samples,
            seed=seed,
            simulator=common.read_simulator(simulator, simulator_set, connection) or EMBEDDED,
            workers=workers,
            out=out,
            callbacks=screen.callbacks,
        )
        maps = map_suite(found, screen.show_cells) if with_map else ()
        screen.show(what="page", facts="")
        page = write_suite_page(found, found.jobs, maps=maps)
    print_suite(found, screen.seconds, page, maps, as_json=as_json)
    if not print_outcomes(judges.judge(found)):
        raise typer.Exit(FAILED)


@app.command(rich_help_panel=SEARCH)
@with_map_folder(WHAT)
@of_all_scenarios
def diff(
    files: Files,
    ego: Annotated[
        list[str],
        typer.Option(
            help="Driver of the ego; given twice: the one to compare with, then the new one.",
            rich_help_panel=DRIVER,
            autocompletion=completing("driver"),
        ),
    ],
    options: CommonOptions,
    matrix: Matrix = None,
    samples: Samples = 1000,
    budget: Annotated[
        int,
        typer.Option(
            help="Evaluations of the search of each logical scenario for where the second is "
            "worse; 0: none is searched.",
            min=0,
            rich_help_panel=HOW,
        ),
    ] = 300,
    seed: Annotated[
        int, typer.Option(help="Seed of the variations, and of searches.", rich_help_panel=HOW)
    ] = 0,
    workers: AtOnce = None,
    out: Out = None,
    fail_if: Annotated[
        list[str] | None,
        typer.Option(
            help="End with exit status 3 if this holds, e.g. 'broken > 0'; may be repeated.",
            show_default="too few can be compared; with --junit, that one is broken or a search "
            "finds where",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    junit: common.Junit = None,
    as_json: common.Json = False,
) -> None:
    """Compare two drivers on the same variations.

    Lists what the second breaks and fixes, with the confidence of either share. Then searches the
    logical scenarios for where the second is worse.
    """
    from bridgegen.cli.terminal.suite import SuiteScreen, print_difference
    from bridgegen.cli.terminal.tables import print_outcomes
    from bridgegen.cli.verdict.of_difference import DifferenceCriteria
    from bridgegen.jobs.suite.difference import difference, search_worse
    from bridgegen.jobs.suite.page import write_suite_page
    from bridgegen.jobs.suite.suite import run_suite

    if len(ego) != 2 or ego[0] == ego[1]:
        raise InputError(f"two different drivers are compared: --ego A --ego B, got {len(ego)}")
    egos = (ego[0], ego[1])
    judges = DifferenceCriteria.read(fail_if or (), junit)
    with SuiteScreen() as screen:
        found = run_suite(
            files,
            egos=egos,
            options=options,
            matrix=matrix,
            samples=samples,
            seed=seed,
            workers=workers,
            out=out,
            callbacks=screen.callbacks,
        )
        searches = search_worse(
            found, egos, budget=budget, seed=seed, callbacks=screen.of_searches(budget)
        )
        screen.show(what="page", facts="")
        page = write_suite_page(found, found.jobs, searches=searches)
    made = difference(found.of_ego(egos[0]), found.of_ego(egos[1]), egos)
    print_difference(made, searches, page, as_json=as_json)
    if not print_outcomes(judges.judge(found, made, searches)):
        raise typer.Exit(FAILED)
