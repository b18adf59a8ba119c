"""The current operational domain of a row, in ASAM OpenODD 1.0's YAML (section 10.3)."""

import json
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.scenario.odd.bounding import Fit
from bridgegen.scenario.odd.states import Concept, concept_of, table

LITERAL = "categorical_literal"


class Stated(NamedTuple):
    """An attribute's value in a row.

    Attributes:
        name: as the ODD writes it, else as ``taxonomy.yaml`` does.
        unit: of a number; "boolean", or `LITERAL` of a text.
        value: the number, truth value, or literals.
    """

    name: str
    unit: str
    value: float | bool | tuple[str, ...]


def named_concepts(fit: Fit) -> dict[str, Concept]:
    """Return the attributes that a scenario states, by the names that its ODD writes.

    Those that the ODD does not name have their names in ``taxonomy.yaml``, and come last.
    """
    names = [*(condition.concept for condition in fit.odd.conditions), *fit.odd.taxonomy]
    found = {}
    for name in dict.fromkeys(names):
        if (concept := concept_of(name)) is not None:
            found[name] = concept
    known = {concept.name for concept in found.values()}
    for concept in table().concepts.values():
        if concept.name not in known:
            known.add(concept.name)
            found[concept.name] = concept
    return found


def stated(fit: Fit, row: Mapping[str, float]) -> Iterator[Stated]:
    """Yield what a row states of the attributes.

    Args:
        fit: the ODD and the scenario.
        row: values of parameters and derived quantities, by name.
    """
    for name, concept in named_concepts(fit).items():
        defined = fit.odd.taxonomy.get(name)
        value = fit.states.value(concept, row)
        if value is None:
            continue
        if isinstance(defined, Mapping):
            literals = fit.literals(name, {key: np.array([x]) for key, x in row.items()}, defined)
            if found := tuple(literal for literal, met in literals.items() if met[0]):
                yield Stated(name, LITERAL, found)
        elif isinstance(value, float):
            yield Stated(name, str(table().quantities[concept.quantity]["unit"]), value)
        elif value in (["true"], ["false"]):
            yield Stated(name, "boolean", value == ["true"])
        elif value:
            yield Stated(name, LITERAL, tuple(value))


def cod(fit: Fit, row: Mapping[str, float], of: str) -> str:
    """Return the current operational domain of a row as a file with its taxonomy.

    A simulated scenario has no date and no place on Earth: both are empty.

    Args:
        fit: the ODD and the scenario.
        row: values of parameters and derived quantities, by name.
        of: the file that holds the row.
    """
    columns: dict[str, Float] = {name: np.array([value]) for name, value in row.items()}
    side = "inside" if fit.inside(columns)[0] else "outside"
    gaps = f", as far as {len(fit.gaps)} conditions can be left out" if fit.gaps else ""
    lines = [
        f"# Current operational domain of {of}, at its start, in ASAM OpenODD 1.0's YAML:",
        f"# {side} the ODD with the digest {fit.odd.digest}{gaps}.",
        "TAXONOMY:",
    ]
    values = ["COD:", '  - TEMPORAL_EXTENT: ""', '    SPATIAL_EXTENT: ""']
    quantities = table().quantities
    measures = {
        name: quantities[concept.quantity]["measures"]
        for name, concept in named_concepts(fit).items()
        if concept.quantity
    }
    for name, unit, value in stated(fit, row):
        key = json.dumps(f"{name};{unit}", ensure_ascii=False)
        if isinstance(value, tuple):
            defined = fit.odd.taxonomy.get(name)
            known = [*(defined if isinstance(defined, Mapping) else ()), *value]
            kind = _list(dict.fromkeys(known))
            text = _list(value) if len(value) > 1 else json.dumps(value[0], ensure_ascii=False)
        elif isinstance(value, bool):
            kind, text = "boolean", str(value).lower()
        else:
            kind, text = f"float {measures[name]}", repr(value)
        lines.append(f"  {json.dumps(name, ensure_ascii=False)}: {kind}")
        values.append(f"    {key}: {text}")
    return "\n".join([*lines, *values]) + "\n"


def _list(values: object) -> str:
    return json.dumps(list(values), ensure_ascii=False)  # type: ignore[call-overload]
