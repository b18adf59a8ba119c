"""The objective as the user's options change the scenario's."""

from dataclasses import replace
from typing import Any, cast, get_args

from bridgegen.assess.conflict.harm import Count
from bridgegen.assess.conflict.quantities import HARM, QUANTITIES
from bridgegen.assess.objective import RULES, Objectives
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.engine.options import CommonOptions
from bridgegen.engine.options.forms import read_names
from bridgegen.scenario.language.criteria import PREFIX
from bridgegen.scenario.language.objectives import PAPERS
from bridgegen.scenario.language.scenario import (
    LogicalScenario,
    ObjectiveSpec,
    SearchedScenario,
    Term,
)
from bridgegen.search.algorithms import Algorithm

PAPER = "paper"
"""The name in ``--objective`` of the paper's objective and criticality rule."""

BESIDE_HARM = "d_min"
"""The second objective of a search of many whose only term is harm."""


def columns_of(method: type[Algorithm], objectives: str | None) -> Objectives:
    """Return whether one objective or many are searched: the user's choice, or the algorithm's."""
    if objectives is None:
        return "many" if method.objectives == "many" else "one"
    for known in get_args(Objectives):
        if objectives == known:
            return cast(Objectives, known)
    raise UnknownNameError("number of objectives", objectives, get_args(Objectives))


def counted(count: str | None) -> Count | None:
    """Return whose conflicts count as harm, by the user's choice.

    Raises:
        UnknownNameError: no such choice.
    """
    for known in get_args(Count):
        if count == known:
            return cast(Count, known)
    if count is not None:
        raise UnknownNameError("choice of whose conflicts count", count, get_args(Count))
    return None


def as_judged(scenario: SearchedScenario, gated: bool) -> SearchedScenario:
    """Return a scenario adapted to whether implausible traffic counts (``Objective.gated``).

    Vehicles that stop dead at the end of a road are implausible. Where they would not count, they
    drive on and leave there, whatever the scenario says for the paper's evaluation. A scenario file
    stays as it is.
    """
    if gated and isinstance(scenario, LogicalScenario):
        return replace(scenario, road_end="leave")
    return scenario


def _judged_by(spec: ObjectiveSpec, critical: str | None) -> ObjectiveSpec:
    """Return an objective with the user's choice of what makes a scenario critical.

    Raises:
        UnknownNameError: no such choice.
    """
    if critical is None:
        return spec
    names = tuple(read_names(critical))
    if names and all(name.startswith(PREFIX) for name in names):
        return replace(spec, rule="criteria", criteria=names, gated=True)
    for known in RULES:
        if critical == known:
            gated = spec.gated or known != "thresholds"
            return replace(spec, rule=known, criteria=(), gated=gated)
    raise UnknownNameError("choice of what is critical", critical, (*RULES, f"{PREFIX}ID"))


def chosen_objective(
    spec: ObjectiveSpec, options: CommonOptions, columns: Objectives
) -> ObjectiveSpec:
    """Return the scenario's objective with the user's choices applied.

    Args:
        spec: the scenario's.
        options: the user's; the objective ``{"harm": None}`` or ``{"paper": None}`` chooses the
            criticality rule, too.
        columns: one or many objectives.

    Raises:
        InputError: weights that nothing uses; ``paper`` among other metrics.
        UnknownNameError: no such metric, or choice of whose conflicts count.
    """
    metrics, weights, scale = options.objective, options.weights, options.scale
    count = counted(options.count)
    for name in metrics or ():
        if name not in (*QUANTITIES, PAPER) and not name.startswith(PREFIX):
            raise UnknownNameError("metric", name, (*QUANTITIES, PAPER))
    if metrics is not None and PAPER in metrics:
        if len(metrics) > 1 or metrics[PAPER] is not None:
            raise InputError(f"the objective '{PAPER}' stands alone, without a weight")
        spec, metrics = replace(PAPERS, critical=spec.critical), None
    if metrics is not None and HARM in metrics:
        spec = replace(spec, rule="harm", weights="fixed", gated=True)
        if len(metrics) == 1:
            metrics = {HARM: 1.0 if columns == "one" and weights != "entropy" else None}
    if metrics and all(name.startswith(PREFIX) for name in metrics):
        spec = replace(spec, rule="criteria", criteria=tuple(metrics), weights="fixed")
        if len(metrics) == 1 and columns == "one" and weights != "entropy":
            metrics = {name: weight or 1.0 for name, weight in metrics.items()}
    spec = _judged_by(spec, options.critical)
    if columns == "many":
        given = [f"{name}={w:g}" for name, w in (metrics or {}).items() if w is not None]
        given += [f"--weights {weights}"] if weights else []
        if given:
            raise InputError(
                f"weights have no part in many objectives, got {', '.join(given)}; "
                "leave them out, or search their sum: --objectives one"
            )
    way = weights or ("fixed" if metrics and None not in metrics.values() else spec.weights)
    terms = spec.terms
    if metrics is not None:
        terms = tuple(Term(name, weight) for name, weight in metrics.items())
    elif way == "entropy":
        terms = tuple(Term(term.metric) for term in terms)
    if columns == "many" and [term.metric for term in terms] == [HARM]:
        terms = (*terms, Term(BESIDE_HARM))
    ways: dict[str, Any] = {"weights": way, "scale": scale or spec.scale}
    return replace(spec, terms=terms, count=count or spec.count, **ways)
