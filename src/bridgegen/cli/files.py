"""The commands that take files: convert, check, draw, ask."""

import sys
from pathlib import Path
from typing import Annotated, Literal

import typer

from bridgegen.cli import options
from bridgegen.cli.app import app, ontology
from bridgegen.errors import InputError

SchemaKind = Literal["scenario", "fragment"]


@app.command()
def export(
    source: Annotated[Path, typer.Argument(help="The folder of a run, or one .xosc file.")],
    flavour: Annotated[
        str,
        typer.Option(
            help="1.2 or 1.3: with parameters; resolved: without; recorded: moves by the clock; "
            "carla: 1.0 for ScenarioRunner, all but the ego by the clock."
        ),
    ],
    scenario: Annotated[
        list[str] | None,
        typer.Option(help="A scenario of the run, e.g. 0001; may be repeated; all by default."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the files; SOURCE/export/FLAVOUR by default.")
    ] = None,
    town: Annotated[
        str | None,
        typer.Option(
            help="For carla: run on CARLA's own map of this name, not on the file's; by default "
            "where the run was made on TownNN.xodr."
        ),
    ] = None,
) -> None:
    """Write handed-over scenarios as other tools want them, each with its map."""
    from bridgegen.campaign.export import export as export_scenarios

    notes: list[str] = []
    for path in export_scenarios(
        source, flavour, scenarios=scenario or (), out=out, town=town, notes=notes
    ):
        print(path)
    for note in notes:
        print(f"bridgegen: warning: {note}", file=sys.stderr)


@app.command()
def table(
    runs: Annotated[list[Path], typer.Argument(help="Folders of runs, finished or not.")],
    out: Annotated[Path, typer.Option(help="A folder: each run becomes a file in it.")],
    sample: Annotated[
        float,
        typer.Option(
            help="Keep this share of what is neither critical nor failed; each row's weight says "
            "how many it stands for."
        ),
    ] = 1.0,
) -> None:
    """Write all evaluations of runs as Parquet files, one table to DuckDB, Polars or pandas."""
    from bridgegen.campaign.table import write_tables

    for path in write_tables(runs, out, sample=sample):
        print(path)


@app.command()
def convert(
    file: Annotated[Path, typer.Argument(help="A scenario's ontology (.owl).")],
    out: Annotated[
        Path | None, typer.Option(help="Folder for the files; beside the .owl by default.")
    ] = None,
) -> None:
    """Turn a scenario's individuals into OpenDRIVE and OpenSCENARIO files."""
    from bridgegen.openx.convert import convert_file

    written, violations = convert_file(file, out)
    for path in written:
        print(path)
    for violation in violations:
        print(f"bridgegen: warning: {violation}", file=sys.stderr)


@app.command("import")
def import_(
    file: Annotated[
        Path, typer.Argument(help="An OpenDRIVE map (.xodr) or an OpenSCENARIO file (.xosc).")
    ],
    out: Annotated[
        Path | None, typer.Option(help="The .owl file, new; beside the first by default.")
    ] = None,
    partial: Annotated[
        bool,
        typer.Option("--partial", help="Leave out what the ontology cannot say, and list it."),
    ] = False,
    ego: Annotated[
        str | None,
        typer.Option(help="The entity under test in an .xosc, if it is not called ego."),
    ] = None,
) -> None:
    """Turn a whole map, or a scenario on its map, into individuals."""
    from bridgegen.openx.convert import import_file

    written, notes = import_file(file, out, partial=partial, ego=ego)
    print(written)
    for note in notes:
        print(f"bridgegen: note: {note}", file=sys.stderr)


@app.command()
def validate(
    files: Annotated[list[Path], typer.Argument(help="Files: .owl, .xodr, .xosc or .yaml.")],
    reason: Annotated[
        bool,
        typer.Option("--reason", help="Ask the reasoner HermiT about .owl files, too (extra)."),
    ] = False,
) -> None:
    """Check files against their rules; exit status 2 if one breaks any."""
    from bridgegen.campaign.validate import validate_file

    broken: list[str] = []
    for file in files:
        problems = validate_file(file, reason=reason)
        broken += problems
        if not problems:
            print(f"{file}: valid")
    if broken:
        raise InputError(*broken)


@app.command()
def schema(
    kind: Annotated[
        SchemaKind, typer.Argument(help="Of which files: scenario or fragment.")
    ] = "scenario",
    out: Annotated[
        Path | None, typer.Option(help="A file for it, new or an earlier schema; else printed.")
    ] = None,
) -> None:
    """Print the JSON Schema of scenario files, from which editors complete them."""
    from bridgegen.odd.json_schema import schema_text, write_schema

    if out is None:
        print(schema_text(kind), end="")
        return
    write_schema(out, kind)
    print(out)


@app.command()
def show(
    what: Annotated[
        str,
        typer.Argument(help="A scenario's ontology (.owl), a catalogue name, or a YAML file."),
    ],
    out: Annotated[
        Path | None, typer.Option(help="The page (.html); beside the file by default.")
    ] = None,
) -> None:
    """Draw a scenario: its individuals, violated constraints in red; or explain a logical one."""
    from bridgegen.report.show import show_file, show_scenario

    file = Path(what)
    if file.suffix.lower() != ".owl":
        print(show_scenario(what, out))
        return
    page, violations = show_file(file, out)
    print(page)
    if violations:
        count = "1 violation" if violations == 1 else f"{violations} violations"
        print(f"bridgegen: warning: {file}: {count}, shown in red", file=sys.stderr)


@app.command()
def ask(
    file: Annotated[Path, typer.Argument(help="A scenario's ontology (.owl).")],
    question: Annotated[
        str | None, typer.Argument(help="Its name; without one, the questions are listed.")
    ] = None,
    sparql: Annotated[
        Path | None, typer.Option(help="A file with a SPARQL SELECT of your own, instead.")
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Answer a question about a scenario's individuals."""
    from bridgegen.ontology.questions import ask_file
    from bridgegen.screen.tables import print_table

    answer = ask_file(file, question, sparql)
    print_table(answer.columns, answer.rows, as_json=as_json)


@app.command()
def metrics(
    file: Annotated[
        Path,
        typer.Argument(help="A recording: a trace (.csv), or what esmini's --csv_logger writes."),
    ],
    ego: Annotated[
        str | None, typer.Option(help="The entity under test; that of the first line by default.")
    ] = None,
    boxes: Annotated[
        Path | None,
        typer.Option(help="Take the entities' boxes from this OpenSCENARIO file (.xosc)."),
    ] = None,
    dt: Annotated[
        float | None, typer.Option(help="Resample the recording at this time step [s].")
    ] = None,
    only: options.OnlyMetrics = None,
    as_json: options.Json = False,
) -> None:
    """Print conflict and metrics of a recording that another simulator, or the road, made."""
    from bridgegen.conflict.recorded import measure_recording
    from bridgegen.screen.files import print_measured

    measured = measure_recording(
        file, ego=ego, boxes=boxes, metrics=options.read_names(only) or None, time_step=dt
    )
    for note in measured.notes:
        print(f"bridgegen: note: {file}: {note}", file=sys.stderr)
    print_measured(file, measured, as_json=as_json)


@ontology.command("docs")
def ontology_docs(
    out: Annotated[Path, typer.Option(help="The page (.html).")] = Path("bridgegen-ontology.html"),
) -> None:
    """Write all classes and properties of the ontology as one page, with what each means."""
    from bridgegen.ontology.docs import write_docs

    write_docs(out)
    print(out)
