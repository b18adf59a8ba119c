"""The command that examines the installation."""

import typer

from bridgegen.cli import options
from bridgegen.cli.app import app


@app.command()
def doctor(as_json: options.Json = False) -> None:
    """Examine this installation: versions, cache, extras.

    Ends with status 2 if something keeps a search from working, or compiles at each start.
    """
    from bridgegen.cli.installation import examine
    from bridgegen.cli.terminal.tables import print_table

    found = list(examine())
    rows = [(finding.subject, finding.value, finding.advice) for finding in found]
    print_table(("subject", "value", "advice"), rows, as_json=as_json)
    if any(finding.is_problem for finding in found):
        raise typer.Exit(2)
