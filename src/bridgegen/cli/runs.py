"""The commands that make and show runs."""

import json
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bridgegen.base.errors import BridgeGenError, InputError, Interrupted
from bridgegen.base.plugins import is_own
from bridgegen.cli import options as common
from bridgegen.cli.app import FAILED, app
from bridgegen.cli.completion import completing
from bridgegen.cli.connection import (
    NO_CONNECTION,
    Connection,
    read_access,
    with_connection_options,
    with_device,
    with_map_folder,
)
from bridgegen.cli.declared import with_declared_options
from bridgegen.cli.run_files import (
    DATABASE,
    SAVE,
    SCENARIO,
    FiledRun,
    Key,
    Values,
    is_recorded,
    keys_of,
    schema,
    with_run_files,
)
from bridgegen.engine.options import CommonOptions, SearchOptions
from bridgegen.engine.options.forms import read_fixed, read_names, read_terms
from bridgegen.engine.options.option import DRIVER, OUTPUT, WHAT
from bridgegen.simulation.choice import EMBEDDED

if TYPE_CHECKING:
    from bridgegen.cli.verdict.fail_if import Outcome

# --- A run file of several runs: made one after the other, and resumed ---


def search_all(
    path: Path,
    runs: list[FiledRun],
    keys: Mapping[str, Key],
    command: Callable[[Values], object],
) -> None:
    """Run a file of several runs one after the other; resume those that were interrupted.

    Args:
        path: of the file.
        runs: of the file; each is recorded beside its folder, as ``FOLDER.yaml``.
        keys: of a run.
        command: searches with some options.
    """
    if status := _search_each(Path("runs") / path.stem, runs, keys, command, str(path)):
        raise typer.Exit(status)


def search_catalogue(
    given: dict[str, Any], keys: Mapping[str, Key], command: Callable[[Values], object]
) -> None:
    """Search all scenarios of the catalogue, resume what was interrupted; then write a dashboard.

    Args:
        given: what the command line states.
        keys: of a run.
        command: searches with some options.

    Raises:
        InputError: an option does not go with it.
    """
    from bridgegen.drivers.drivers import get
    from bridgegen.jobs.dashboard.dashboard import build_dashboard
    from bridgegen.jobs.search.campaign import folder_word
    from bridgegen.scenario.language.reader import names

    if extra := [name for name in (SCENARIO, SAVE, "junit", "needs") if name in given]:
        named = " and ".join(name if name == SCENARIO else f"--{name}" for name in extra)
        raise InputError(f"--catalogue searches every scenario of the catalogue: no {named}")
    driver = "own-drivers"
    if ego := given.get("ego"):
        get(ego)  # one error, and not one for each scenario
        driver = folder_word(ego)
    out = Path(given.pop("out", None) or Path("runs") / f"catalogue-{driver}")
    runs = [FiledRun(name, {**given, SCENARIO: name, "out": out / name}) for name in names()]
    status = _search_each(out, runs, keys, command, shlex.join(sys.argv[2:]))
    if any((out / run.name / DATABASE).is_file() for run in runs):
        found = build_dashboard(out)
        print()
        for line in (*found.weighed, f"{'page':<12}{found.page}"):
            print(line)
    if status:
        raise typer.Exit(status)


def _search_each(
    folder: Path,
    runs: list[FiledRun],
    keys: Mapping[str, Key],
    command: Callable[[Values], object],
    again: str,
) -> int:
    """Make runs one after the other, resume those that were interrupted; return the exit status.

    Args:
        folder: of the runs that name none.
        runs: each is recorded beside its folder, as ``FOLDER.yaml``.
        keys: of a run.
        command: searches with some options.
        again: the words of the command that goes on with all runs.
    """
    from bridgegen.cli.terminal.search import SearchProgress, conclusion, print_summary
    from bridgegen.jobs.search import Run, resume

    ends: dict[str, str] = {}
    status = 0
    for filed_run in runs:
        out = Path(filed_run.values.get("out") or folder / filed_run.name)
        values = {**filed_run.values, "out": out}
        print(f"\n{filed_run.name}", flush=True)
        try:
            # A folder's options are recorded before its run begins: a second call resumes, and
            # other options are refused.
            if not is_recorded(out, values, keys):
                command(values)
            # A run that ended before its report was written is resumed to write it.
            elif Run(out).finished and Run(out).report.is_file():
                print(f"finished already: {out}")
            else:
                with SearchProgress() as live:
                    run = resume(
                        out,
                        ego=values.get("ego"),
                        worse_than=values.get("worse_than"),
                        algorithm=values.get("algorithm"),
                        metrics=[name for name in values.get("metrics") or () if is_own(name)],
                        callbacks=live.callbacks,
                    )
                print_summary(run, live.seconds)
        except Interrupted as stop:
            # The command that goes on with all runs, and not only with this one.
            raise Interrupted(
                stop.folder, stop.evaluations, stop.budget, command=f"bridgegen search {again}"
            ) from None
        except typer.Exit as ended:
            status = max(status, ended.exit_code)
        except BridgeGenError as error:
            for problem in error.problems:
                print(f"bridgegen: error: {filed_run.name}: {problem}", file=sys.stderr)
            status, ends[filed_run.name] = 2, f"failed: {error.problems[0]}"
            continue
        ends[filed_run.name] = f"{conclusion(Run(out))} ({out})"
    print()
    for name, end in ends.items():
        print(f"{name:<{max(map(len, ends)) + 2}}{end}")
    return status


@app.command()
@with_map_folder(WHAT)
@with_device
@with_run_files(search_all, every=search_catalogue)
@with_connection_options
@with_declared_options
def search(
    options: SearchOptions,
    scenario: Annotated[
        str,
        typer.Argument(
            help="A catalogue name; or a YAML, OpenSCENARIO or run file.",
            show_default=False,
            autocompletion=completing("scenario"),
        ),
    ] = "",
    catalogue: Annotated[
        bool,
        typer.Option(
            "--catalogue",
            help="Search all scenarios that ship; one page weighs the failures.",
            rich_help_panel=WHAT,
        ),
    ] = False,
    simulator: common.Simulator = None,
    simulator_set: common.SimulatorSettings = None,
    screen: common.Screen = None,
    screen_set: common.ScreenSettings = None,
    connection: Connection = NO_CONNECTION,
    workers: common.Workers = None,
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder of the run, new.",
            show_default="runs/SCENARIO-DRIVER",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    fail_if: common.FailIf = None,
    junit: common.Junit = None,
    needs: common.Needs = None,
    verbose: common.Verbose = False,
    save: common.Save = None,
) -> None:
    """Search a scenario for critical concrete scenarios.

    In place of a scenario, a run file (docs/run-files.md) may give the scenario and all options;
    those of the command line override the file's.
    """
    from bridgegen.cli.terminal.search import SearchProgress, print_summary
    from bridgegen.cli.verdict.of_run import PassFailCriteria
    from bridgegen.jobs import search as campaign
    from bridgegen.jobs.search.scenarios import margins_of

    # Both are taken by the run file's reader, which knows what was given.
    assert save is None
    assert not catalogue
    if not scenario:
        raise InputError("missing: SCENARIO, or --catalogue for all that ship")
    criteria = PassFailCriteria.read(
        fail_if or (),
        junit,
        causes=options.causes,
        criteria=margins_of(scenario, options) if fail_if else (),
        needs=needs,
    )
    chosen, cheap = common.read_simulators(simulator, simulator_set, screen, screen_set, connection)
    options = replace(options, simulator=chosen or EMBEDDED, screen=cheap)
    with SearchProgress(options.budget) as shown:
        run = campaign.run_search(
            scenario, **vars(options), out=out, workers=workers, callbacks=shown.callbacks
        )
    print_summary(run, shown.seconds, verbose=verbose)
    _end(criteria.judge(run))


def run_file_schema() -> dict[str, object]:
    """Return the JSON Schema of run files."""
    return schema(keys_of(search))


@app.command()
def new(
    name: Annotated[
        str,
        typer.Argument(help="Name of the new scenario; writes NAME.yaml and its JSON schema."),
    ],
    like: Annotated[
        str | None,
        typer.Option(
            help="Start from a copy of this catalogue scenario, or from this OpenSCENARIO DSL file "
            "(.osc), as YAML.",
            autocompletion=completing("scenario"),
        ),
    ] = None,
    says: Annotated[
        str | None,
        typer.Option(
            help="Start from a sentence in controlled English, such as 'a car cuts in 20 m ahead'; "
            "prints each phrase beside its key, and refuses what is not understood."
        ),
    ] = None,
) -> None:
    """Write a commented scenario file to start from."""
    from bridgegen.scenario.language.starter import start_scenario

    path = start_scenario(name, like=like, says=says)
    if says is not None:
        _, *lines = path.read_text("utf-8").splitlines()  # the first one is for editors
        head = takewhile(lambda line: line.startswith("# "), lines)
        print(*(line.removeprefix("# ") for line in head), sep="\n")
    print(f"{path}: check it with 'bridgegen validate {path}', then 'bridgegen search {path}'")


@app.command()
@with_map_folder()
@with_device
@with_connection_options
def resume(
    folder: Annotated[Path, typer.Argument(help="The folder of a run.")],
    ego: common.OwnEgo = None,
    worse_than: common.OwnBaseline = None,
    algorithm: common.OwnAlgorithm = None,
    metrics: common.OwnMetrics = None,
    connection: Connection = NO_CONNECTION,
    workers: common.Workers = None,
    fail_if: common.FailIf = None,
    junit: common.Junit = None,
    needs: common.Needs = None,
    verbose: common.Verbose = False,
) -> None:
    """Resume an interrupted run.

    The result is as if it had not been interrupted.
    """
    from bridgegen.cli.terminal.search import SearchProgress, print_summary
    from bridgegen.cli.verdict.of_run import PassFailCriteria
    from bridgegen.jobs import search as campaign

    criteria = PassFailCriteria.of_run(fail_if or (), junit, folder, needs)
    with SearchProgress() as live:
        run = campaign.resume(
            folder,
            ego=ego,
            worse_than=worse_than,
            algorithm=algorithm,
            metrics=read_names(metrics),
            simulator=read_access(connection),
            workers=workers,
            callbacks=live.callbacks,
        )
    print_summary(run, live.seconds, verbose=verbose)
    _end(criteria.judge(run))


@app.command()
@with_map_folder()
@with_connection_options
def simulate(
    scenario: Annotated[
        str,
        typer.Argument(
            help="An OpenSCENARIO file (.xosc); or a catalogue name, a YAML or .osc file, of "
            "which one row is simulated.",
            autocompletion=completing("scenario"),
        ),
    ],
    fix: common.Fix = None,
    distribution: common.Distribution = None,
    odd: common.Odd = None,
    road_map: common.RoadMap = None,
    junction: common.Junction = None,
    objective: common.Objective = None,
    critical: common.Critical = None,
    ego: Annotated[
        str | None,
        typer.Option(
            help="Driver of the ego; the file's or the scenario's by default.",
            rich_help_panel=DRIVER,
            autocompletion=completing("driver"),
        ),
    ] = None,
    ideal: common.Ideal = None,
    vehicle: common.Vehicle = None,
    others: common.Others = None,
    empty_trigger: common.EmptyTrigger = None,
    time_limit: common.TimeLimit = None,
    dt: Annotated[
        float | None,
        typer.Option(help="Time step [s].", show_default="that of the file's header, or 0.05"),
    ] = None,
    trace: Annotated[
        Path | None,
        typer.Option(
            help="A new .csv of every entity's time, x, y, h and speed; or a new .mcap of ASAM "
            "OSI: SensorView if its name ends in _sv.mcap, else GroundTruth.",
            rich_help_panel=OUTPUT,
        ),
    ] = None,
    metrics: common.OnlyMetrics = None,
    simulator: common.Simulator = None,
    simulator_set: common.SimulatorSettings = None,
    connection: Connection = NO_CONNECTION,
    lenient: Annotated[
        bool, typer.Option("--lenient", help="Leave out what is not supported, with a warning.")
    ] = False,
    criterion: common.Criterion = None,
    fail_if: common.FileFailIf = None,
    junit: common.Junit = None,
    as_json: common.Json = False,
) -> None:
    """Simulate one scenario; print its metrics.

    Also prints its decisive conflict. Of a logical scenario it is the row with the parameters of
    --fix, and the others at their defaults, as a search simulates it.
    """
    from bridgegen.cli.terminal.files import conflict_facts, criteria_facts, print_file_result
    from bridgegen.cli.verdict.of_file import FileCriteria
    from bridgegen.drivers import split
    from bridgegen.engine.simulate import simulate_file
    from bridgegen.openx.openscenario.tier4 import is_storyboard
    from bridgegen.simulation.trace import write_trace

    criteria = FileCriteria.read(fail_if or (), junit, criterion or ())
    stages = None if ideal is None else split(ideal)
    skipped: list[str] | None = [] if lenient else None
    file, runs = Path(scenario), common.read_simulator(simulator, simulator_set, connection)
    is_logical = file.suffix.lower() in (".yaml", ".yml", ".osc") or not (
        file.suffix or file.exists()
    )
    is_logical = is_logical and not is_storyboard(file)
    if is_logical or fix or distribution or odd:
        from bridgegen.jobs.search.model import simulate_scenario  # takes longer than a file

        if dt is not None or lenient:
            raise InputError("--dt and --lenient are for one scenario file, as it is")
        options = CommonOptions(
            ego=ego, ideal=stages or (), vehicle=vehicle, others=others, time_limit=time_limit,
            empty_trigger=empty_trigger, fixed=read_fixed(fix, "--fix"), distribution=distribution,
            odd=odd, road_map=road_map, junction=junction, critical=critical,
            objective=read_terms(objective, "--objective"), metrics=read_names(metrics),
            criteria=[one.to_dict() for one in criteria.criteria],
        )  # fmt: skip
        result = simulate_scenario(scenario, options, runs or EMBEDDED, criteria.metrics)
    elif road_map or junction or objective or critical:
        raise InputError(
            f"--map, --place, --objective and --critical are for a logical scenario, got {scenario}"
        )
    else:
        result = simulate_file(
            file, ego=ego, ideal=stages, vehicle=vehicle, others=others,
            empty_trigger=empty_trigger or "never", time_limit=time_limit,
            metrics=read_names(metrics), also=criteria.metrics, time_step=dt, skipped=skipped,
            simulator=runs or EMBEDDED, criteria=criteria.criteria,
        )  # fmt: skip
    for name in skipped or ():
        print(f"bridgegen: warning: left out: {name}", file=sys.stderr)
    for note in result.notes:
        print(f"bridgegen: note: {note}", file=sys.stderr)
    if trace is not None:
        write_trace(trace, result.rollout, around=result.around)
    if as_json:
        facts: dict[str, object] = {
            "file": str(file),
            "ego": result.driver,
            "status": result.status,
        }
        values = {k: v if abs(v) < float("inf") else None for k, v in result.metrics.items()}
        facts |= {"criteria": criteria_facts(result.criteria)}
        facts |= {"cause": result.cause, "parameters": result.parameters, "metrics": values}
        facts |= conflict_facts(result.conflicts) | {"unjudged": result.unjudged}
        if result.incidents:
            step = result.rollout.time_step
            facts["incidents"] = [
                {"time": incident.step * step, "kind": incident.kind, "what": incident.what}
                for incident in result.incidents
            ]
        print(json.dumps(facts, indent=2))
    else:
        print_file_result(file, result)
    _end(criteria.judge(file, result))


def _end(outcomes: "Sequence[Outcome]") -> None:
    """Print the outcomes of the criteria; exit with their status if one failed."""
    from bridgegen.cli.terminal.tables import print_outcomes

    if not print_outcomes(outcomes):
        raise typer.Exit(FAILED)
