"""The options that say where a simulator is on this machine; several commands have them all."""

import inspect
from collections.abc import Callable, Mapping
from functools import wraps
from pathlib import Path
from typing import Annotated, Any

import typer

from bridgegen.simulation.choice import SIMULATORS, SimulatorChoice, Value

Where = Mapping[str, Value]
"""What was said of where simulators are, by the name of the option."""

NOWHERE: Where = {}

OPTIONS: Mapping[str, Any] = {
    "esmini_lib": Annotated[
        Path | None,
        typer.Option(
            help="esmini's library, libesminiLib.so, for --simulator esmini.",
            show_default="ESMINI_LIB of the environment",
        ),
    ],
    "host": Annotated[
        str | None,
        typer.Option(help="The server's machine, for --simulator carla.", show_default="localhost"),
    ],
    "port": Annotated[
        int | None,
        typer.Option(help="The server's port, for --simulator carla.", show_default="2000"),
    ],
    "carla_command": Annotated[
        str | None,
        typer.Option(
            help="Starts a CARLA server, and again when it has ended.", show_default="none"
        ),
    ],
    "carla_timeout": Annotated[
        float | None,
        typer.Option(help="Seconds that an answer of CARLA's may take.", show_default="20"),
    ],
    "record": Annotated[
        Path | None,
        typer.Option(
            help="A new folder for camera images, LiDAR points, boxes and incidents, with "
            "--simulator carla."
        ),
    ],
    "detector": Annotated[
        str | None,
        typer.Option(
            help="A detector of your own that looks at CARLA's images: module:Class, file.py:Class."
        ),
    ],
}
"""By parameter: those that the simulators declare."""


def located(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command these options; it is told as ``where`` what was said of them.

    Where it has one of the same name for something else, ours begins with ``--carla-``.
    """
    signature = inspect.signature(command)
    named = {f"carla_{name}" if name in signature.parameters else name: name for name in OPTIONS}
    parameters = []
    for one in signature.parameters.values():
        if one.name != "where":
            parameters.append(one)
            continue
        for name, known_as in named.items():
            kind = OPTIONS[known_as]
            parameters.append(one.replace(name=name, annotation=kind, default=None))

    @wraps(command)
    def told(**given: Any) -> None:
        said = {known_as: given.pop(name) for name, known_as in named.items()}
        where = {
            f"--{name.replace('_', '-')}": str(value) if isinstance(value, Path) else value
            for name, value in said.items()
            if value is not None
        }
        command(**given, where=where)

    told.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    told.__annotations__ = {one.name: one.annotation for one in parameters}
    return told


def read_access(where: Where) -> SimulatorChoice | None:
    """Return where a run's simulator is said to be; nothing is where it is by default."""
    owners = [one.name for one in SIMULATORS.values() if {*where} & one.access.keys()]
    return SimulatorChoice(owners[0], access=where) if owners else None
