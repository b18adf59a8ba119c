"""What may vary and what limits it: the graph of constraints, in an order that can be computed."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter

from bridgegen.scenario.language.parameters import Axis, Bound, Derived, Parameter, at, nearest


@dataclass(frozen=True)
class Constraints:
    """What a search space is made of, and what its rows must keep.

    Attributes:
        parameters: what may vary, by name.
        bounds: what limits it.
        derived: what follows from it.
        axes: searched by default.
    """

    parameters: Mapping[str, Parameter]
    bounds: tuple[Bound, ...]
    derived: tuple[Derived, ...]
    axes: tuple[Axis, ...]


def problems_of(
    parameters: Iterable[Parameter],
    bounds: Sequence[Bound],
    derived: Sequence[Derived],
    also: Iterable[str] = (),
) -> list[str]:
    """Return what is wrong with the constraints as a whole; nothing if they can be computed.

    That is: a name declared twice, a formula or a bound that names nothing, a bound on a derived
    quantity, a cycle.

    Args:
        parameters: what may vary.
        bounds: what limits it.
        derived: what follows from it.
        also: names that are declared, but wrongly: no reason to call them unknown.
    """
    problems: list[str] = []
    declared: dict[str, Parameter | Derived] = {}
    ones: list[Parameter | Derived] = [*parameters, *derived]
    for one in ones:
        if one.name in declared:
            first = at(declared[one.name].place)
            problems.append(f"'{one.name}' is declared twice{at(one.place)}, first{first}")
        declared.setdefault(one.name, one)
    known = [*declared, *also]
    for bound in bounds:
        target = declared.get(bound.target)
        if bound.target not in known:
            problems.append(
                f"the bound '{bound}' limits the unknown parameter '{bound.target}'"
                f"{nearest(bound.target, known)}{at(bound.place)}"
            )
        elif isinstance(target, Derived):
            problems.append(
                f"the bound '{bound}' limits '{bound.target}', which follows from "
                f"'{target}': limit what it follows from{at(bound.place)}"
            )
        elif isinstance(target, Parameter) and target.kind.names:
            problems.append(
                f"the bound '{bound}' limits '{bound.target}', a category: its values have no "
                f"order{at(bound.place)}"
            )
    rules: list[Bound | Derived] = [*bounds, *derived]
    for rule in rules:
        problems += [
            f"unknown name '{name}' in '{rule}'{nearest(name, known)}{at(rule.place)}"
            for name in sorted(rule.names - set(known))
        ]
    cycle = _cycle(known, bounds, derived)
    if cycle:
        places = {b.place for b in bounds if b.target in cycle and b.names & set(cycle)}
        places |= {d.place for d in derived if d.name in cycle and d.names & set(cycle)}
        problems.append(
            f"constraints must not form a cycle, got {' → '.join(cycle)} "
            f"(each limits the next){at('; '.join(sorted(places - {''})))}"
        )
    return problems


def order(
    names: Sequence[str], bounds: Sequence[Bound], derived: Sequence[Derived]
) -> tuple[str, ...]:
    """Return ``names`` so that each comes after all that limit it.

    Raises:
        CycleError: there is no such order (``problems_of`` names the cycle).
    """
    return tuple(_graph(names, bounds, derived).static_order())


def _graph(
    names: Sequence[str], bounds: Sequence[Bound], derived: Sequence[Derived]
) -> TopologicalSorter[str]:
    graph: TopologicalSorter[str] = TopologicalSorter(dict.fromkeys(names, ()))
    for bound in bounds:
        graph.add(bound.target, *sorted(bound.names))
    for one in derived:
        graph.add(one.name, *sorted(one.names))
    return graph


def _cycle(
    names: Sequence[str], bounds: Sequence[Bound], derived: Sequence[Derived]
) -> tuple[str, ...]:
    try:
        _graph(names, bounds, derived).prepare()
    except CycleError as error:
        return tuple(error.args[1])
    return ()
