"""What the user chooses of the objective, instead of the scenario's."""

from collections.abc import Mapping
from dataclasses import replace
from typing import cast, get_args

from bridgegen.errors import InputError, UnknownNameError
from bridgegen.objective import Objectives
from bridgegen.odd.scenario import ObjectiveSpec, Term
from bridgegen.search import Algorithm


def columns_of(method: type[Algorithm], objectives: str | None) -> Objectives:
    """Return how many objectives are searched: what the user says, or the algorithm is for."""
    if objectives is None:
        return "many" if method.objectives == "many" else "one"
    for known in get_args(Objectives):
        if objectives == known:
            return cast(Objectives, known)
    raise UnknownNameError("number of objectives", objectives, get_args(Objectives))


def chosen_objective(
    spec: ObjectiveSpec,
    metrics: Mapping[str, float | None] | None,
    weights: str | None,
    scale: str | None,
    columns: Objectives,
) -> ObjectiveSpec:
    """Return the scenario's objective with what the user wants instead."""
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
    return replace(spec, terms=terms, weights=way, scale=scale or spec.scale)  # type: ignore[arg-type]
