"""What a field of an options class declares of its option, and what follows from it."""

from dataclasses import MISSING, dataclass, fields, replace
from typing import Any, Final

from bridgegen.engine.options.forms import Form

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
"""The ``before`` of an option that every run records."""


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
        help: what it means, in Python and on the command line; a whole sentence.
        name: of the field.
        default: of the field.
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
    help: str = ""
    name: str = ""
    default: Any = None

    def words(self, value: Any) -> list[str]:
        """Return the words of a command line that give it a value; none for its absence."""
        if value is None or (isinstance(value, bool) and value == self.default):
            return []
        return self.form.words(self.spelling, value)


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
) -> dict[str, Any]:
    """Return the metadata of a field that is an option; see `Option` for the arguments."""
    declared = Option(form, spelling, hint, shown, limits, before, group, names, also)
    return {"help": help, "option": declared}


def options_of(kind: type[Any]) -> tuple[Option, ...]:
    """Return the options that a class declares, those of the most derived class first.

    A field that a derived class only annotates anew, with a narrower type, keeps its declaration.
    """
    classes = [base for base in kind.__mro__ if "__dataclass_fields__" in vars(base)]
    declared = {
        one.name: one
        for base in reversed(classes)
        for one in fields(base)
        if "option" in one.metadata
    }
    first = {name: base for base in classes for name in vars(base)["__annotations__"]}
    return tuple(
        replace(
            one.metadata["option"],
            help=one.metadata["help"],
            spelling=one.metadata["option"].spelling or f"--{one.name.replace('_', '-')}",
            name=one.name,
            default=None if one.default is MISSING else one.default,
        )
        for base in classes
        for name, one in declared.items()
        if first[name] is base
    )


def range_problems(options: object) -> list[str]:
    """Return what is wrong with numbers that are out of an option's limits."""
    problems = []
    for one in options_of(type(options)):
        value = getattr(options, one.name)
        if one.limits and value is not None and not one.limits[0] <= value <= one.limits[1]:
            low, high = one.limits
            problems.append(
                f"{low} <= {one.name} <= {high} must hold, got {value} "
                f"({one.spelling}: {one.help[0].lower()}{one.help[1:].rstrip('.')})"
            )
    return problems
