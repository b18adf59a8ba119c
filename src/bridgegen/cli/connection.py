"""The options of the connection to a simulator, which several commands share."""

from collections.abc import Callable, Mapping
from inspect import signature
from pathlib import Path
from typing import Annotated, Any

import typer

from bridgegen.cli.expansion import expand
from bridgegen.engine.options.option import SIMULATOR
from bridgegen.simulation.choice import SIMULATORS, SimulatorChoice, Value

Connection = Mapping[str, Value]
"""A connection to a simulator: values by the spelling of their options."""

NO_CONNECTION: Connection = {}

OPTIONS: Mapping[str, Any] = {
    "esmini_lib": Annotated[
        Path | None,
        typer.Option(
            rich_help_panel=SIMULATOR,
            help="esmini's library, libesminiLib.so, for esmini.",
            show_default="ESMINI_LIB of the environment",
        ),
    ],
    "host": Annotated[
        str | None,
        typer.Option(
            rich_help_panel=SIMULATOR,
            help="The server's machine, for CARLA.",
            show_default="localhost",
        ),
    ],
    "port": Annotated[
        int | None,
        typer.Option(
            rich_help_panel=SIMULATOR,
            help="The server's port, for CARLA.",
            show_default="2000",
        ),
    ],
    "carla_command": Annotated[
        str | None,
        typer.Option(
            rich_help_panel=SIMULATOR,
            help="Command that starts a CARLA server, also after a crash.",
            show_default="none",
        ),
    ],
    "carla_timeout": Annotated[
        float | None,
        typer.Option(
            rich_help_panel=SIMULATOR,
            help="Time limit of an answer of CARLA [s].",
            show_default="20",
        ),
    ],
    "record": Annotated[
        Path | None,
        typer.Option(
            rich_help_panel=SIMULATOR,
            help="A new folder for camera images, LiDAR points, boxes and incidents, with CARLA.",
        ),
    ],
    "detector": Annotated[
        str | None,
        typer.Option(
            rich_help_panel=SIMULATOR,
            help="A detector of your own that looks at CARLA's images: module:Class, "
            "file.py:Class.",
        ),
    ],
}
"""By parameter: those that the simulators declare."""


def with_connection_options(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command these options in place of its parameter ``connection``.

    Where it has an option of the same name, these begin with ``--carla-``.
    """
    own = signature(command).parameters
    known_as = {f"carla_{name}" if name in own else name: name for name in OPTIONS}

    def fold(values: dict[str, Any]) -> Connection:
        return {
            f"--{known_as[name].replace('_', '-')}": str(value)
            if isinstance(value, Path)
            else value
            for name, value in values.items()
            if value is not None
        }

    options = {name: (OPTIONS[known], None) for name, known in known_as.items()}
    return expand(command, "connection", options, fold)


def read_access(connection: Connection) -> SimulatorChoice | None:
    """Return the choice of the simulator that a connection is for; None for no connection."""
    owners = [one.name for one in SIMULATORS.values() if {*connection} & one.access.keys()]
    return SimulatorChoice(owners[0], access=connection) if owners else None
