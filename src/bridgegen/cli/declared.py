"""Options of the command line from the declarations in `bridgegen.engine.options`."""

import inspect
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from functools import wraps
from inspect import signature
from typing import Annotated, Any

import typer

from bridgegen.base.errors import InputError
from bridgegen.cli.completion import completing
from bridgegen.engine.options import Option, PipelineOptions, SearchOptions, options_of

# --- Expands one parameter of a command's function into many options ---


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


def with_declared_options(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options of the class that its parameter ``options`` is annotated with.

    Those that are named by their place are its arguments.
    """
    return with_options(*_names(command))(command)


def with_options(*names: str) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command some of these options; its parameter ``options`` has the others' defaults."""

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        return _with(command, names)

    return decorate


def _names(command: Callable[..., None]) -> list[str]:
    kind: type[PipelineOptions] = signature(command).parameters["options"].annotation
    return [one.name for one in options_of(kind) if one.form.kind is not None]


def _with(command: Callable[..., None], names: Collection[str]) -> Callable[..., None]:
    kind: type[PipelineOptions] = signature(command).parameters["options"].annotation
    declared = {one.name: one for one in options_of(kind) if one.name in names}

    def fold(values: dict[str, Any]) -> PipelineOptions:
        given = {name: value for name, value in values.items() if value is not None}
        needed = {name: one.spelling for name, one in declared.items() if one.is_required}
        if missing := [needed[name] for name in needed if name not in given]:
            raise InputError(f"missing: {', '.join(missing)}")
        return kind(**{n: declared[n].form.read(v, declared[n].spelling) for n, v in given.items()})

    # Python wants parameters without a default first, and arguments are the only ones.
    places = sorted(declared.items(), key=lambda of: not of[1].is_argument)
    made = {name: (_annotation(one), _default(one)) for name, one in places}
    return expand(command, "options", made, fold)


def declaration(name: str, *, shown: str | None = None) -> Any:
    """Return the typer declaration of a search option, for a command that takes only this one.

    Args:
        name: of the field of `SearchOptions`.
        shown: the command's default in words, where it is not the search's.
    """
    (one,) = (one for one in options_of(SearchOptions) if one.name == name)
    return declare(one if shown is None else replace(one, shown=shown))


def _annotation(one: Option) -> Any:
    kind = one.form.kind
    if one.is_argument:
        return Annotated[kind, typer.Argument(help=one.help, autocompletion=completing(one.names))]
    return Annotated[kind if kind is bool else kind | None, declare(one)]


def declare(one: Option) -> Any:
    """Return the typer declaration of an option."""
    spelling = one.spelling
    if one.form.kind is bool:
        spelling = f"{spelling}/--no-{spelling.removeprefix('--')}"
    text = f"{one.help} {one.hint}".rstrip()
    return typer.Option(
        *filter(None, (spelling, one.also)),
        help=text,
        show_default="required" if one.is_required else one.shown or True,
        rich_help_panel=one.group,
        autocompletion=completing(one.names),
    )


def _default(one: Option) -> Any:
    """Return the parser's default; None where only the options' class knows it."""
    if one.is_argument:
        return inspect.Parameter.empty
    return one.default if isinstance(one.default, bool | int | float | str) else None
