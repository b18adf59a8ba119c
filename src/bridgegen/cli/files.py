"""The commands that take files: convert, check, draw, ask."""

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from bridgegen.base.errors import InputError
from bridgegen.cli import options
from bridgegen.cli.app import app, ontology
from bridgegen.cli.completion import completing
from bridgegen.cli.connection import with_map_folder
from bridgegen.cli.groups import FILES, ONTOLOGY, RESULTS
from bridgegen.engine.options.forms import read_names


@app.command(rich_help_panel=RESULTS)
@with_map_folder()
def export(
    source: Annotated[Path, typer.Argument(help="The folder of a run, or one .xosc file.")],
    flavour: Annotated[
        str,
        typer.Option(
            help="1.2 or 1.3: with parameters; resolved: without; recorded: timed trajectories; "
            "carla: 1.0 for ScenarioRunner, timed trajectories for all but the ego.",
            autocompletion=completing("flavour"),
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
    """Export critical scenarios in formats of other tools.

    Each with its map.
    """
    from bridgegen.jobs.search.export import export as export_scenarios

    notes: list[str] = []
    for path in export_scenarios(
        source, flavour, scenarios=scenario or (), out=out, town=town, notes=notes
    ):
        print(path)
    for note in notes:
        print(f"bridgegen: warning: {note}", file=sys.stderr)


@app.command(rich_help_panel=RESULTS)
def table(
    runs: Annotated[list[Path], typer.Argument(help="Folders of runs, finished or not.")],
    out: Annotated[Path, typer.Option(help="A folder: each run becomes a file in it.")],
    sample: Annotated[
        float,
        typer.Option(
            help="Keep this share of the rows that are neither critical nor failed; a row's weight "
            "is the number of rows that it represents."
        ),
    ] = 1.0,
) -> None:
    """Write all evaluations of runs as Parquet files.

    DuckDB, Polars and pandas read them as one table.
    """
    from bridgegen.jobs.search.table import write_tables

    for path in write_tables(runs, out, sample=sample):
        print(path)


@app.command(rich_help_panel=ONTOLOGY)
def convert(
    file: Annotated[Path, typer.Argument(help="A scenario's ontology (.owl).")],
    out: Annotated[
        Path | None, typer.Option(help="Folder for the files; beside the .owl by default.")
    ] = None,
) -> None:
    """Convert individuals to OpenDRIVE and OpenSCENARIO."""
    from bridgegen.openx.convert import convert_file

    written, violations = convert_file(file, out)
    for path in written:
        print(path)
    for violation in violations:
        print(f"bridgegen: warning: {violation}", file=sys.stderr)


@app.command("import", rich_help_panel=ONTOLOGY)
@with_map_folder()
def import_(
    file: Annotated[
        Path, typer.Argument(help="An OpenDRIVE map (.xodr) or an OpenSCENARIO file (.xosc).")
    ],
    out: Annotated[
        Path | None, typer.Option(help="The .owl file, new; beside the first by default.")
    ] = None,
    partial: Annotated[
        bool,
        typer.Option("--partial", help="Leave out what the ontology cannot express; list it."),
    ] = False,
    ego: Annotated[
        str | None,
        typer.Option(
            help="The entity under test in an .xosc; by default the one called ego, else the first."
        ),
    ] = None,
    strict: Annotated[
        bool,
        typer.Option(
            "--strict", help="Refuse an .xosc of which any detail would be lost, or computed."
        ),
    ] = False,
    empty_trigger: options.EmptyTrigger = None,
) -> None:
    """Convert a map, or a scenario file, to individuals."""
    from bridgegen.openx.convert import import_file

    written, notes = import_file(
        file, out, partial=partial, ego=ego, strict=strict, empty_trigger=empty_trigger or "never"
    )
    print(written)
    for note in notes:
        print(f"bridgegen: note: {note}", file=sys.stderr)


@app.command(rich_help_panel=FILES)
@with_map_folder()
def validate(
    files: Annotated[list[Path], typer.Argument(help="Files: .owl, .xodr, .xosc or .yaml.")],
    reason: Annotated[
        bool,
        typer.Option("--reason", help="Ask the reasoner HermiT about .owl files, too (extra)."),
    ] = False,
    strict: Annotated[
        bool,
        typer.Option("--strict", help="Take warnings about maps as errors, too."),
    ] = False,
) -> None:
    """Check files against their rules.

    The exit status is 2 if one breaks any. A map that can be imported and searched although
    something is odd about it is valid, with warnings.
    """
    from bridgegen.jobs.search.validate import notes_on, validate_file

    broken: list[str] = []
    for file in files:
        warnings: list[str] = []
        problems = validate_file(file, reason=reason, warnings=None if strict else warnings)
        broken += problems
        for warning in warnings:
            print(f"bridgegen: warning: {warning}", file=sys.stderr)
        if not problems:
            count = "1 warning" if len(warnings) == 1 else f"{len(warnings)} warnings"
            print(f"{file}: valid{f', {count}' if warnings else ''}")
            for note in notes_on(file):
                print(f"bridgegen: note: {note}", file=sys.stderr)
    if broken:
        raise InputError(*broken)


@app.command(rich_help_panel=FILES)
def schema(
    kind: Annotated[
        str | None,
        typer.Argument(
            help="Kind of file: scenario, fragment, exposure, run (of a search), compare, suite, "
            "diff, risk, preventability, dashboard or mine (run files of these), or safety-case.",
            show_default="scenario",
        ),
    ] = None,
    of: Annotated[
        str | None, typer.Option(help="Kind of file, like the argument.", show_default=False)
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="A file for it, new or an earlier schema; else printed.")
    ] = None,
) -> None:
    """Print the JSON Schema of scenario or run files.

    Editors complete and check scenario files and run files with it; that of safety cases is for
    programs which read them.
    """
    from bridgegen.cli.jobs import JOBS, argument_of
    from bridgegen.cli.jobs import schema_of as job_schema
    from bridgegen.cli.runs import run_file_schema
    from bridgegen.jobs.safety_case.model import json_schema
    from bridgegen.scenario.language.json_schema import as_text, schema_of, write_schema

    # Argument and option are two spellings of one value: both may be given if they agree.
    if None not in (kind, of) and kind != of:
        raise InputError(f"the schema of one kind of file is printed, got {kind} and --of {of}")
    # Functions and not schemas: only the one that is asked for is made.
    known: dict[str, Callable[[], dict[str, Any]]] = {
        **{job.name: partial(job_schema, job) for job in JOBS if argument_of(job)},
        "run": run_file_schema,
        "safety-case": json_schema,  # of the case itself, which programs read
    }
    name = kind or of or "scenario"
    made = known[name]() if name in known else schema_of(name)
    if out is None:
        print(as_text(made), end="")
        return
    write_schema(out, made)
    print(out)


@app.command(rich_help_panel=FILES)
def show(
    what: Annotated[
        str,
        typer.Argument(
            help="A scenario's ontology (.owl), a catalogue name, or a YAML file.",
            autocompletion=completing("scenario"),
        ),
    ],
    out: Annotated[
        Path | None, typer.Option(help="The page (.html); beside the file by default.")
    ] = None,
) -> None:
    """Draw a scenario: its individuals, or its YAML file.

    Violated constraints are red; a logical scenario is explained.
    """
    from bridgegen.pages.scenario_page import show_file, show_scenario

    file = Path(what)
    if file.suffix.lower() != ".owl":
        print(show_scenario(what, out))
        return
    page, violations = show_file(file, out)
    print(page)
    if violations:
        count = "1 violation" if violations == 1 else f"{violations} violations"
        print(f"bridgegen: warning: {file}: {count}, shown in red", file=sys.stderr)


@app.command(rich_help_panel=ONTOLOGY)
def ask(
    file: Annotated[Path, typer.Argument(help="A scenario's ontology (.owl).")],
    question: Annotated[
        str | None, typer.Argument(help="Name of the question; without it, all are listed.")
    ] = None,
    sparql: Annotated[
        Path | None, typer.Option(help="A file with a SPARQL SELECT of your own, instead.")
    ] = None,
    as_json: options.Json = False,
) -> None:
    """Answer a question about a scenario's individuals."""
    from bridgegen.cli.terminal.tables import print_table
    from bridgegen.scenario.ontology.questions import ask_file

    answer = ask_file(file, question, sparql)
    print_table(answer.columns, answer.rows, as_json=as_json)


@app.command(rich_help_panel=FILES)
def metrics(
    file: Annotated[
        Path,
        typer.Argument(help="A recording: a trace (.csv), or esmini's --csv_logger output."),
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
    """Measure a recording; print its metrics.

    Also prints its decisive conflict. The recording is of another simulator or a real drive.
    """
    from bridgegen.assess.conflict.recorded import measure_recording
    from bridgegen.cli.terminal.files import print_measured

    measured = measure_recording(
        file, ego=ego, boxes=boxes, metrics=read_names(only) or None, time_step=dt
    )
    for note in measured.notes:
        print(f"bridgegen: note: {file}: {note}", file=sys.stderr)
    print_measured(file, measured, as_json=as_json)


@ontology.command("docs")
def ontology_docs(
    out: Annotated[Path, typer.Option(help="The page (.html).")] = Path("bridgegen-ontology.html"),
) -> None:
    """Write all classes and properties as one page."""
    from bridgegen.pages.ontology import write_docs

    write_docs(out)
    print(out)
