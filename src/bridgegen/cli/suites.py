"""The commands that run many scenario files: suites, and two egos compared on one."""

from pathlib import Path
from typing import Annotated

import typer

from bridgegen.cli import options as common
from bridgegen.cli.app import FAILED, app
from bridgegen.cli.completion import completing
from bridgegen.cli.connection import NO_CONNECTION, Connection, with_connection_options
from bridgegen.cli.declared import declaration
from bridgegen.cli.groups import SEARCH
from bridgegen.cli.map_folder import with_map_folder
from bridgegen.errors import InputError
from bridgegen.options import CommonOptions
from bridgegen.options.forms import read_names
from bridgegen.options.option import DRIVER, OUTPUT, WHAT
from bridgegen.options.option import SEARCH as HOW
from bridgegen.simulation.choice import EMBEDDED

Files = Annotated[
    list[str],
    typer.Argument(
        help="Folders, scenario files (.xosc, .yaml), distribution files, or catalogue names.",
        autocompletion=completing("scenario"),
    ),
]
Samples = Annotated[
    int,
    typer.Option(
        help="Evenly spread variations of each logical scenario, besides its defaults.",
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
Criteria = Annotated[list[str] | None, declaration("criteria")]
Critical = Annotated[str | None, declaration("critical")]
Count = Annotated[str | None, declaration("count")]
OwnOthers = Annotated[str | None, declaration("others")]
Stages = Annotated[str | None, declaration("ideal")]


@app.command(rich_help_panel=SEARCH)
@with_map_folder(WHAT)
@with_connection_options
def suite(
    files: Files,
    ego: Annotated[
        list[str] | None,
        typer.Option(
            help="Driver of the ego; may be repeated: several are run side by side.",
            show_default="each scenario's own",
            rich_help_panel=DRIVER,
            autocompletion=completing("driver"),
        ),
    ] = None,
    ideal: Stages = None,
    others: OwnOthers = None,
    time_limit: common.TimeLimit = None,
    criterion: Criteria = None,
    critical: Critical = None,
    count: Count = None,
    empty_trigger: common.EmptyTrigger = None,
    samples: Samples = 100,
    seed: Seed = 0,
    simulator: common.Simulator = None,
    simulator_set: common.SimulatorSettings = None,
    connection: Connection = NO_CONNECTION,
    workers: AtOnce = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the results; those of a stopped suite are resumed.",
            show_default="suites/NAME",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    fail_if: Annotated[
        list[str] | None,
        typer.Option(
            help="End with exit status 3 if this holds, e.g. 'failed > 2'; may be repeated.",
            show_default="a variation fails or did not run",
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
    from bridgegen.screen.suite import SuiteScreen, print_suite
    from bridgegen.screen.verdict import print_outcomes
    from bridgegen.suite.maps import map_suite
    from bridgegen.suite.page import write_suite_page
    from bridgegen.suite.suite import run_suite
    from bridgegen.verdict.of_suite import SuiteCriteria

    options = _options(ideal, others, time_limit, criterion, critical, count, empty_trigger)
    judges = SuiteCriteria.read(
        fail_if or (), junit, [f"criterion:{one['id']}" for one in options.criteria]
    )
    with SuiteScreen() as screen:
        found = run_suite(
            files,
            egos=ego or (),
            options=options,
            samples=samples,
            seed=seed,
            simulator=common.read_simulator(simulator, simulator_set, connection) or EMBEDDED,
            workers=workers,
            out=out,
            callbacks=screen.callbacks,
        )
        maps = map_suite(found, screen.show_cells) if with_map else ()
        screen.show(what="page", facts="")
        page = write_suite_page(found, found.jobs, maps)
    print_suite(found, screen.seconds, page, maps, as_json=as_json)
    if not print_outcomes(judges.judge(found)):
        raise typer.Exit(FAILED)


@app.command(rich_help_panel=SEARCH)
@with_map_folder(WHAT)
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
    others: OwnOthers = None,
    time_limit: common.TimeLimit = None,
    criterion: Criteria = None,
    critical: Critical = None,
    count: Count = None,
    empty_trigger: common.EmptyTrigger = None,
    samples: Samples = 1000,
    seed: Seed = 0,
    workers: AtOnce = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the results; those of a stopped one are resumed.",
            show_default="suites/NAME",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    fail_if: Annotated[
        list[str] | None,
        typer.Option(
            help="End with exit status 3 if this holds, e.g. 'broken > 0'; may be repeated.",
            show_default=False,
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    as_json: common.Json = False,
) -> None:
    """Compare two drivers on the same variations.

    Lists what the second breaks and fixes, with the confidence of either share.
    """
    from bridgegen.screen.suite import SuiteScreen, print_difference
    from bridgegen.screen.verdict import print_outcomes
    from bridgegen.suite.difference import difference
    from bridgegen.suite.page import write_suite_page
    from bridgegen.suite.suite import run_suite
    from bridgegen.verdict.of_suite import DifferenceCriteria

    if len(ego) != 2 or ego[0] == ego[1]:
        raise InputError(f"two different drivers are compared: --ego A --ego B, got {len(ego)}")
    judges = DifferenceCriteria.read(fail_if or ())
    options = _options(None, others, time_limit, criterion, critical, count, empty_trigger)
    with SuiteScreen() as screen:
        found = run_suite(
            files,
            egos=ego,
            options=options,
            samples=samples,
            seed=seed,
            workers=workers,
            out=out,
            callbacks=screen.callbacks,
        )
        screen.show(what="page", facts="")
        page = write_suite_page(found, found.jobs)
    first, second = (found.of_ego(one) for one in ego)
    made = difference(first, second, (ego[0], ego[1]))
    print_difference(made, page, as_json=as_json)
    if not print_outcomes(judges.judge(made)):
        raise typer.Exit(FAILED)


def _options(
    ideal: str | None,
    others: str | None,
    time_limit: float | None,
    criterion: list[str] | None,
    critical: str | None,
    count: str | None,
    empty_trigger: str | None,
) -> CommonOptions:
    """Return the options of all scenarios of a suite."""
    from bridgegen.odd.criteria import read_criteria

    return CommonOptions(
        ideal=read_names(ideal),
        others=others,
        time_limit=time_limit,
        criteria=[one.to_dict() for one in read_criteria(criterion or ())],
        critical=critical,
        count=count,
        empty_trigger=empty_trigger,
    )
