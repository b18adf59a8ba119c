"""The options that several commands share and no run records, and how they are parsed."""

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from bridgegen.base.errors import InputError
from bridgegen.cli.completion import completing
from bridgegen.cli.connection import Connection
from bridgegen.cli.declared import declaration
from bridgegen.engine.options.forms import read_settings
from bridgegen.engine.options.option import DRIVER, OBJECTIVE, OUTPUT, SEARCH, SIMULATOR
from bridgegen.simulation.choice import SIMULATORS, SimulatorChoice

Save = Annotated[
    Path | None,
    typer.Option(
        help="Write a new run file (.yaml) that repeats this call.", rich_help_panel=OUTPUT
    ),
]
Json = Annotated[
    bool, typer.Option("--json", help="Print JSON for machines.", rich_help_panel=OUTPUT)
]

Verbose = Annotated[
    bool,
    typer.Option(
        "--verbose",
        "-v",
        help="Print all figures, too, and each failure mode in full.",
        rich_help_panel=OUTPUT,
    ),
]


def _text(spelling: str, help: str, panel: str) -> Any:
    return typer.Option(spelling, help=help, rich_help_panel=panel)


OwnEgo = Annotated[str | None, _text("--ego", "The run's driver, if it is your own.", DRIVER)]
OwnBaseline = Annotated[
    str | None, _text("--worse-than", "The run's baseline, if it is your own driver.", DRIVER)
]
OwnAlgorithm = Annotated[
    str | None, _text("--algorithm", "The run's algorithm, if it is your own.", SEARCH)
]
OwnMetrics = Annotated[
    str | None,
    _text("--metrics", "The run's metrics of your own, separated by commas.", OUTPUT),
]
Ideal = Annotated[str | None, declaration("ideal", shown="the file's")]
Vehicle = Annotated[str | None, declaration("vehicle")]
TimeLimit = Annotated[float | None, declaration("time_limit")]
OnlyMetrics = Annotated[
    str | None,
    typer.Option(
        "--metrics",
        help="Metrics to report, e.g. pet,drac.",
        show_default="all",
        rich_help_panel=OUTPUT,
        autocompletion=completing("metric"),
    ),
]
Fix = Annotated[list[str] | None, declaration("fixed", shown="their defaults")]
Distribution = Annotated[Path | None, declaration("distribution")]
Objective = Annotated[str | None, declaration("objective")]
Critical = Annotated[str | None, declaration("critical")]
EmptyTrigger = Annotated[str | None, declaration("empty_trigger")]
Others = Annotated[str | None, declaration("others", shown="the file's")]
Simulator = Annotated[
    str | None,
    typer.Option(
        help="See 'bridgegen list simulators'.",
        show_default="embedded",
        rich_help_panel=SIMULATOR,
        autocompletion=completing("simulator"),
    ),
]
Screen = Annotated[
    str | None,
    typer.Option(
        help="Cheap simulator (low fidelity) beside a slow one, in which the algorithm searches "
        "for what the simulator evaluates; with --rate, models learn what it is worth.",
        show_default="none",
        rich_help_panel=SIMULATOR,
        autocompletion=completing("simulator"),
    ),
]
_SETTING = "A setting of the {}, NAME=VALUE; may be repeated."
ScreenSettings = Annotated[
    list[str] | None, _text("--screen-set", _SETTING.format("screen"), SIMULATOR)
]
SimulatorSettings = Annotated[
    list[str] | None, _text("--simulator-set", _SETTING.format("simulator"), SIMULATOR)
]
Odd = Annotated[Path | None, declaration("odd")]
RoadMap = Annotated[Path | None, declaration("road_map")]
Junction = Annotated[str | None, declaration("junction")]
Workers = Annotated[
    str | None,
    typer.Option(
        help="Number of worker processes, or 'ray' / 'ray://HOST:PORT' for a Ray cluster (extra "
        "ray). No result depends on it.",
        show_default="threads of one process, one for each core",
        rich_help_panel=SEARCH,
    ),
]
RunWorkers = Annotated[
    str | None,
    typer.Option(
        "--workers",
        help="Number of runs at a time, each in a process; or 'ray' / 'ray://HOST:PORT': a Ray "
        "cluster (extra ray) simulates their scenarios. No result depends on it.",
        show_default="one on each core",
        rich_help_panel=SEARCH,
    ),
]


def _fail_if(what: str) -> Any:
    return typer.Option(
        "--fail-if",
        help=f"End with exit status 3 if this holds{what}; may be repeated.",
        show_default=False,
        rich_help_panel=OUTPUT,
    )


FailIf = Annotated[list[str] | None, _fail_if(", e.g. 'r_critic > 0.1'")]
FileFailIf = Annotated[list[str] | None, _fail_if(" of its metrics, e.g. 'd_min < 2 and v_d >= 1'")]
ConfirmFailIf = Annotated[list[str] | None, _fail_if(", e.g. 'confirmed < 0.95'")]
Criterion = Annotated[
    list[str] | None,
    typer.Option(
        help="Pass criterion: 'ID: FORMULA', or a YAML file with a list of criteria; the exit "
        "status is 3 if it is violated. May be repeated.",
        show_default="those that the file states",
        rich_help_panel=OBJECTIVE,
    ),
]
Exposure = Annotated[
    str | None,
    typer.Option(
        help="How its parameters are distributed on the road: a file (.yaml), an example of "
        "'bridgegen list exposures', or uniform.",
        show_default="the exposure in the scenario's file",
    ),
]
Junit = Annotated[
    Path | None,
    typer.Option(
        help="Write the verdict as JUnit XML, for Jenkins, GitLab …", rich_help_panel=OUTPUT
    ),
]
Needs = Annotated[
    Path | None,
    typer.Option(
        help="Write the pass criteria with their results as needs.json, for sphinx-needs.",
        rich_help_panel=OUTPUT,
    ),
]


def read_simulator(
    name: str | None, settings: list[str] | None, connection: Connection
) -> SimulatorChoice | None:
    """Read the choice of a simulator; None if none is named.

    Args:
        name: of the simulator.
        settings: ``name=value`` pairs.
        connection: to the simulator.

    Raises:
        InputError: settings or a connection without a name.
    """
    if name is None:
        if settings or connection:
            what = ", ".join([*connection, *(["--simulator-set"] if settings else [])])
            raise InputError(f"{what}: name the simulator that it is for (--simulator)")
        return None
    return SimulatorChoice(name, read_settings(settings, "--simulator-set"), connection)


def read_simulators(
    name: str | None,
    settings: list[str] | None,
    screen: str | None,
    screen_settings: list[str] | None,
    connection: Connection,
) -> tuple[SimulatorChoice | None, SimulatorChoice | None]:
    """Read the choices of a search's simulator and of its screen; None if none is named.

    Args:
        name: of the simulator.
        settings: ``name=value`` pairs.
        screen: name of the screen.
        screen_settings: likewise.
        connection: to either; what is for the screen alone is the screen's.

    Raises:
        InputError: settings or a connection without a name.
    """
    if screen is None:
        if screen_settings:
            raise InputError("--screen-set: name the screen that it is for (--screen)")
        return read_simulator(name, settings, connection), None
    chosen = SimulatorChoice(screen, read_settings(screen_settings, "--screen-set"))
    for_screen = {k: v for k, v in connection.items() if k in SIMULATORS[screen].access}
    own = SIMULATORS[name].access if name and name in SIMULATORS else {}
    left = {k: v for k, v in connection.items() if k in own or k not in for_screen}
    return read_simulator(name, settings, left), replace(chosen, access=for_screen)
