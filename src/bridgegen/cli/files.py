"""The commands that take files: export, check, draw, ask, fit."""

import re
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.cli import options
from bridgegen.cli.app import analyses, app, ontology
from bridgegen.cli.completion import completing
from bridgegen.cli.connection import with_map_folder
from bridgegen.engine.options.forms import read_names

_OF_FLAVOUR = {
    "parquet": {"sample"},
    "video": {"evaluation", "size", "fps", "start", "end", "ego"},
    "page": {"scenarios", "ego"},
    "xosc": set[str](),
    "osi": {"scenarios", "ego"},
    "rerun": {"scenarios", "ego"},
    "openlabel": {"scenarios", "ego"},
}
"""Options of the flavours that are no OpenSCENARIO of a run's scenarios."""


@app.command()
@with_map_folder()
def export(
    sources: Annotated[
        list[Path],
        typer.Argument(
            metavar="SOURCE",
            help="The folder of a run, or one .xosc file; several runs for parquet; an ontology "
            "(.owl) for xosc; also a recording for osi.",
        ),
    ],
    flavour: Annotated[
        str,
        typer.Option(
            help="1.2 or 1.3: with parameters; resolved: without; recorded: timed trajectories; "
            "carla: 1.0 for ScenarioRunner, timed trajectories for all but the ego; video: a film; "
            "page: one crash with its player and files as one page to send; parquet: all "
            "evaluations as tables; osi: the motion as ASAM OSI in MCAP; rerun: recordings for the "
            "viewer Rerun; openlabel: tags for scenario bases; xosc: OpenDRIVE and OpenSCENARIO of "
            "individuals.",
            autocompletion=completing("flavour"),
        ),
    ],
    scenarios: Annotated[
        list[str] | None,
        typer.Option(
            "--scenario",
            help="A scenario of the run, e.g. 0001; may be repeated.",
            show_default="all",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for the files; of a film the file: .gif, .webp, .mp4, .webm; or .png or "
            ".svg for one picture; of a page .html.",
            show_default="SOURCE/export/FLAVOUR; here RUN-SCENARIO.gif or .html; tables; beside "
            "the .owl",
        ),
    ] = None,
    town: Annotated[
        str | None,
        typer.Option(
            help="For carla: run on CARLA's own map of this name, not on the file's; by default "
            "where the run was made on TownNN.xodr."
        ),
    ] = None,
    sample: Annotated[
        float | None,
        typer.Option(
            help="For parquet: keep this share of the rows that are neither critical nor failed; a "
            "row's weight is the number of rows that it represents.",
            show_default="1",
        ),
    ] = None,
    evaluation: Annotated[
        int | None,
        typer.Option(
            help="For video: evaluation to show, counted from 1.",
            show_default="the worst exported scenario",
        ),
    ] = None,
    size: Annotated[
        str | None,
        typer.Option(help="For video: width and height [pixels].", show_default="960x540"),
    ] = None,
    fps: Annotated[
        int | None, typer.Option(help="For video: frames per second.", show_default="20")
    ] = None,
    start: Annotated[
        float | None,
        typer.Option(
            "--from",
            help="For video: start of the film, or instant of the picture [s].",
            show_default="8 s before the conflict",
        ),
    ] = None,
    end: Annotated[
        float | None,
        typer.Option(
            "--to",
            help="For video: end of the film [s].",
            show_default="2 s after the conflict",
        ),
    ] = None,
    ego: options.OwnEgo = None,
) -> None:
    """Export a run: scenarios, films or tables for other tools.

    Scenarios each with their map. DuckDB, Polars and pandas read parquet files as one table. A film
    has the report's view, of the ego and the participant that it meets.
    """
    from bridgegen.jobs.search.export import FLAVOURS, export_beside, export_traces
    from bridgegen.jobs.search.export import export as export_scenarios
    from bridgegen.jobs.search.report import write_finding_page
    from bridgegen.jobs.search.table import write_tables
    from bridgegen.jobs.search.video import film
    from bridgegen.openx.convert import convert_file

    values = {
        "scenarios": scenarios, "town": town, "sample": sample, "evaluation": evaluation,
        "size": size, "fps": fps, "start": start, "end": end, "ego": ego,
    }  # fmt: skip
    given: dict[str, Any] = {name: value for name, value in values.items() if value is not None}
    if flavour not in (known := (*FLAVOURS, *_OF_FLAVOUR)):
        raise UnknownNameError("flavour", flavour, known)
    spelling = {"scenarios": "scenario", "start": "from", "end": "to"}
    if wrong := given.keys() - _OF_FLAVOUR.get(flavour, {"scenarios", "town", "ego"}):
        names = [f"--{spelling.get(name, name)}" for name in values if name in wrong]
        raise InputError(f"--flavour {flavour} does not take {', '.join(names)}")
    if flavour != "parquet" and len(sources) > 1:
        raise InputError(f"--flavour {flavour} takes one source, got {len(sources)}")
    notes: list[str] = []
    written: Sequence[Path]
    if flavour == "parquet":
        written = write_tables(sources, out or "tables", **given)
    elif flavour == "video":
        if size is not None:
            given["size"] = _size(size)
        written = [film(sources[0], out, **given)]
    elif flavour == "page":
        if len(scenarios or ()) > 1:
            raise InputError("--flavour page takes one --scenario: one crash is sent in one page")
        name = scenarios[0] if scenarios else None
        written = [write_finding_page(sources[0], name, out, ego=ego)]
    elif flavour == "osi":
        written = export_traces(sources[0], out=out, notes=notes, **given)
    elif flavour in ("rerun", "openlabel"):
        written = export_beside(sources[0], flavour, out=out, **given)
    elif flavour == "xosc":
        written, notes = convert_file(sources[0], out)
    else:
        written = export_scenarios(sources[0], flavour, out=out, notes=notes, **given)
    for path in written:
        print(path)
    for note in notes:
        print(f"bridgegen: warning: {note}", file=sys.stderr)


def _size(text: str) -> tuple[int, int]:
    if not (found := re.fullmatch(r"([0-9]{1,6})x([0-9]{1,6})", text)):
        raise InputError(f"--size must read WIDTHxHEIGHT, e.g. 960x540, got '{text}'")
    return int(found[1]), int(found[2])


@ontology.command("import")
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
    entity: Annotated[
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
        file,
        out,
        partial=partial,
        ego=entity,
        strict=strict,
        empty_trigger=empty_trigger or "never",
    )
    print(written)
    for note in notes:
        print(f"bridgegen: note: {note}", file=sys.stderr)


@app.command()
@with_map_folder()
def validate(
    given: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="FILE",
            help="Files: .owl, .xodr, .osc, .xosc or .yaml; or drivers of your own: module:Class, "
            "file.py:Class, file.py:function, file.fmu, connect:HOST:PORT, unix:PATH, "
            "'exec:COMMAND', egodriver://HOST:PORT.",
            show_default=False,
        ),
    ] = None,
    reason: Annotated[
        bool,
        typer.Option("--reason", help="Ask the reasoner HermiT about .owl files, too (extra)."),
    ] = False,
    strict: Annotated[
        bool,
        typer.Option("--strict", help="Take warnings about maps as errors, too."),
    ] = False,
    scenario: Annotated[
        list[str] | None,
        typer.Option(
            help="For drivers: scenario to drive in; may be repeated.",
            show_default="four that ship",
            autocompletion=completing("scenario"),
        ),
    ] = None,
    time_limit: options.TimeLimit = None,
    as_json: options.Json = False,
    schema: Annotated[
        bool,
        typer.Option(
            "--schema",
            help="Print a JSON Schema, with which editors complete and check files. In place of "
            "FILE, the kind: scenario (default), fragment, exposure, run (of a search), "
            "algorithms, suite, diff, risk, preventability, dashboard, credibility or mine (run "
            "files of these), or safety-case (for programs that read one).",
        ),
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(help="For --schema: a file, new or an earlier schema; else printed."),
    ] = None,
) -> None:
    """Check files against their rules, or your driver.

    A driver must give repeatable results: a scenario's result must depend on that scenario alone.
    The exit status is 2 if a file breaks any rule, 1 if a driver does. A map that can be imported
    and searched although something is odd about it is valid, with warnings.
    """
    if schema:
        _write_schema(given or ["scenario"], out)
        return
    if not given:
        raise InputError("name a file or a driver: bridgegen validate FILE")
    drivers = [item for item in given if _is_driver(item)]
    if out is not None or (not drivers and (scenario or time_limit or as_json)):
        raise InputError("--out is for --schema; --scenario, --time-limit and --json for drivers")
    _validate_files([Path(item) for item in given if item not in drivers], reason, strict)
    if drivers:
        from bridgegen.cli.terminal.files import print_checks
        from bridgegen.jobs.search.driver_contract import SCENARIOS, check_driver

        checks = [
            check_driver(name, scenario or SCENARIOS, time_limit=time_limit) for name in drivers
        ]
        if False in [print_checks(of_one, as_json=as_json) for of_one in checks]:
            raise typer.Exit(1)


def _is_driver(text: str) -> bool:
    """Return whether a text names a driver, not a file to check."""
    path = Path(text)
    if ":" not in text and path.suffix.lower() in (
        ".owl",
        ".xodr",
        ".osc",
        ".xosc",
        ".yaml",
        ".yml",
    ):
        return False  # without what drivers import
    from bridgegen.drivers import DRIVERS, is_remote
    from bridgegen.drivers.planners import planners

    if is_remote(text) or path.suffix.lower() in (".py", ".fmu"):
        return True
    return not path.exists() and (":" in text or text in (*DRIVERS, *planners()))


def _validate_files(files: Sequence[Path], reason: bool, strict: bool) -> None:
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


def _write_schema(kinds: Sequence[str], out: Path | None) -> None:
    from bridgegen.cli.jobs import JOBS, argument_of
    from bridgegen.cli.jobs import schema_of as job_schema
    from bridgegen.cli.runs import run_file_schema
    from bridgegen.jobs.safety_case.model import json_schema
    from bridgegen.scenario.language.json_schema import as_text, schema_of, write_schema

    if len(kinds) > 1:
        raise InputError(f"the schema of one kind of file is printed, got {', '.join(kinds)}")
    # Functions and not schemas: only the one that is asked for is made.
    known: dict[str, Callable[[], dict[str, Any]]] = {
        **{job.last_word: partial(job_schema, job) for job in JOBS if argument_of(job)},
        "run": run_file_schema,
        "safety-case": json_schema,  # of the case itself, which programs read
    }
    (name,) = kinds
    made = known[name]() if name in known else schema_of(name)
    if out is None:
        print(as_text(made), end="")
        return
    write_schema(out, made)
    print(out)


@app.command("draw")
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


@ontology.command()
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


@analyses.command("recording")
def metrics(
    file: Annotated[
        Path,
        typer.Argument(help="A recording: a trace (.csv), or esmini's --csv_logger output."),
    ],
    entity: Annotated[
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
        file, ego=entity, boxes=boxes, metrics=read_names(only) or None, time_step=dt
    )
    for note in measured.notes:
        print(f"bridgegen: note: {file}: {note}", file=sys.stderr)
    print_measured(file, measured, as_json=as_json)


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
    prior: Annotated[
        str | None,
        typer.Option(
            help="An exposure that counts as 47 events besides these, so that few are enough: "
            "uniform, an example's name, or a file."
        ),
    ] = None,
    odd: options.Odd = None,
    recordings: Annotated[
        list[Path] | None,
        typer.Option(
            help="Recorded traffic, file or folder: replay its events beside their parameterised "
            "twins, and count the verdicts that change; may be repeated."
        ),
    ] = None,
    road_map: Annotated[
        Path | None, typer.Option("--map", help="OpenDRIVE map of the recordings.")
    ] = None,
    replay_drivers: Annotated[
        str, typer.Option(help="Drivers that ship and drive in both, by commas; or none.")
    ] = "reference,un-r157",
    replicates: Annotated[int, typer.Option(help="Resampled fits, for bands and p values.")] = 200,
    seed: Annotated[int, typer.Option(help="Seed of the random number generator.")] = 0,
    as_json: options.Json = False,
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
            ignore=ignore or (), others=without_column, source=source, prior=prior,
            odd=odd, recordings=recordings or (), road_map=road_map, replay_drivers=replay_drivers,
            replicates=replicates, seed=seed, progress=live.progress, replayed=live.replayed,
            notes=notes,
        )  # fmt: skip
    for note in notes:
        print(f"bridgegen: note: {note}", file=sys.stderr)
    print_fit(fitted, written, as_json=as_json)


@ontology.command("docs")
def ontology_docs(
    out: Annotated[Path, typer.Option(help="The page (.html).")] = Path("bridgegen-ontology.html"),
) -> None:
    """Write all classes and properties as one page."""
    from bridgegen.pages.ontology import write_docs

    write_docs(out)
    print(out)
