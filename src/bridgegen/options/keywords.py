"""Functions that take the fields of a dataclass as keywords, checked by type checkers."""

import inspect
from collections.abc import Callable
from dataclasses import fields
from functools import wraps
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
Arguments = TypeVar("Arguments")
Result = TypeVar("Result")


def called_with(
    arguments: Callable[P, Arguments],
) -> Callable[[Callable[[Arguments], Result]], Callable[P, Result]]:
    """Turn a function of one dataclass object into a function of that dataclass's fields.

    Its signature is that of the dataclass, and the section ``Args:`` of its docstring is made of
    the fields' metadata, ``help`` and ``option``.

    Args:
        arguments: the dataclass.
    """

    def decorate(function: Callable[[Arguments], Result]) -> Callable[P, Result]:
        @wraps(function)
        def call(*given: P.args, **named: P.kwargs) -> Result:
            return function(arguments(*given, **named))

        signature = inspect.signature(arguments)
        call.__signature__ = signature.replace(  # type: ignore[attr-defined]
            return_annotation=inspect.signature(function).return_annotation
        )
        text = inspect.cleandoc(function.__doc__ or "")
        summary, returns, rest = text.partition("Returns:\n")
        call.__doc__ = f"{summary}{_described(arguments, signature)}\n{returns}{rest}"
        return call

    return decorate


def _described(arguments: Any, signature: inspect.Signature) -> str:
    """Return the section ``Args:`` of a docstring."""
    declared = {one.name: one.metadata for one in fields(arguments)}
    lines = ["Args:"]
    for name in signature.parameters:
        option = declared[name].get("option")
        shown = f" (default: {option.shown})" if option and option.shown else ""
        lines.append(f"    {name}: {declared[name]['help'].rstrip('.')}{shown}.")
    return "\n".join(lines) + "\n"
