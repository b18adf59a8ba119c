"""The commands about how often scenarios are met, and with which values."""

import sys
from pathlib import Path
from typing import Annotated

import typer

from bridgegen.cli import options as common
from bridgegen.cli.app import app, listing
from bridgegen.cli.completion import completing


@app.command()
def fit(
    scenario: Annotated[
        str,
        typer.Argument(
            help="A catalogue name, or the path of a YAML file.",
            autocompletion=completing("scenario"),
        ),
    ],
    events: Annotated[
        Path,
        typer.Argument(help="A table (.csv): a row per event, a column per parameter."),
    ],
    out: Annotated[Path, typer.Option(help="The exposure (.yaml), new or an earlier fit.")] = Path(
        "exposure.yaml"
    ),
    page: Annotated[
        Path | None, typer.Option(help="The page (.html); beside the exposure by default.")
    ] = None,
    xosc: Annotated[
        Path | None,
        typer.Option(help="Also write an OpenSCENARIO ParameterValueDistribution here."),
    ] = None,
    hours: Annotated[
        float | None, typer.Option(help="Hours of driving in which the events happened [h].")
    ] = None,
    km: Annotated[
        float | None, typer.Option(help="Distance of driving in which the events happened [km].")
    ] = None,
    ignore: Annotated[
        list[str] | None,
        typer.Option(help="A column that is no parameter; may be repeated."),
    ] = None,
    without_column: Annotated[
        str | None,
        typer.Option(help="Searched parameters without a column: uniform or default."),
    ] = None,
    source: Annotated[
        str | None, typer.Option(help="Where the events come from, for the file.")
    ] = None,
    replicates: Annotated[int, typer.Option(help="Resampled fits, for bands and p values.")] = 200,
    seed: Annotated[int, typer.Option(help="Seed of the random number generator.")] = 0,
    as_json: common.Json = False,
) -> None:
    """Fit distributions of a scenario's parameters to events.

    Chooses a form for each parameter, tests it, measures how they depend on each other, and
    writes an exposure, and a page that shows how well it fits.
    """
    from bridgegen.cli.terminal.fit import FitProgress, print_fit
    from bridgegen.jobs.fit import write_fit

    notes: list[str] = []
    with FitProgress() as live:
        fitted, written = write_fit(
            scenario, events, out=out, page=page, xosc=xosc, hours=hours, km=km,
            ignore=ignore or (), others=without_column, source=source, replicates=replicates,
            seed=seed, progress=live.progress, notes=notes,
        )  # fmt: skip
    for note in notes:
        print(f"bridgegen: note: {note}", file=sys.stderr)
    print_fit(fitted, written, as_json=as_json)


@listing.command("exposures")
def list_exposures(as_json: common.Json = False) -> None:
    """Examples of exposures; none is used unless named."""
    from bridgegen.cli.terminal.tables import print_entries
    from bridgegen.scenario.exposure import example_names, read_exposure

    made = [(name, read_exposure(name)) for name in example_names()]
    rows = [(name, f"of {exposure.scenario.name}", exposure.source) for name, exposure in made]
    print_entries(("exposure", "description", "source"), rows, as_json=as_json)
