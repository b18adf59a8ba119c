"""What a shell completes the values of arguments and options with.

Each list is made when it is asked for: the command line starts without the modules that know it.
"""

from collections.abc import Callable, Iterable
from importlib import import_module

import typer

from bridgegen.cli.groups import DEFAULT

Complete = Callable[[typer.Context, str], list[str]]
"""Function that completes a word: from the command line so far and the word's beginning to
candidates."""


def completing(kind: str) -> Complete | None:
    """Return what completes values of a kind, a key of `NAMES`; None for the empty text.

    Of a value with several names, separated by commas, the last is completed.
    """
    if not kind:
        return None
    names = NAMES[kind]

    def complete(ctx: typer.Context, incomplete: str) -> list[str]:
        try:
            known = list(names(ctx))
        except Exception:  # a scenario that cannot be read, say: a shell expects no message
            return []
        # Values may be lists, NAME,NAME: the last one is completed.
        before, comma, last = incomplete.rpartition(",")
        return [f"{before}{comma}{name}" for name in known if name.startswith(last)]

    return complete


def _scenarios(_: typer.Context) -> Iterable[str]:
    from bridgegen.scenario.language.reader import entry_names, names, pack_names

    return (*names(), *pack_names(), *entry_names())


def _scenarios_of_suite(ctx: typer.Context) -> Iterable[str]:
    """Return scenarios; before the first, what else one may do with a suite."""
    from bridgegen.cli.app import suites

    others = [
        command.name
        for command in suites.registered_commands
        if command.name not in (None, DEFAULT)
    ]
    return (*_scenarios(ctx), *(() if ctx.params.get("files") else map(str, others)))


def _algorithms(_: typer.Context) -> Iterable[str]:
    from bridgegen.search.algorithms import names
    from bridgegen.search.algorithms.automatic import AUTO

    return (*names(), AUTO)


def _settings(ctx: typer.Context) -> Iterable[str]:
    from bridgegen.search.algorithms import get

    return [f"{name}=" for name in get(ctx.params.get("algorithm") or "surrogate").settings]


def _drivers(_: typer.Context) -> Iterable[str]:
    from bridgegen.drivers import DRIVERS
    from bridgegen.drivers.planners import planners

    return (*DRIVERS, *planners())


def _objectives(ctx: typer.Context) -> Iterable[str]:
    return ["harm", "paper", *NAMES["metric"](ctx)]


def _parameters(ctx: typer.Context) -> Iterable[str]:
    """Return the parameters of the scenario that the command line names."""
    from bridgegen.scenario.language.reader import load

    given = ctx.params.get("scenario") or ctx.params.get("scenarios") or ctx.args
    first = given if isinstance(given, str) else given[0]  # after an option without its value
    return [f"{name}=" for name in load(first).parameters]


def _axes(_: typer.Context) -> Iterable[str]:
    from bridgegen.scenario.language.parameters import Axis

    return [str(axis) for axis in Axis]


def _causes(_: typer.Context) -> Iterable[str]:
    from bridgegen.assess.cause import CAUSES

    return [cause.label for cause in CAUSES]


def _flavours(_: typer.Context) -> Iterable[str]:
    from bridgegen.jobs.search.export import FLAVOURS

    return (*FLAVOURS, "openlabel", "osi", "parquet", "rerun", "video", "xosc")


def _keys(place: str) -> Callable[[typer.Context], Iterable[str]]:
    """Return what lists the names that something of a module, ``module:name``, holds."""
    module, _, name = place.partition(":")
    return lambda _: list(getattr(import_module(f"bridgegen.{module}"), name))


def _fixed(*words: str) -> Callable[[typer.Context], Iterable[str]]:
    return lambda _: words


NAMES: dict[str, Callable[[typer.Context], Iterable[str]]] = {
    "scenario": _scenarios,
    "suite": _scenarios_of_suite,
    "algorithm": _algorithms,
    "setting": _settings,
    "driver": _drivers,
    "others": _keys("drivers:OTHERS"),
    "vehicle": _keys("simulation.vehicles:VEHICLES"),
    "stage": _keys("drivers:STAGES"),
    "metric": _keys("assess.conflict.quantities:QUANTITIES"),
    "objective": _objectives,
    "critical": _keys("assess.objective:RULES"),
    "parameter": _parameters,
    "axis": _axes,
    "simulator": _keys("simulation.choice:SIMULATORS"),
    "cause": _causes,
    "triage": _keys("search.triage.effort:EFFORTS"),
    "weights": _fixed("fixed", "entropy"),
    "scale": _fixed("raw", "standardised"),
    "objectives": _fixed("one", "many"),
    "count": _fixed("ego", "any"),
    "flavour": _flavours,
}
"""Functions that list the names to complete, by kind."""
