"""What a shell completes the values of arguments and options with.

Each list is made when it is asked for: the command line starts without the modules that know it.
"""

from collections.abc import Callable, Iterable

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
    from bridgegen.scenario.language.reader import names, pack_names

    return (*names(), *pack_names())


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


def _others(_: typer.Context) -> Iterable[str]:
    from bridgegen.drivers import OTHERS

    return OTHERS


def _stages(_: typer.Context) -> Iterable[str]:
    from bridgegen.drivers import STAGES

    return STAGES


def _metrics(_: typer.Context) -> Iterable[str]:
    from bridgegen.assess.conflict.quantities import QUANTITIES

    return QUANTITIES


def _objectives(ctx: typer.Context) -> Iterable[str]:
    return ["harm", "paper", *_metrics(ctx)]


def _critical(_: typer.Context) -> Iterable[str]:
    from bridgegen.assess.objective import RULES

    return RULES


def _parameters(ctx: typer.Context) -> Iterable[str]:
    """Return the parameters of the scenario that the command line names."""
    from bridgegen.scenario.language.reader import load

    given = ctx.params.get("scenario") or ctx.params.get("scenarios") or ctx.args
    first = given if isinstance(given, str) else given[0]  # after an option without its value
    return [f"{name}=" for name in load(first).parameters]


def _axes(_: typer.Context) -> Iterable[str]:
    from bridgegen.scenario.language.parameters import Axis

    return [str(axis) for axis in Axis]


def _simulators(_: typer.Context) -> Iterable[str]:
    from bridgegen.simulation.choice import SIMULATORS

    return list(SIMULATORS)


def _vehicles(_: typer.Context) -> Iterable[str]:
    from bridgegen.simulation.vehicles import VEHICLES

    return list(VEHICLES)


def _causes(_: typer.Context) -> Iterable[str]:
    from bridgegen.assess.cause import CAUSES

    return [cause.label for cause in CAUSES]


def _triages(_: typer.Context) -> Iterable[str]:
    from bridgegen.search.triage.effort import EFFORTS

    return EFFORTS


def _flavours(_: typer.Context) -> Iterable[str]:
    from bridgegen.jobs.search.export import FLAVOURS

    return (*FLAVOURS, "parquet", "video", "xosc")


def _fixed(*words: str) -> Callable[[typer.Context], Iterable[str]]:
    return lambda _: words


NAMES: dict[str, Callable[[typer.Context], Iterable[str]]] = {
    "scenario": _scenarios,
    "suite": _scenarios_of_suite,
    "algorithm": _algorithms,
    "setting": _settings,
    "driver": _drivers,
    "others": _others,
    "vehicle": _vehicles,
    "stage": _stages,
    "metric": _metrics,
    "objective": _objectives,
    "critical": _critical,
    "parameter": _parameters,
    "axis": _axes,
    "simulator": _simulators,
    "cause": _causes,
    "triage": _triages,
    "weights": _fixed("fixed", "entropy"),
    "scale": _fixed("raw", "standardised"),
    "objectives": _fixed("one", "many"),
    "count": _fixed("ego", "any"),
    "flavour": _flavours,
}
"""Functions that list the names to complete, by kind."""
