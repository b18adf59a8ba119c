"""Functions whose arguments are checked: those that take the fields of a dataclass as keywords."""

import inspect
from collections.abc import Callable
from dataclasses import fields
from functools import wraps
from numbers import Integral
from typing import Any, ParamSpec, TypeVar

from bridgegen.base.errors import InputError, UnknownNameError

P = ParamSpec("P")
Arguments = TypeVar("Arguments")
Result = TypeVar("Result")


def called_with(
    arguments: Callable[P, Arguments],
) -> Callable[[Callable[[Arguments], Result]], Callable[P, Result]]:
    """Turn a function of one dataclass object into a function of that dataclass's fields.

    Its signature is that of the dataclass, and the section ``Args:`` of its docstring is made of
    the fields' metadata, ``help`` and ``option``. A wrong argument is an ``InputError``.

    Args:
        arguments: the dataclass.
    """

    def decorate(function: Callable[[Arguments], Result]) -> Callable[P, Result]:
        signature = inspect.signature(arguments)

        @wraps(function)
        def call(*given: P.args, **named: P.kwargs) -> Result:
            _require_signature(function.__name__, signature, given, named)
            made = arguments(*given, **named)
            _require_types(made)
            return function(made)

        call.__signature__ = signature.replace(  # type: ignore[attr-defined]
            return_annotation=inspect.signature(function).return_annotation
        )
        text = inspect.cleandoc(function.__doc__ or "")
        summary, returns, rest = text.partition("Returns:\n")
        call.__doc__ = f"{summary}{_described(arguments, signature)}\n{returns}{rest}"
        return call

    return decorate


def checked(function: Callable[P, Result]) -> Callable[P, Result]:
    """Return a function that refuses arguments which it does not have by an ``InputError``."""
    signature = inspect.signature(function)

    @wraps(function)
    def call(*given: P.args, **named: P.kwargs) -> Result:
        _require_signature(function.__name__, signature, given, named)
        return function(*given, **named)

    return call


def _require_signature(
    name: str, signature: inspect.Signature, given: tuple[Any, ...], named: dict[str, Any]
) -> None:
    """Refuse arguments that a function does not have, or lacks.

    Raises:
        InputError: for the first of them.
    """
    for one in named:
        if one not in signature.parameters:
            raise UnknownNameError(f"argument of {name}", one, signature.parameters)
    try:
        signature.bind(*given, **named)
    except TypeError as error:
        raise InputError(f"{name}: {error}") from None


def _require_types(arguments: Any) -> None:
    """Refuse values of the wrong type, but for options, which check their own.

    Raises:
        InputError: names all of them.
    """
    problems = []
    for one in fields(arguments):
        value = getattr(arguments, one.name)
        is_whole = isinstance(value, Integral) and not isinstance(value, bool)
        try:
            fits = isinstance(int(value) if is_whole else value, one.type)  # type: ignore[arg-type]
        except TypeError:  # the type is of elements, too
            continue
        if "option" not in one.metadata and not fits and not (one.type is float and is_whole):
            kind = inspect.formatannotation(one.type)
            problems.append(f"{one.name} must be {kind}, got {value!r}")
    if problems:
        raise InputError(*problems)


def _described(arguments: Any, signature: inspect.Signature) -> str:
    """Return the section ``Args:`` of a docstring."""
    declared = {one.name: one.metadata for one in fields(arguments)}
    lines = ["Args:"]
    for name in signature.parameters:
        option = declared[name].get("option")
        shown = f" (default: {option.shown})" if option and option.shown else ""
        lines.append(f"    {name}: {declared[name]['help'].rstrip('.')}{shown}.")
    return "\n".join(lines) + "\n"
