"""The command that shows all results of a project on one page."""

from pathlib import Path
from typing import Annotated

import typer

from bridgegen.cli import options as common
from bridgegen.cli.app import FAILED, app
from bridgegen.cli.groups import RESULTS


@app.command(rich_help_panel=RESULTS)
def dashboard(
    folder: Annotated[
        Path,
        typer.Argument(help="The folder of a project: runs, suites, maps, comparisons below it."),
    ],
    out: Annotated[
        Path | None,
        typer.Option(help="The page.", show_default="dashboard.html in the folder"),
    ] = None,
    criterion: Annotated[
        list[str] | None,
        typer.Option(
            help="A requirement of the project, tested or not: a file of criteria, or "
            "'ID: FORMULA'; may be repeated.",
        ),
    ] = None,
    update: Annotated[
        bool,
        typer.Option(
            "--update",
            help="Add failure modes that no failures.yaml names to that in the folder, as new.",
        ),
    ] = False,
    fail_if: Annotated[
        list[str] | None,
        typer.Option(
            help="End with exit status 3 if this holds, e.g. 'new > 0'; may be repeated.",
            show_default=False,
        ),
    ] = None,
    as_json: common.Json = False,
) -> None:
    """Show all results of a project on one page.

    What fails now, trends over driver versions, requirements by scenario, coverage of the
    operational design domain. The statuses of failure modes are those of failures.yaml, in the
    folder and in suites that grow, which are yours.
    """
    from bridgegen.cli.terminal.dashboard import DashboardScreen, print_dashboard
    from bridgegen.cli.terminal.tables import print_outcomes
    from bridgegen.cli.verdict.of_dashboard import DashboardCriteria
    from bridgegen.jobs.dashboard import build_dashboard

    judges = DashboardCriteria.read(fail_if or ())
    with DashboardScreen() as screen:
        found = build_dashboard(
            folder, out=out, criteria=criterion or (), update=update, begun=screen.begun
        )
    print_dashboard(found, as_json=as_json)
    if not print_outcomes(judges.judge(found)):
        raise typer.Exit(FAILED)
