"""Options of the command line from the declarations in `bridgegen.engine.options`."""

import inspect
from collections.abc import Callable, Mapping, Sequence
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
    for item in signature.parameters.values():
        if item.name != parameter:
            parameters.append(item)
            continue
        for name, (annotation, default) in options.items():
            parameters.append(item.replace(name=name, annotation=annotation, default=default))

    @wraps(command)
    def wrapper(**values: Any) -> None:
        folded = fold({name: values.pop(name) for name in options})
        command(**values, **{parameter: folded})

    return with_parameters(wrapper, parameters)


def with_parameters(
    wrapper: Callable[..., None], parameters: Sequence[inspect.Parameter]
) -> Callable[..., None]:
    """Return a function with other parameters: typer reads its signature and annotations."""
    wrapper.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    wrapper.__annotations__ = {item.name: item.annotation for item in parameters}
    return wrapper


def with_declared_options(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options of the class that its parameter ``options`` is annotated with.

    Those that are named by their place are its arguments.
    """
    kind: type[PipelineOptions] = signature(command).parameters["options"].annotation
    declared = {option.name: option for option in options_of(kind) if option.form.kind is not None}

    def fold(values: dict[str, Any]) -> PipelineOptions:
        # What is not given has the default of the options' class, which is the only place that
        # states it.
        given = {name: value for name, value in values.items() if value is not None}
        needed = {name: option.spelling for name, option in declared.items() if option.is_required}
        if missing := [needed[name] for name in needed if name not in given]:
            raise InputError(f"missing: {', '.join(missing)}")
        return kind(**{n: declared[n].form.read(v, declared[n].spelling) for n, v in given.items()})

    # Python wants parameters without a default first, and arguments are the only ones.
    places = sorted(declared.items(), key=lambda of: not of[1].is_argument)
    made = {name: (_annotation(option), _default(option)) for name, option in places}
    return expand(command, "options", made, fold)


def declaration(name: str, *, shown: str | None = None) -> Any:
    """Return the typer declaration of a search option, for a command that takes only this one.

    Args:
        name: of the field of `SearchOptions`.
        shown: the command's default in words, where it is not the search's.
    """
    (option,) = (item for item in options_of(SearchOptions) if item.name == name)
    return declare(option if shown is None else replace(option, shown=shown))


def _annotation(option: Option) -> Any:
    kind = option.form.kind
    if option.is_argument:
        return Annotated[
            kind if option.is_required else kind | None,
            typer.Argument(help=option.help, autocompletion=completing(option.names)),
        ]
    return Annotated[kind if kind is bool else kind | None, declare(option)]


def declare(option: Option) -> Any:
    """Return the typer declaration of an option."""
    spelling = option.spelling
    if option.form.kind is bool:
        spelling = f"{spelling}/--no-{spelling.removeprefix('--')}"
    text = f"{option.help} {option.hint}".rstrip()
    return typer.Option(
        *filter(None, (spelling, option.also)),
        help=text,
        show_default="required" if option.is_required else option.shown or True,
        rich_help_panel=option.group,
        autocompletion=completing(option.names),
    )


def _default(option: Option) -> Any:
    """Return the parser's default; None where only the options' class knows it."""
    if option.is_argument and option.is_required:
        return inspect.Parameter.empty
    return option.default if isinstance(option.default, bool | int | float | str) else None
