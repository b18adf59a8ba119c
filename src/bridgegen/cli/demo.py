"""The command that shows what a search does."""

import sys
import webbrowser
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Annotated

import typer

from bridgegen.cli.app import app

SCENARIO, DRIVER, ALGORITHM, BUDGET = "cyclist-right-turn", "route-follower", "nsga2", 600
"""Search of the demonstration: UN R157's driver brakes for what is on its lane, and for nothing
that crosses it."""


@app.command()
def demo(
    open_page: Annotated[
        bool, typer.Option("--open/--no-open", help="Open the page in your browser.")
    ] = True,
) -> None:
    """Search a small example, and open its page.

    The run is a new folder, runs/demo or runs/demo-2 …; it takes about 20 seconds.
    """
    from bridgegen.cli.terminal.search import SearchProgress, print_summary
    from bridgegen.jobs import search as campaign

    folder = next(path for path in _folders(Path("runs")) if not path.exists())
    print(
        f"A car turns right while a cyclist goes straight on. Which of {BUDGET} such scenarios "
        f"make the driver '{DRIVER}' fail?\nbridgegen search {SCENARIO} --ego {DRIVER} --algorithm "
        f"{ALGORITHM} --budget {BUDGET} --out {folder}\n",
        flush=True,
    )
    with SearchProgress(BUDGET) as live:
        run = campaign.run_search(
            SCENARIO,
            ego=DRIVER,
            algorithm=ALGORITHM,
            budget=BUDGET,
            out=folder,
            callbacks=live.callbacks,
        )
    print_summary(run, live.seconds)
    if open_page and not webbrowser.open(run.report.resolve().as_uri()):
        print(
            f"bridgegen: no browser found: open {run.report} yourself, or see 'bridgegen open "
            f"{folder}'",
            file=sys.stderr,
        )


def _folders(parent: Path) -> Iterator[Path]:
    """Yield the names that a demonstration's folder may have, without end."""
    yield parent / "demo"
    for number in count(2):
        yield parent / f"demo-{number}"
