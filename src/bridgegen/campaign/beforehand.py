"""Would what a search finds be refused when it is exported? Tried before the search, at once.

A scenario's individuals keep its constraints by construction, but not what the ontology says of
roads, lanes and participants: a bus that starts on a shoulder and drives. Such a file is refused at
export, so that it is built, checked and simulated here as it would be then: at the defaults and at
the corners of the ranges.
"""

from collections.abc import Iterator

import numpy as np

from bridgegen.arrays import Float
from bridgegen.errors import InputError, OntologyError, ScenarioError
from bridgegen.ontology.check import check
from bridgegen.openx.openscenario.write import to_xml as scenario_xml
from bridgegen.pipeline import Pipeline
from bridgegen.simulation.rollout import STATUS_MESSAGES

CHECKED, CHECKED_BY_VALIDATE = 3, 6
"""Rows that are held against the ontology (SHACL), which takes some 80 ms each: the defaults, the
lowest and the highest values; and some ends of single parameters."""

MOST_CORNERS = 64
"""Searched parameters of which the two ends are tried."""

ITS_OWN_FAULT = range(2, 7)
"""Statuses of a row that are the scenario's fault: places and ways that are not there."""


def corners(pipeline: Pipeline) -> tuple[Float, tuple[str, ...]]:
    """Return the rows that are tried, ``(N, len(space.names))``, and what each is in words.

    The defaults, all parameters at their lowest and highest values, and each parameter at these
    with the others at their defaults. Constraints move them as they move what a search tries.
    """
    space = pipeline.space
    nominal = space.row({})
    rows, words = [nominal], ["with its defaults"]
    if space.n_var:
        try:
            u = space.encode(nominal[np.newaxis])[0]
        except ScenarioError:  # a default between two points of the search
            u = np.full(space.n_var, 0.5)
        cube = [np.zeros(space.n_var), np.ones(space.n_var)]
        words += ["with all parameters at their lowest", "with all parameters at their highest"]
        for i, name in enumerate(space.variables[:MOST_CORNERS]):
            for value, which in ((0.0, "lowest"), (1.0, "highest")):
                one = u.copy()
                one[i] = value
                cube.append(one)
                words.append(f"with {name} at its {which}")
        rows += list(space.decode(np.array(cube)))
    return np.array(rows), tuple(words)


def refuse_beforehand(pipeline: Pipeline, checked: int = CHECKED) -> None:
    """Build, check and simulate a scenario's corners; refuse what could not be exported.

    Args:
        pipeline: of the search; its kernels are compiled by now.
        checked: rows that are held against the ontology, 3 or more.

    Raises:
        OntologyError: individuals break a rule, in the words of the export.
        InputError: the scenario cannot be built, or not be simulated with its defaults.
    """
    X, words = corners(pipeline)
    if problems := list(dict.fromkeys(_export_problems(pipeline, X, words, checked))):
        raise OntologyError(*problems)
    if pipeline.simulator is not pipeline.simulator.embedded or pipeline.driver.is_own:
        return  # others take seconds a row
    status = pipeline.rollout(X).status
    if status[0] in ITS_OWN_FAULT:
        raise InputError(f"{pipeline.scenario.place}: {words[0]}: {STATUS_MESSAGES[status[0]]}")


def _export_problems(
    pipeline: Pipeline, X: Float, words: tuple[str, ...], checked: int
) -> Iterator[str]:
    """Yield what would keep some of the rows from being exported."""
    place, seen = pipeline.scenario.place, set[str]()
    first = min(3, len(X))
    more = np.linspace(first, len(X) - 1, checked - first).astype(int) if len(X) > first else ()
    for i in dict.fromkeys([*range(first), *map(int, more)]):
        concrete = pipeline.concrete(X[i], "roads.xodr")
        scenario_xml(concrete.storyboard)
        if concrete.individuals is None:
            return
        for violation in check(concrete.individuals, pipeline.source.constraints):
            if str(violation) not in seen:
                seen.add(str(violation))
                yield f"{place}: {words[i]}: {violation}"
