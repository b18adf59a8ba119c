"""The commands beside ``suite``: ``add``, ``replay``, and an assessor's ``commit``, ``verify``."""

from pathlib import Path
from typing import Annotated

import typer

from bridgegen.cli import options as common
from bridgegen.cli.app import FAILED, suites
from bridgegen.cli.completion import completing
from bridgegen.cli.connection import (
    NO_CONNECTION,
    Connection,
    read_access,
    with_connection_options,
    with_map_folder,
)
from bridgegen.cli.declared import declaration
from bridgegen.engine.options.forms import CRITERIA
from bridgegen.engine.options.option import DRIVER, OUTPUT, SEARCH, WHAT

Results = Annotated[
    Path, typer.Argument(metavar="FOLDER", help="Folder of a suite's results, suites/NAME.")
]

Files = Annotated[
    list[str],
    typer.Argument(
        metavar="SUITE...",
        help="The suite's scenarios: folders, files, names.",
        autocompletion=completing("suite"),
    ),
]


@suites.command("add")
@with_map_folder(WHAT)
def add(
    given: Annotated[
        list[str],
        typer.Argument(
            metavar="FAILURES...",
            help="Folders of runs or of suites' results; or scenario files (.xosc).",
        ),
    ],
    to: Annotated[
        Path,
        typer.Option(
            "--to", help="Folder of the suite that grows, new or not.", rich_help_panel=OUTPUT
        ),
    ],
    ego: Annotated[
        list[str] | None,
        typer.Option(
            help="Driver of the scenario files, or your own driver of the run; may be repeated.",
            show_default="the files' own",
            rich_help_panel=DRIVER,
            autocompletion=completing("driver"),
        ),
    ] = None,
    replace_worse: Annotated[
        bool,
        typer.Option(
            "--replace-worse",
            help="Replace the scenario of a known failure mode by one with more harm.",
            rich_help_panel=OUTPUT,
        ),
    ] = False,
    as_json: common.Json = False,
) -> None:
    """Keep new failures in a suite that grows.

    Of each failure mode that is not there yet, the worst robust scenario and its minimal form; each
    is run again there. The index failures.yaml holds a status for each, which you set.
    """
    from bridgegen.cli.terminal.growth import print_additions
    from bridgegen.jobs.suite.growth import add_failures

    made = add_failures(given, to, egos=ego or (), replace_worse=replace_worse)
    print_additions(made, to, as_json=as_json)


@suites.command("replay")
@with_map_folder(WHAT)
@with_connection_options
def replay(
    folder: Results,
    scenario: Annotated[str, typer.Argument(help="The scenario, by its name in the suite.")],
    variation: Annotated[int, typer.Argument(help="Number of the variation, from 1 on.")],
    ego: Annotated[
        str | None,
        typer.Option(
            help="Driver, where the suite has several, or it is your own.",
            show_default=False,
            rich_help_panel=DRIVER,
            autocompletion=completing("driver"),
        ),
    ] = None,
    connection: Connection = NO_CONNECTION,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for the scenario's files and its page.",
            show_default="FOLDER/variations/NAME",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    as_json: common.Json = False,
) -> None:
    """Run one variation of a suite again, exactly.

    Exports it as scenario files, and plays it on a page. The exit status is 3 if its result is not
    the recorded one.
    """
    from bridgegen.cli.terminal.growth import print_replayed
    from bridgegen.jobs.suite.page import write_replay_page
    from bridgegen.jobs.suite.replay import replay as run_again

    made = run_again(
        folder, scenario, variation, ego=ego, out=out, simulator=read_access(connection)
    )
    page = write_replay_page(made)
    print_replayed(made, page, as_json=as_json)
    if not (made.is_same and made.is_same_exported):
        raise typer.Exit(FAILED)


@suites.command("commit")
@with_map_folder(WHAT)
def commit(
    files: Files,
    key: Annotated[Path, typer.Option(help="New file of the key.", rich_help_panel=OUTPUT)],
    number: Annotated[
        int, typer.Option(help="Variations of each scenario.", rich_help_panel=SEARCH)
    ] = 200,
    odd: common.Odd = None,
    criterion: Annotated[list[str] | None, declaration("criteria")] = None,
    critical: common.Critical = None,
    count: Annotated[str | None, declaration("count")] = None,
    others: common.Others = None,
    empty_trigger: common.EmptyTrigger = None,
) -> None:
    """Make an assessor's key, and print the hash to publish.

    Publish it before the driver is handed in. 'suite ... --assessor KEY' draws the variations of
    that key, once, and seals the result. What bounds and judges them is given here and there.
    """
    from bridgegen.jobs.suite.sealed import commit as lines_of

    judged = {
        "odd": odd, "criteria": CRITERIA.read(criterion or [], "--criterion"),
        "critical": critical, "count": count, "others": others, "empty_trigger": empty_trigger,
    }  # fmt: skip
    print("\n".join(lines_of(key, files, number, **judged)))


@suites.command("verify")
@with_map_folder(WHAT)
def verify(
    sealed: Annotated[Path, typer.Argument(help="The sealed result, sealed.json.")],
    files: Files,
    published: Annotated[
        list[str] | None,
        typer.Option(help="Published hash of the key, or seal.", rich_help_panel=WHAT),
    ] = None,
    ego: Annotated[
        list[str] | None,
        typer.Option(
            help="Run it again with this driver; with a mended one, a re-test.",
            rich_help_panel=DRIVER,
            autocompletion=completing("driver"),
        ),
    ] = None,
) -> None:
    """Verify a sealed result; with --ego, run it again.

    The exit status is 3 if a variation of a re-test fails or did not run.
    """
    from bridgegen.jobs.suite.sealed import verify as verified

    lines, fails = verified(sealed, files, published or (), ego or ())
    print("\n".join(lines))
    if fails:
        raise typer.Exit(FAILED)
