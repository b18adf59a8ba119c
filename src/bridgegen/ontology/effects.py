"""A user's own additions to a scenario: functions that a scenario file names under ``effects``.

Such a function is called with the `Builder` of each concrete scenario and the values of all its
parameters, after the scenario's own individuals are there, and adds its own: with
``builder.quantity(node, property, "my_parameter")`` they carry a parameter's value, and so do the
files that are made of them.
"""

import importlib
import importlib.util
from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path

from bridgegen.errors import InputError
from bridgegen.ontology.builder import Builder

Effect = Callable[[Builder, Mapping[str, float]], None]


def load_effect(spec: str, place: str) -> Effect:
    """Return the function that a scenario file names.

    Args:
        spec: ``package.module:function``, or ``file.py:function`` beside the scenario's file.
        place: the scenario's file.

    Raises:
        InputError: there is none such.
    """
    return _load(spec, str(Path(place).resolve().parent))


@lru_cache(maxsize=64)
def _load(spec: str, folder: str) -> Effect:
    source, colon, name = spec.rpartition(":")
    if not colon or not name.isidentifier():
        raise InputError(f"an effect is 'module:function' or 'file.py:function', got '{spec}'")
    try:
        if source.endswith(".py"):
            path = Path(folder) / source
            found = importlib.util.spec_from_file_location(path.stem, path)
            if found is None or found.loader is None or not path.is_file():
                raise InputError(f"effect '{spec}': no such file: {path}")
            module = importlib.util.module_from_spec(found)
            found.loader.exec_module(module)
        else:
            module = importlib.import_module(source)
    except ImportError as error:
        raise InputError(f"effect '{spec}' cannot be imported: {error}") from None
    except SyntaxError as error:
        raise InputError(f"effect '{spec}' is no Python: {error}") from None
    function = getattr(module, name, None)
    if not callable(function):
        raise InputError(f"effect '{spec}': {source} has no function '{name}'")
    effect: Effect = function
    return effect
