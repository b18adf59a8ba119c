"""The option that says where the maps are that files call by CARLA's names."""

import inspect
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import Annotated, Any

import typer

from bridgegen.base.errors import InputError


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

        one = inspect.Parameter(
            "maps", inspect.Parameter.KEYWORD_ONLY, default=None, annotation=option
        )
        made = [*signature.parameters.values(), one]
        wrapper.__signature__ = signature.replace(parameters=made)  # type: ignore[attr-defined]
        wrapper.__annotations__ = {one.name: one.annotation for one in made}
        return wrapper

    return decorate


@contextmanager
def _root(maps: Path | None) -> Iterator[None]:
    """Look for maps in a folder, meanwhile; in that of the environment where there is none.

    Raises:
        InputError: it is no folder.
    """
    from bridgegen.openx.opendrive.carla_maps import ROOT

    if maps is None:
        yield
        return
    if not maps.is_dir():
        raise InputError(f"{maps}: --maps must be a folder, and is none")
    before = os.environ.get(ROOT)
    os.environ[ROOT] = str(maps)
    try:
        yield
    finally:
        del os.environ[ROOT]
        if before is not None:
            os.environ[ROOT] = before
