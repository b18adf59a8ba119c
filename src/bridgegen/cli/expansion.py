"""Expands one parameter of a command's function into many options."""

import inspect
from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any


def expand(
    command: Callable[..., None],
    parameter: str,
    options: Mapping[str, tuple[Any, Any]],
    fold: Callable[[dict[str, Any]], Any],
) -> Callable[..., None]:
    """Return a command with options in place of one of its parameters.

    Args:
        command: a function whose signature is read by typer.
        parameter: the name of the one that is replaced.
        options: annotation and default of each option, by the name of its parameter.
        fold: returns the replaced parameter's value from those of the options.
    """
    signature = inspect.signature(command)
    parameters = []
    for one in signature.parameters.values():
        if one.name != parameter:
            parameters.append(one)
            continue
        for name, (annotation, default) in options.items():
            parameters.append(one.replace(name=name, annotation=annotation, default=default))

    @wraps(command)
    def wrapper(**values: Any) -> None:
        folded = fold({name: values.pop(name) for name in options})
        command(**values, **{parameter: folded})

    wrapper.__signature__ = signature.replace(parameters=parameters)  # type: ignore[attr-defined]
    wrapper.__annotations__ = {one.name: one.annotation for one in parameters}
    return wrapper
