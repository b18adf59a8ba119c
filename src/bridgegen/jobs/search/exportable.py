"""Checks, before a search, that its scenarios can be exported.

A scenario's individuals satisfy its constraints by construction, but not the ontology's rules on
roads, lanes and participants: a bus may start on a shoulder. The export refuses such a scenario. So
the defaults and the corners of the ranges are built, checked and simulated as at export.
"""

from collections.abc import Iterator

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError, OntologyError, ScenarioError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.openx.openscenario.write import to_xml as scenario_xml
from bridgegen.scenario.ontology.check import check
from bridgegen.simulation.rollout import STATUS_MESSAGES

CHECKED, CHECKED_BY_VALIDATE = 3, 6
"""Number of rows that are validated against the ontology (SHACL), some 80 ms each: the defaults,
the lowest and the highest values; and some ends of single parameters."""

MOST_CORNERS = 64
"""Largest number of searched parameters whose two ends are simulated."""

FAULTS_OF_THE_SCENARIO = range(2, 7)
"""Statuses of a row whose places or ways do not exist."""


def corners(pipeline: Pipeline) -> tuple[Float, tuple[str, ...]]:
    """Return the rows to check, ``(N, len(space.names))``, and a description of each.

    The defaults, all parameters at their lowest and highest values, and each parameter at these
    with the others at their defaults. Constraints move them as they move any row of a search.
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
        # One parameter at a time: the corners of n ranges would be 2**n rows.
        for i, name in enumerate(space.variables[:MOST_CORNERS]):
            for value, which in ((0.0, "lowest"), (1.0, "highest")):
                item = u.copy()
                item[i] = value
                cube.append(item)
                words.append(f"with {name} at its {which}")
        rows += list(space.decode(np.array(cube)))
    return np.array(rows), tuple(words)


def require_exportable(pipeline: Pipeline, checked: int = CHECKED) -> None:
    """Build, check and simulate the corners of a scenario's ranges.

    Args:
        pipeline: of the search, its kernels compiled.
        checked: rows that are validated against the ontology, 3 or more.

    Raises:
        OntologyError: individuals break a rule, in the words of the export.
        InputError: the scenario cannot be built, or not simulated with its defaults.
    """
    X, words = corners(pipeline)
    if problems := list(dict.fromkeys(_export_problems(pipeline, X, words, checked))):
        raise OntologyError(*problems)
    if pipeline.runner.simulator is not pipeline.runner.embedded or pipeline.driver.is_own:
        return  # other simulators and drivers take seconds a row
    status = np.empty(len(X), np.int8)
    for at, runner in pipeline.runner.by_variant(X):
        status[at] = runner.run(X[at]).status
    if status[0] in FAULTS_OF_THE_SCENARIO:
        raise InputError(f"{pipeline.scenario.place}: {words[0]}: {STATUS_MESSAGES[status[0]]}")


def _export_problems(
    pipeline: Pipeline, X: Float, words: tuple[str, ...], checked: int
) -> Iterator[str]:
    """Yield the problems for which the export would refuse some of the rows."""
    place, seen = pipeline.scenario.place, set[str]()
    first = min(3, len(X))
    more = np.linspace(first, len(X) - 1, checked - first).astype(int) if len(X) > first else ()
    for i in dict.fromkeys([*range(first), *map(int, more)]):
        concrete = pipeline.runner.concrete(X[i], "roads.xodr")
        # Only for what it raises, as the export would; the text is not needed.
        scenario_xml(concrete.storyboard)
        if concrete.individuals is None:
            return
        for violation in check(concrete.individuals, pipeline.runner.source.constraints):
            if str(violation) not in seen:
                seen.add(str(violation))
                yield f"{place}: {words[i]}: {violation}"
