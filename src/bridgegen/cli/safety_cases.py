"""The command that exports a safety case of runs."""

from pathlib import Path
from typing import Annotated

import typer

from bridgegen.cli import options as common
from bridgegen.cli.app import FAILED, app
from bridgegen.cli.connection import with_map_folder
from bridgegen.cli.groups import RESULTS


@app.command("safety-case", rich_help_panel=RESULTS)
@with_map_folder()
def safety_case(
    runs: Annotated[list[Path], typer.Argument(help="Folders of finished runs.")],
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for the files; by default RUN/safety-case, or safety-case for several "
            "runs."
        ),
    ] = None,
    as_json: common.Json = False,
) -> None:
    """Export what runs support: claims with evidence.

    As Goal Structuring Notation, JSON and a page, with a script that recomputes every number. Ends
    with exit status 3 if a run could not be judged: it supports nothing.
    """
    from bridgegen.cli.terminal.safety_case import print_safety_case
    from bridgegen.jobs.safety_case import export_safety_case

    exported = export_safety_case(runs, out)
    print_safety_case(exported, as_json=as_json)
    if exported.unjudged:
        raise typer.Exit(FAILED)
