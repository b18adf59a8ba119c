"""The options that several commands have, and how their texts are read."""

import json
from pathlib import Path
from typing import Annotated

import typer

from bridgegen.cli.where import Where
from bridgegen.errors import InputError
from bridgegen.simulation.choice import SimulatorChoice

Json = Annotated[bool, typer.Option("--json", help="Print JSON for machines.")]

Distribution = Annotated[
    Path | None,
    typer.Option(
        help="How the parameters of an OpenSCENARIO file are distributed: a file with a "
        "ParameterValueDistribution."
    ),
]
Ego = Annotated[
    str | None,
    typer.Option(
        help="Who drives: see 'bridgegen list drivers'; or your own: module:Class, "
        "file.py:Class (or a compiled driver's function), file.fmu.",
        show_default="the scenario's choice",
    ),
]
OwnEgo = Annotated[
    str | None, typer.Option("--ego", help="The run's driver, where it is one of your own.")
]
Ideal = Annotated[
    str | None,
    typer.Option(
        help="Stages of the driver that work without fault: perception, prediction, control, "
        "separated by commas.",
        show_default="none of them",
    ),
]
TimeLimit = Annotated[
    float | None,
    typer.Option(
        help="Seconds that a call of a driver of your own may take; of a compiled one, a scenario.",
        show_default="10",
    ),
]
Axes = Annotated[str | None, typer.Option(help="What to search, e.g. static,participants,weather.")]
Fix = Annotated[
    list[str] | None,
    typer.Option(
        help="Hold a parameter, e.g. --fix fog_density=80; a category by name; may be repeated."
    ),
]
Objective = Annotated[
    str | None,
    typer.Option(
        help="harm, paper, or metrics and weights, e.g. d_min=0.8,v_d=0.2, or d_min,ttc with "
        "--weights entropy.",
        show_default="the scenario's",
    ),
]
Weights = Annotated[str | None, typer.Option(help="fixed, or entropy (from a random sample).")]
Scale = Annotated[str | None, typer.Option(help="raw, or standardised (by a sample).")]
Objectives = Annotated[
    str | None,
    typer.Option(
        help="one: the metrics' weighted sum; many: each metric by itself.",
        show_default="what the algorithm is made for",
    ),
]
Count = Annotated[
    str | None,
    typer.Option(
        help="Whose conflicts are harm: ego, those that the ego is responsible for or could have "
        "prevented; or any.",
        show_default="ego",
    ),
]
Metrics = Annotated[
    str | None,
    typer.Option(help="Record these as well, e.g. pet,drac; see 'bridgegen list metrics'."),
]
OnlyMetrics = Annotated[
    str | None,
    typer.Option("--metrics", help="Only these, e.g. pet,drac.", show_default="all there are"),
]
Causes = Annotated[
    bool, typer.Option(help="Find the cause of each critical scenario, by replaying it.")
]
Cause = Annotated[
    str | None,
    typer.Option(
        help="Count only this cause's: perception, planning, control or unavoidable.",
        show_default="any",
    ),
]
Adversary = Annotated[
    str | None,
    typer.Option(
        help="A vehicle that an adversary drives instead of the scenario's events.",
        show_default="none; with ppo-adversary the first",
    ),
]
Others = Annotated[
    str | None,
    typer.Option(
        help="Who drives all other participants: attentive, or scripted (nobody heeds anybody).",
        show_default="what the scenario says",
    ),
]
Simulator = Annotated[
    str | None,
    typer.Option(help="Who simulates: see 'bridgegen list simulators'.", show_default="embedded"),
]
SimulatorSettings = Annotated[
    list[str] | None,
    typer.Option(
        "--simulator-set", help="A setting of the simulator, NAME=VALUE; may be repeated."
    ),
]
RoadMap = Annotated[
    Path | None, typer.Option("--map", help="A map (.xodr, or its import) to search on.")
]
Junction = Annotated[str | None, typer.Option(help="Which junction of the map.")]
Workers = Annotated[
    str | None,
    typer.Option(
        help="Who simulates: so many processes of this machine, each one thread; or ray, or "
        "ray://HOST:PORT, a Ray cluster (extra ray). No result depends on it.",
        show_default="threads, one for each core",
    ),
]
RunWorkers = Annotated[
    str | None,
    typer.Option(
        "--workers",
        help="So many runs at a time, each in a process; or ray, or ray://HOST:PORT: their "
        "scenarios are simulated in a Ray cluster (extra ray). No result depends on it.",
        show_default="one on each core",
    ),
]
FailIf = Annotated[
    list[str] | None,
    typer.Option(
        help="End with exit status 3 if this holds, e.g. 'r_critic > 0.1'; may be repeated.",
        show_default=False,
    ),
]
FileFailIf = Annotated[
    list[str] | None,
    typer.Option(
        "--fail-if",
        help="End with exit status 3 if this holds of its metrics, e.g. 'd_min < 2 and v_d >= 1'; "
        "may be repeated.",
        show_default=False,
    ),
]
ConfirmFailIf = Annotated[
    list[str] | None,
    typer.Option(
        "--fail-if",
        help="End with exit status 3 if this holds, e.g. 'confirmed < 0.95'; may be repeated.",
        show_default=False,
    ),
]
Junit = Annotated[
    Path | None, typer.Option(help="Write the verdict as JUnit XML, for Jenkins, GitLab …")
]

Setting = bool | int | float | str
"""A value of an algorithm's setting."""


def read_names(text: str | None) -> list[str]:
    """Read ``name,…``; nothing is none."""
    return [name.strip() for name in text.split(",")] if text else []


def read_fixed(pairs: list[str] | None) -> dict[str, float | str]:
    """Read ``name=value`` pairs: numbers, or names of categories' values."""
    values: dict[str, float | str] = {}
    problems = []
    for pair in pairs or ():
        name, equals, text = pair.partition("=")
        try:
            values[name] = float(text)
        except ValueError:
            values[name] = text
        if not equals or not text:
            problems.append(f"--fix must read NAME=VALUE, got '{pair}'")
    if problems:
        raise InputError(*problems)
    return values


def _read_weights(pairs: list[str]) -> dict[str, float]:
    """Read ``metric=weight`` pairs."""
    values, problems = {}, []
    for pair in pairs:
        name, equals, text = pair.partition("=")
        try:
            values[name] = float(text)
        except ValueError:
            equals = ""
        if not equals:
            problems.append(f"--objective must read NAME=NUMBER, got '{pair}'")
    if problems:
        raise InputError(*problems)
    return values


def read_terms(text: str | None) -> dict[str, float | None] | None:
    """Read ``metric=weight,…`` or ``metric,…``; nothing is the scenario's choice."""
    if not text:
        return None
    pairs = read_names(text)
    weighted = _read_weights([pair for pair in pairs if "=" in pair])
    return {name: weighted.get(name) for name in (pair.partition("=")[0] for pair in pairs)}


def read_settings(pairs: list[str] | None, option: str = "--set") -> dict[str, Setting]:
    """Read ``name=value`` pairs; a value is a number, true, false, or a text."""
    values: dict[str, Setting] = {}
    for pair in pairs or ():
        name, equals, text = pair.partition("=")
        if not equals:
            raise InputError(f"{option} must read NAME=VALUE, got '{pair}'")
        values[name] = _value(text)
    return values


def read_simulator(
    name: str | None, settings: list[str] | None, where: Where
) -> SimulatorChoice | None:
    """Read the choice of a simulator; nothing is the default.

    Args:
        name: of it.
        settings: ``name=value`` pairs.
        where: it is.
    """
    if name is None:
        if settings or where:
            what = ", ".join([*where, *(["--simulator-set"] if settings else [])])
            raise InputError(f"{what}: name the simulator that it is for (--simulator)")
        return None
    return SimulatorChoice(name, read_settings(settings, "--simulator-set"), where)


def read_algorithm_settings(pairs: list[str] | None) -> dict[str, dict[str, Setting]]:
    """Read ``algorithm.name=value`` pairs."""
    found: dict[str, dict[str, Setting]] = {}
    for pair in pairs or ():
        name, equals, text = pair.partition("=")
        algorithm, dot, setting = name.partition(".")
        if not (equals and dot and algorithm and setting):
            raise InputError(f"--set must read ALGORITHM.NAME=VALUE, got '{pair}'")
        found.setdefault(algorithm, {})[setting] = _value(text)
    return found


def _value(text: str) -> Setting:
    try:
        value = json.loads(text)
    except json.JSONDecodeError:
        return text
    return value if isinstance(value, bool | int | float | str) else text
