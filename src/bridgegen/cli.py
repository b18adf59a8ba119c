"""The command line: parse, call, print; no logic."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from bridgegen.errors import BridgeGenError, InputError, Interrupted

app = typer.Typer(
    name="bridgegen",
    help="Search an operational design domain for the scenarios in which a vehicle comes to harm.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
listing = typer.Typer(help="List what there is.", no_args_is_help=True, rich_markup_mode=None)
app.add_typer(listing, name="list")

ontology = typer.Typer(help="The ontology itself.", no_args_is_help=True, rich_markup_mode=None)
app.add_typer(ontology, name="ontology")

Json = Annotated[bool, typer.Option("--json", help="Print JSON for machines.")]


def main() -> None:
    """Run the command line; a user's mistake is one message on stderr and exit status 2."""
    try:
        app()
    except Interrupted as stop:
        print(f"bridgegen: {stop}", file=sys.stderr)
        sys.exit(130)
    except BridgeGenError as error:
        for problem in error.problems:
            print(f"bridgegen: error: {problem}", file=sys.stderr)
        sys.exit(2)


@app.command()
def search(
    scenario: Annotated[str, typer.Argument(help="A catalogue name, or the path of a YAML file.")],
    algorithm: Annotated[str, typer.Option(help="See 'bridgegen list algorithms'.")] = "pso",
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", help="A setting of the algorithm, NAME=VALUE; may be repeated."),
    ] = None,
    budget: Annotated[int, typer.Option(help="Evaluations, exactly.")] = 1000,
    seed: Annotated[int, typer.Option(help="The same seed gives the same result.")] = 0,
    ego: Annotated[
        str | None,
        typer.Option(
            help="Who drives: route-follower or reference.", show_default="the scenario's choice"
        ),
    ] = None,
    axes: Annotated[
        str | None,
        typer.Option(help="What to search, e.g. static,participants,weather."),
    ] = None,
    fix: Annotated[
        list[str] | None,
        typer.Option(help="Hold a parameter, e.g. --fix fog_density=80; may be repeated."),
    ] = None,
    objective: Annotated[
        str | None,
        typer.Option(
            help="Metrics and weights, e.g. d_min=0.8,v_d=0.2, or d_min,ttc with --weights entropy."
        ),
    ] = None,
    weights: Annotated[
        str | None, typer.Option(help="fixed, or entropy (from a random sample).")
    ] = None,
    scale: Annotated[str | None, typer.Option(help="raw, or standardised (by a sample).")] = None,
    road_map: Annotated[
        Path | None, typer.Option("--map", help="A map (.xodr, or its import) to search on.")
    ] = None,
    junction: Annotated[str | None, typer.Option(help="Which junction of the map.")] = None,
    keep: Annotated[int, typer.Option(help="How many critical scenarios to hand over.")] = 10,
    out: Annotated[Path | None, typer.Option(help="The run's folder, new.")] = None,
) -> None:
    """Search a logical scenario for its critical concrete ones."""
    from bridgegen import campaign
    from bridgegen.screen import Screen, print_summary

    fixed = _numbers(fix or [])
    terms = _terms(objective) if objective else None
    with Screen(budget) as screen:
        run = campaign.run_search(
            scenario,
            algorithm=algorithm,
            settings=_settings(settings or []),
            budget=budget,
            seed=seed,
            ego=ego,
            axes=axes.split(",") if axes else None,
            fixed=fixed,
            road_map=road_map,
            junction=junction,
            keep=keep,
            out=out,
            objective=terms,
            weights=weights,
            scale=scale,
            watch=screen.watch,
        )
    print_summary(run, screen.seconds)


@app.command()
def new(
    name: Annotated[str, typer.Argument(help="Of your scenario; NAME.yaml is written.")],
    like: Annotated[
        str | None, typer.Option(help="Start from a copy of this one of the catalogue.")
    ] = None,
) -> None:
    """Write a commented scenario file to start from."""
    from bridgegen.odd.starter import start_scenario

    path = start_scenario(name, like=like)
    print(f"{path}: check it with 'bridgegen validate {path}', then 'bridgegen search {path}'")


@app.command()
def resume(folder: Annotated[Path, typer.Argument(help="The folder of a run.")]) -> None:
    """Go on with a run that was interrupted; the result is as if it had not been."""
    from bridgegen import campaign
    from bridgegen.screen import Screen, print_summary

    with Screen() as screen:
        run = campaign.resume(folder, watch=screen.watch)
    print_summary(run, screen.seconds)


@app.command()
def coverage(
    run: Annotated[Path, typer.Argument(help="The folder of a run.")],
    bins: Annotated[
        int, typer.Option(help="Equal bins per parameter; whole numbers have one each.")
    ] = 5,
    strength: Annotated[
        int, typer.Option(help="Count combinations of up to so many parameters' bins: 1, 2, 3.")
    ] = 3,
    as_json: Json = False,
) -> None:
    """Show which bins, and combinations of bins, a run evaluated and where it was critical."""
    from bridgegen.campaign.coverage import coverage_of
    from bridgegen.screen import print_coverage

    settings, found = coverage_of(run, bins=bins, strength=strength)
    print_coverage(run, settings, found, as_json=as_json)


@app.command()
def simulate(
    file: Annotated[Path, typer.Argument(help="An OpenSCENARIO file (.xosc).")],
    ego: Annotated[
        str | None, typer.Option(help="Who drives; what the file says by default.")
    ] = None,
    as_json: Json = False,
) -> None:
    """Run one scenario file and print its metrics."""
    from bridgegen.pipeline import simulate_file
    from bridgegen.screen import print_file_result

    result = simulate_file(file, ego=ego)
    if as_json:
        facts = {"file": str(file), "ego": result.driver, "status": result.status}
        metrics = {k: v if abs(v) < float("inf") else None for k, v in result.metrics.items()}
        print(json.dumps({**facts, "parameters": result.parameters, "metrics": metrics}, indent=2))
    else:
        print_file_result(file, result)


@app.command()
def export(
    source: Annotated[Path, typer.Argument(help="The folder of a run, or one .xosc file.")],
    flavour: Annotated[
        str,
        typer.Option(
            help="1.2 or 1.3: with parameters; resolved: without; recorded: moves by the clock."
        ),
    ],
    scenario: Annotated[
        list[str] | None,
        typer.Option(help="A scenario of the run, e.g. 0001; may be repeated; all by default."),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the files; SOURCE/export/FLAVOUR by default.")
    ] = None,
) -> None:
    """Write handed-over scenarios as other tools want them, each with its map."""
    from bridgegen.campaign.export import export as export_scenarios

    for path in export_scenarios(source, flavour, scenarios=scenario or (), out=out):
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
    from bridgegen.openx.convert import validate_file

    broken: list[str] = []
    for file in files:
        problems = validate_file(file, reason=reason)
        broken += problems
        if not problems:
            print(f"{file}: valid")
    if broken:
        raise InputError(*broken)


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
    as_json: Json = False,
) -> None:
    """Answer a question about a scenario's individuals."""
    from bridgegen.ontology.questions import ask_file
    from bridgegen.screen import print_table

    answer = ask_file(file, question, sparql)
    print_table(answer.columns, answer.rows, as_json=as_json)


@ontology.command("docs")
def ontology_docs(
    out: Annotated[Path, typer.Option(help="The page (.html).")] = Path("bridgegen-ontology.html"),
) -> None:
    """Write all classes and properties of the ontology as one page, with what each means."""
    from bridgegen.ontology.docs import write_docs

    write_docs(out)
    print(out)


@listing.command("scenarios")
def list_scenarios(as_json: Json = False) -> None:
    """The logical scenarios that ship."""
    from bridgegen.odd.reader import load, names
    from bridgegen.screen import print_table

    rows = [(name, load(name).title) for name in names()]
    print_table(("scenario", "title"), rows, as_json=as_json)


@listing.command("algorithms")
def list_algorithms(as_json: Json = False) -> None:
    """The search algorithms."""
    from bridgegen import search as toolkit
    from bridgegen.screen import print_table

    rows = []
    for one in (toolkit.get(name) for name in toolkit.names()):
        settings = ", ".join(f"{name}={json.dumps(s.default)}" for name, s in one.settings.items())
        rows.append((one.name, one.description, settings, one.source))
    print_table(("algorithm", "description", "settings", "source"), rows, as_json=as_json)


@listing.command("metrics")
def list_metrics(as_json: Json = False) -> None:
    """The criticality metrics."""
    from bridgegen.metrics import METRICS
    from bridgegen.screen import print_table

    rows = [(m.name, m.unit, m.sense, m.description) for m in METRICS.values()]
    print_table(("metric", "unit", "more critical if", "description"), rows, as_json=as_json)


@listing.command("parameters")
def list_parameters(
    scenario: Annotated[str, typer.Argument(help="A catalogue name, or the path of a YAML file.")],
    as_json: Json = False,
) -> None:
    """The parameters of a scenario, with ranges and constraints."""
    from bridgegen.odd.reader import load
    from bridgegen.screen import print_parameters

    print_parameters(load(scenario).table(), as_json=as_json)


def _terms(text: str) -> dict[str, float | None]:
    """Read ``metric=weight,…`` or ``metric,…``."""
    pairs = [pair.strip() for pair in text.split(",")]
    weighted = _numbers([pair for pair in pairs if "=" in pair], "--objective")
    return {name: weighted.get(name) for name in (pair.partition("=")[0] for pair in pairs)}


def _settings(pairs: list[str]) -> dict[str, bool | int | float | str]:
    """Read ``name=value`` pairs; a value is a number, true, false, or a text."""
    values: dict[str, bool | int | float | str] = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if not equals:
            raise InputError(f"--set must read NAME=VALUE, got '{pair}'")
        try:
            value = json.loads(text)
        except json.JSONDecodeError:
            value = text
        values[name] = value if isinstance(value, bool | int | float | str) else text
    return values


def _numbers(pairs: list[str], option: str = "--fix") -> dict[str, float]:
    """Read ``name=value`` pairs."""
    values, problems = {}, []
    for pair in pairs:
        name, equals, text = pair.partition("=")
        try:
            values[name] = float(text)
        except ValueError:
            equals = ""
        if not equals:
            problems.append(f"{option} must read NAME=NUMBER, got '{pair}'")
    if problems:
        raise InputError(*problems)
    return values
