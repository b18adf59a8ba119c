"""Help texts in which commands are listed by panel, and options by group."""

import re
import sys
from collections.abc import Callable
from typing import Any, TypeVar

import typer
from typer.core import TyperCommand, TyperGroup

from bridgegen.base.errors import InputError
from bridgegen.engine.options.option import GROUPS

Function = TypeVar("Function", bound=Callable[..., Any])

PANELS = {
    "Search": (
        "demo",
        "search",
        "resume",
        "suite",
        "diff",
        "repair",
        "benchmark",
        "preventability",
        "risk",
    ),
    "Look at results": (
        "open",
        "analyse",
        "confirm",
        "export",
        "dashboard",
        "safety-case",
        "credibility",
    ),
    "Files": ("new", "validate", "draw", "simulate", "mine", "fit"),
    "More": ("list", "ontology", "doctor"),
}
"""The commands that ``bridgegen --help`` lists, by panel, in this order."""

RENAMED = {
    "ask": ("ontology", "ask"),
    "check-driver": ("validate",),
    "compare": ("benchmark", "algorithms"),
    "convert": ("export", "--flavour", "xosc"),
    "coverage": ("analyse", "coverage"),
    "import": ("ontology", "import"),
    "junctions": ("list", "places"),
    "metrics": ("analyse", "recording"),
    "places": ("list", "places"),
    "regions": ("analyse", "regions"),
    "schema": ("validate", "--schema"),
    "show": ("draw",),
    "table": ("export", "--flavour", "parquet"),
    "video": ("export", "--flavour", "video"),
    "view": ("open",),
}
"""Old names of commands, which answer in version 0.1 only, and what they are called now."""

RENAMED_OPTIONS = {
    "fit": {"--others": "--without-column"},
    "import": {"--ego": "--entity"},
    "recording": {"--ego": "--entity"},
    "mine": {"--lenient": ""},
    "suite": {"--map": "--preventability"},
}
"""Old spellings of options by command, likewise; "" of flags that say what is always done now."""

MANY = 20
"""Number of options above which the help of a command leaves out those that are `RARE`."""

_RARE = (
    "adversary ahead axes carla-command carla-timeout cause causes count detector device "
    "distinct distribution empty-trigger esmini-lib exposure host ideal maps metrics name "
    "needs objectives others place port record repeats scale screen screen-batch screen-budget "
    "screen-set set simulator-set time-limit triage vehicle weights workers worse-than"
)
RARE = frozenset(f"--{name}" for name in _RARE.split())
"""Options that few people need; ``--help-all`` lists them, too."""

OTHER = "Options"
"""The group of the options that belong to none of `GROUPS`."""

DEFAULT = "default"
"""The internal name of a `WithDefault`'s default command; users do not type it."""

_MUST = {"valid integer": "a whole number", "valid number": "a number"}
"""What a value must be, by a part of the parser's message."""

_BESIDE, _WHOLE = "bridgegen.group", "bridgegen.whole"


class PanelledGroup(TyperGroup):
    """Commands whose help lists them by panel, which typer does with rich's markup only."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the panels, each command with its summary."""
        width = max(map(len, self.list_commands(ctx)))
        for panel, names in PANELS.items():
            short = {
                name: self.commands[name].get_short_help_str(formatter.width - width - 4)
                for name in names
            }
            with formatter.section(panel):
                formatter.write_dl([(name.ljust(width), text) for name, text in short.items()])

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the commands that people see."""
        return [name for names in PANELS.values() for name in names]

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return a command and its words; those of an old name are the new one's."""
        if new := RENAMED.get(args[0]):
            _tell_new(ctx, args[0], f"bridgegen {' '.join(new)}")
            args = [*new, *(word for word in args[1:] if (args[0], word) != ("schema", "--of"))]
        return super().resolve_command(ctx, args)


def _tell_new(ctx: Any, old: str, new: str) -> None:
    if not ctx.resilient_parsing:  # a shell that completes expects no message
        print(
            f"bridgegen: note: {old} is now '{new}'; the next version has no {old}", file=sys.stderr
        )


class GroupedCommand(TyperCommand):
    """A command whose help lists its options by their groups, in the order of `GROUPS`."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the words of a command line; an option that takes one value may be given once.

        Raises:
            InputError: one is given again.
        """
        renamed = RENAMED_OPTIONS.get(ctx.info_name, {})
        for place, (old, equals, value) in enumerate(word.partition("=") for word in args):
            if new := renamed.get(old):
                args[place] = f"{new}{equals}{value}"
                _tell_new(ctx, old, new)
            elif new == "" and not ctx.resilient_parsing:
                print(
                    f"bridgegen: note: {old} is not needed any more: it is always so",
                    file=sys.stderr,
                )
        args = [word for word in args if renamed.get(word) != ""]
        if "--help-all" in args:
            ctx.meta[_WHOLE] = args = ["--help"]
        single = {
            spelling: param
            for param in self.params
            if param.param_type_name == "option"
            and not param.multiple
            and not getattr(param, "is_flag", False)
            for spelling in param.opts
        }
        values: dict[str, list[str]] = {}
        words = iter(args)
        for word in words:
            if word == "--":
                break
            spelling, equals, value = word.partition("=")
            if spelling in single:
                name = single[spelling].opts[0]
                values.setdefault(name, []).append(value if equals else next(words, ""))
        # Click takes the last of two values without a word.
        if twice := [
            f"{name} takes one value, and is given {len(found)}: {', '.join(found)}"
            for name, found in values.items()
            if len(found) > 1
        ]:
            raise InputError(*twice)
        try:
            return list(super().parse_args(ctx, args))
        except typer.BadParameter as error:
            name = str(error.param.opts[0]) if error.param else ""
            # The parser's own words are those of a library of types.
            must = next((must for kind, must in _MUST.items() if kind in error.message), None)
            if must is None or name not in values:
                raise
            raise InputError(f"{name} must be {must}, got '{values[name][0]}'") from None

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write the arguments, then the groups that the command has options of."""
        arguments: list[tuple[str, str]] = []
        groups: dict[str, list[tuple[str, str]]] = {group: [] for group in (*GROUPS, OTHER)}
        is_whole = len(self.params) <= MANY or _WHOLE in ctx.meta
        if not is_whole:
            groups[OTHER].append(("--help-all", "Show all options, also those that few need."))
        for param in self.get_params(ctx):
            record = param.get_help_record(ctx)
            if record is None or not (is_whole or RARE.isdisjoint(param.opts)):
                continue
            # Most of what may be repeated is a text: "<str>" says as much as "<list[str]>".
            names = re.sub(r"<list\[(\w+)\]>", r"<\1>", record[0])
            record = (names, re.sub(r"\[default: \((.*)\)\]$", r"[default: \1]", record[1]))
            if param.param_type_name == "argument":
                arguments.append(record)
            else:
                groups[getattr(param, "rich_help_panel", None) or OTHER].append(record)
        for title, rows in {"Arguments": arguments, **groups}.items():
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)


class WithDefault(TyperGroup):
    """Commands one of which is meant where no other is named: ``suite FILES``, ``suite add``."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the words of a command line; before those of the default, put its name."""
        others = [name for name in self.commands if name != DEFAULT]
        named = bool(args) and args[0] in others
        return list(super().parse_args(ctx, args if named else [DEFAULT, *args]))


class DefaultCommand(GroupedCommand):
    """The command of a `WithDefault` that needs no name; its help lists the others."""

    def make_context(
        self, info_name: str | None, args: list[str], parent: Any = None, **extra: Any
    ) -> Any:
        """Return its context, in which it has the name of its group."""
        if parent is None:
            return super().make_context(info_name, args, **extra)
        parent.meta[_BESIDE] = parent.command
        return super().make_context(parent.info_name, args, parent=parent.parent, **extra)

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Write arguments and options, then the other commands of the group."""
        super().format_options(ctx, formatter)
        group = ctx.meta.get(_BESIDE)
        rows = [
            (f"{ctx.info_name} {name}", command.get_short_help_str(formatter.width - 20))
            for name, command in (group.commands if group else {}).items()
            if command is not self
        ]
        if rows:
            with formatter.section("Commands"):
                formatter.write_dl(rows)


class Application(typer.Typer):
    """A typer application whose commands list their options by group."""

    def command(self, name: str | None = None, **settings: Any) -> Callable[[Function], Function]:
        """Return what registers a command; see `typer.Typer.command`."""
        register: Callable[[Function], Function] = super().command(
            name, **{"cls": GroupedCommand, **settings}
        )
        return register
