"""What a field of an options class declares, and functions that take these fields as keywords."""

import inspect
from collections.abc import Callable
from dataclasses import MISSING, dataclass, fields, replace
from functools import wraps
from numbers import Integral
from typing import Any, Final, ParamSpec, TypeVar

from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.engine.options.forms import Form

# An option used to be listed in nine to fourteen files: two commands, five signatures, the record
# and its reader among them. All are derived from one declaration.
WHAT, SEARCH, OBJECTIVE, DRIVER, SIMULATOR, OUTPUT = GROUPS = (
    "What to search",
    "Search",
    "Objective",
    "Driver",
    "Simulator",
    "Output",
)
"""The groups in which the help of a command lists its options."""

ALWAYS: Final = object()
"""Value of ``before`` of an option that every run records."""


@dataclass(frozen=True)
class Option:
    """An option of a run.

    Attributes:
        form: how its value is written on a command line.
        spelling: its name there, ``--fix`` say; empty for the field's name.
        hint: how to write the value there; a whole sentence.
        shown: the default in words, where the value does not say it.
        limits: the least and the greatest value, both allowed; None where there are none.
        before: the value of a run that does not record the option, since the run is older than
            the option; ALWAYS where there is no such run.
        group: one of GROUPS.
        names: what a shell completes its value with: "algorithm", "driver", "metric" … as
            `bridgegen.cli.completion` knows them; empty where it completes nothing.
        also: another spelling on the command line; empty: none.
        is_argument: whether it is named by its place on the command line, not by a spelling.
        help: what it means, in Python and on the command line; a whole sentence.
        name: of the field.
        default: of the field.
        is_required: whether the field has none.
    """

    form: Form
    spelling: str = ""
    hint: str = ""
    shown: str | None = None
    limits: tuple[int, int] | None = None
    before: Any = ALWAYS
    group: str = WHAT
    names: str = ""
    also: str = ""
    is_argument: bool = False
    help: str = ""
    name: str = ""
    default: Any = None
    is_required: bool = False

    def words(self, value: Any) -> list[str]:
        """Return the words of a command line that give it a value; none for its absence."""
        if value is None or (isinstance(value, bool) and value == self.default):
            return []
        words = self.form.words(self.spelling, value)
        return [word for word in words if word != self.spelling] if self.is_argument else words


def option(
    form: Form,
    help: str,
    *,
    spelling: str = "",
    hint: str = "",
    shown: str | None = None,
    limits: tuple[int, int] | None = None,
    before: Any = ALWAYS,
    group: str = WHAT,
    names: str = "",
    also: str = "",
    is_argument: bool = False,
) -> dict[str, Any]:
    """Return the metadata of a field that is an option; see `Option` for the arguments."""
    declared = Option(form, spelling, hint, shown, limits, before, group, names, also, is_argument)
    return {"help": help, "option": declared}


def options_of(kind: type[Any]) -> tuple[Option, ...]:
    """Return the options that a class declares, those of the most derived class first.

    A field that a derived class only annotates anew, with a narrower type, keeps its declaration.
    """
    classes = [base for base in kind.__mro__ if "__dataclass_fields__" in vars(base)]
    declared = {
        field.name: field
        for base in reversed(classes)
        for field in fields(base)
        if "option" in field.metadata
    }
    # The last one wins: a field that a derived class only annotates anew stays where it was
    # declared.
    first = {name: base for base in classes for name in vars(base)["__annotations__"]}
    return tuple(
        replace(
            field.metadata["option"],
            help=field.metadata["help"],
            spelling=field.metadata["option"].spelling or f"--{field.name.replace('_', '-')}",
            name=field.name,
            default=None if field.default is MISSING else field.default,
            is_required=field.default is MISSING and field.default_factory is MISSING,
        )
        for base in classes
        for name, field in declared.items()
        if first[name] is base
    )


def range_problems(options: object) -> list[str]:
    """Return what is wrong with numbers that are out of an option's limits."""
    problems = []
    for item in options_of(type(options)):
        value = getattr(options, item.name)
        if item.limits and value is not None and not item.limits[0] <= value <= item.limits[1]:
            low, high = item.limits
            problems.append(
                f"{low} <= {item.name} <= {high} must hold, got {value} "
                f"({item.spelling}: {item.help[0].lower()}{item.help[1:].rstrip('.')})"
            )
    return problems


class Declared:
    """A base of options classes: each field that declares an option is read by its form."""

    def __post_init__(self) -> None:
        problems: list[str] = []
        for item in options_of(type(self)):
            try:
                kept = item.form.taken(getattr(self, item.name), item.name, item.default)
                object.__setattr__(self, item.name, kept)
            except InputError as error:
                problems += error.problems
        if problems:
            raise InputError(*problems)


# --- Functions that take the fields of a dataclass as keywords, and check them ---


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
    for item in named:
        if item not in signature.parameters:
            raise UnknownNameError(f"argument of {name}", item, signature.parameters)
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
    for field in fields(arguments):
        value = getattr(arguments, field.name)
        is_whole = isinstance(value, Integral) and not isinstance(value, bool)
        try:
            # Whole numbers of NumPy are as good as Python's.
            fits = isinstance(int(value) if is_whole else value, field.type)  # type: ignore[arg-type]
        except TypeError:  # the type is of elements, too
            continue
        if "option" not in field.metadata and not fits and not (field.type is float and is_whole):
            kind = inspect.formatannotation(field.type)
            problems.append(f"{field.name} must be {kind}, got {value!r}")
    if problems:
        raise InputError(*problems)


def _described(arguments: Any, signature: inspect.Signature) -> str:
    """Return the section ``Args:`` of a docstring."""
    declared = {field.name: field.metadata for field in fields(arguments)}
    lines = ["Args:"]
    for name in signature.parameters:
        option = declared[name].get("option")
        shown = f" (default: {option.shown})" if option and option.shown else ""
        lines.append(f"    {name}: {declared[name]['help'].rstrip('.')}{shown}.")
    return "\n".join(lines) + "\n"
