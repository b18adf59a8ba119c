"""A user's own additions to a scenario: functions that a scenario file names under ``effects``.

Such a function is called with the `Builder` of each concrete scenario and the values of all its
parameters, after the scenario's own individuals are there, and adds its own: with
``builder.quantity(node, property, "my_parameter")`` they carry a parameter's value, and so do the
files that are made of them. It adds the same individuals whatever the values: one storyboard
serves all rows.

What a scenario file may run is limited to what its user has put there: a function of a Python
file in the same folder, or one that an installed package offers by the entry point group
``bridgegen.effects``.
"""

import importlib.util
from collections.abc import Callable, Mapping
from functools import lru_cache
from importlib.metadata import entry_points
from pathlib import Path

from bridgegen.base.errors import BridgeGenError, InputError
from bridgegen.scenario.language.parameters import nearest
from bridgegen.scenario.ontology.builder import Builder

GROUP = "bridgegen.effects"
"""The entry point group of effects that packages offer."""

Effect = Callable[[Builder, Mapping[str, float]], None]


def apply_effect(spec: str, place: str, builder: Builder, values: Mapping[str, float]) -> None:
    """Let a user's function add its individuals.

    Args:
        spec: ``file.py:function``, beside the scenario's file, or the name of an entry point.
        place: the scenario's file.
        builder: holds the scenario's own individuals.
        values: of all parameters.

    Raises:
        InputError: there is no such function, or it failed.
    """
    function = _load(spec, str(Path(place).resolve().parent))
    try:
        function(builder, values)
    except BridgeGenError:
        raise
    except Exception as error:
        raise InputError(f"effect '{spec}' failed: {_described(error)} ({place})") from error


@lru_cache(maxsize=64)
def _load(spec: str, folder: str) -> Effect:
    source, _, name = spec.rpartition(":")
    if not source:
        return _offered(spec)
    if not source.endswith(".py") or Path(source).name != source or not name.isidentifier():
        raise InputError(
            f"an effect is 'file.py:function' beside the scenario's file, or the name of an entry "
            f"point of the group {GROUP}, got '{spec}'"
        )
    path = Path(folder) / source
    if not path.is_file():
        raise InputError(f"effect '{spec}': no such file: {path}")
    found = importlib.util.spec_from_file_location(f"bridgegen_effect_{path.stem}", path)
    assert found is not None  # of a .py file there is one
    assert found.loader is not None
    module = importlib.util.module_from_spec(found)
    try:
        found.loader.exec_module(module)
    except Exception as error:
        raise InputError(f"effect '{spec}': {source} fails: {_described(error)}") from error
    return _callable(spec, getattr(module, name, None))


def _offered(spec: str) -> Effect:
    """Return the function that an installed package offers by a name."""
    offered = {one.name: one for one in entry_points(group=GROUP)}
    if spec not in offered:
        raise InputError(
            f"no installed package offers the effect '{spec}'{nearest(spec, offered)}; a function "
            "of your own is 'file.py:function'"
        )
    try:
        return _callable(spec, offered[spec].load())
    except (ImportError, AttributeError) as error:
        raise InputError(f"effect '{spec}' cannot be loaded: {_described(error)}") from error


def _callable(spec: str, found: object) -> Effect:
    if not callable(found):
        raise InputError(f"effect '{spec}' must be a function, got {type(found).__name__}")
    effect: Effect = found
    return effect


def _described(error: Exception) -> str:
    """Return an error on one line, with the line of the user's file where it came up."""
    line, trace = 0, error.__traceback__
    while trace is not None:
        line, trace = trace.tb_lineno, trace.tb_next
    where = f", line {getattr(error, 'lineno', None) or line}"
    return f"{type(error).__name__}: {' '.join(str(error).split())}{where}"
