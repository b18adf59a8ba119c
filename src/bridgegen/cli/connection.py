"""Options that commands share: connections to simulators, the folder of maps, the device."""

import inspect
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import wraps
from inspect import signature
from pathlib import Path
from typing import Annotated, Any

import typer

from bridgegen.base.cuda import DEVICE
from bridgegen.base.errors import InputError
from bridgegen.cli.declared import expand, with_parameters
from bridgegen.engine.options.option import SEARCH, SIMULATOR
from bridgegen.simulation.choice import SIMULATORS, SimulatorChoice, Value

Connection = Mapping[str, Value]
"""A connection to a simulator: values by the spelling of their options."""

NO_CONNECTION: Connection = {}


def _option(kind: type, help: str, default: str | bool = False) -> Any:
    option = typer.Option(rich_help_panel=SIMULATOR, help=help, show_default=default)
    return Annotated[kind | None, option]


OPTIONS: Mapping[str, Any] = {
    "esmini_lib": _option(
        Path, "esmini's library, libesminiLib.so, for esmini.", "ESMINI_LIB of the environment"
    ),
    "host": _option(str, "The server's machine, for CARLA.", "localhost"),
    "port": _option(int, "The server's port, for CARLA.", "2000"),
    "carla_command": _option(
        str, "Command that starts a CARLA server, also after a crash.", "none"
    ),
    "carla_timeout": _option(float, "Time limit of an answer of CARLA [s].", "20"),
    "record": _option(
        Path, "A new folder for camera images, LiDAR points, boxes and incidents, with CARLA."
    ),
    "detector": _option(
        str,
        "A detector of your own that looks at CARLA's images: module:Class, file.py:Class.",
    ),
}
"""Connection options that the simulators declare, by parameter name."""


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
    owners = [
        simulator.name
        for simulator in SIMULATORS.values()
        if {*connection} & simulator.access.keys()
    ]
    return SimulatorChoice(owners[0], access=connection) if owners else None


# --- The option that says where the maps are that files call by CARLA's names ---


def with_map_folder(
    panel: str | None = None,
) -> Callable[[Callable[..., Any]], Callable[..., None]]:
    """Return what gives a command the option ``--maps``; it holds for its processes, too.

    Args:
        panel: the group of the command's help that lists it.
    """
    option = Annotated[
        Path | None,
        typer.Option(
            "--maps",
            help="Folder of maps that are called by name (Town01): CARLA's, or any of .xodr files.",
            show_default="CARLA_ROOT",
            rich_help_panel=panel,
        ),
    ]

    def decorate(command: Callable[..., Any]) -> Callable[..., None]:
        signature = inspect.signature(command)

        @wraps(command)
        def wrapper(*, maps: Path | None = None, **values: Any) -> None:
            with _root(maps):
                command(**values)

        parameter = inspect.Parameter(
            "maps", inspect.Parameter.KEYWORD_ONLY, default=None, annotation=option
        )
        return with_parameters(wrapper, [*signature.parameters.values(), parameter])

    return decorate


@contextmanager
def _root(maps: Path | None) -> Iterator[None]:
    """Look for maps in a folder, meanwhile; in that of the environment where there is none.

    Raises:
        InputError: it is no folder.
    """
    from bridgegen.openx.opendrive.road_map import ROOT

    if maps is not None and not maps.is_dir():
        raise InputError(f"{maps}: --maps must be a folder, and is none")
    with _environment(ROOT, None if maps is None else str(maps)):
        yield


@contextmanager
def _environment(variable: str, value: str | None) -> Iterator[None]:
    """Set a variable meanwhile, unless the value is None; for processes that begin, too."""
    before = os.environ.get(variable)
    if value is not None:
        os.environ[variable] = value
    try:
        yield
    finally:
        if value is not None:
            del os.environ[variable]
            if before is not None:
                os.environ[variable] = before


# --- The option that says on which device rows are simulated ---


def with_device(command: Callable[..., Any]) -> Callable[..., None]:
    """Give a command the option ``--device``, on which no result depends."""
    option = Annotated[
        str | None,
        typer.Option(
            help="cuda: a GPU of NVIDIA's simulates. No result depends on it.",
            show_default="the processor",
            rich_help_panel=SEARCH,
        ),
    ]
    signature = inspect.signature(command)

    @wraps(command)
    def wrapper(*, device: str | None = None, **values: Any) -> None:
        with _environment(DEVICE, device):
            if device is not None:
                from bridgegen.simulation.embedded.device import current

                if str(values.get("workers") or "").startswith("ray"):
                    raise InputError(f"--device {device} is this machine's, got --workers ray")
                current()
            command(**values)

    parameter = inspect.Parameter(
        "device", inspect.Parameter.KEYWORD_ONLY, default=None, annotation=option
    )
    return with_parameters(wrapper, [*signature.parameters.values(), parameter])
