"""The rows of a scenario that a suite runs: all variations, or a sample of its space."""

import math
from itertools import product

import numpy as np

from bridgegen.arrays import Float
from bridgegen.errors import InputError
from bridgegen.odd.distributions import Discrete
from bridgegen.odd.kinds import INTEGER
from bridgegen.odd.parameters import Parameter
from bridgegen.odd.scenario import SearchedScenario
from bridgegen.odd.space import SearchSpace
from bridgegen.openx.file_scenario import FileScenario
from bridgegen.openx.openscenario import distributions as dst
from bridgegen.openx.openscenario.ranges import FileParameter

MOST_ROWS = 100_000
"""Variations of one entry."""

_DRAWS = 31  # a stream of random numbers of its own


def rows_of(
    scenario: SearchedScenario, space: SearchSpace, samples: int, seed: int
) -> tuple[Float, int]:
    """Return the rows that a suite runs of a scenario.

    Of a deterministic distribution all combinations of its values; of a stochastic one as many
    draws as it asks for; of a logical scenario its defaults, then ``samples`` evenly spread rows (a
    scrambled Sobol sequence); of a scenario in which nothing varies that one.

    Returns:
        X: ``(N, len(space.names))``; and the number of combinations that the scenario's own
        constraints exclude, which are not among them.

    Raises:
        InputError: there are more than MOST_ROWS, or none is left.
    """
    X = _all(scenario, space, samples, seed)
    table = {name: X[:, i] for i, name in enumerate(space.names)}
    excluded = np.zeros(len(X), np.bool_)
    for rows in scenario.broken(table).values():
        excluded |= rows
    if excluded.all():
        raise InputError(f"{scenario.place}: the scenario's constraints exclude all variations")
    return X[~excluded], int(excluded.sum())


def is_sample(scenario: SearchedScenario) -> bool:
    """Whether the rows that a suite runs of a scenario are some of very many, not all there are."""
    return not isinstance(scenario, FileScenario) or isinstance(scenario.definition, dst.Stochastic)


def _all(scenario: SearchedScenario, space: SearchSpace, samples: int, seed: int) -> Float:
    """Return all rows, those that the scenario's constraints exclude among them."""
    if not space.n_var:
        return space.row({})[np.newaxis]
    if isinstance(scenario, FileScenario):
        if isinstance(scenario.definition, dst.Stochastic):
            _check(scenario.budget, scenario.place)
            rng = np.random.Generator(np.random.PCG64([scenario.seed, _DRAWS]))
            return space.decode(rng.random((scenario.budget, space.n_var)))
        return _combinations(scenario, space)
    _check(samples + 1, scenario.place)
    from scipy.stats import qmc

    engine = qmc.Sobol(space.n_var, scramble=True, rng=np.random.default_rng([seed, _DRAWS]))
    power = max(0, math.ceil(math.log2(max(samples, 1))))
    U = engine.random_base2(power)[:samples]
    return np.concatenate([space.row({})[np.newaxis], space.decode(U)])


def _check(count: int, place: str) -> None:
    if count > MOST_ROWS:
        raise InputError(f"{place}: a suite runs at most {MOST_ROWS} variations, got {count}")


def _combinations(scenario: FileScenario, space: SearchSpace) -> Float:
    """Return all combinations of the values of a deterministic distribution."""
    choices = [_values(space.parameters[name]) for name in space.variables]
    _check(math.prod(map(len, choices)), scenario.place)
    rows = []
    for one in product(*choices):
        table: dict[str, Float | float] = dict(zip(space.variables, one, strict=True))
        for name in space.order:
            if name in space.derived:
                table[name] = float(space.derived[name].value.evaluate(table))
            elif name not in table:
                table[name] = space.defaults[name]
        rows.append([float(table[name]) for name in space.names])
    return np.array(rows, dtype=np.float64)


def _values(one: Parameter) -> list[float]:
    """Return the values that a parameter of a deterministic distribution takes."""
    if isinstance(one, FileParameter) and isinstance(one.distribution, Discrete):
        return list(one.distribution.values)
    assert one.kind is INTEGER, one.name  # which set of a joint distribution
    return [float(value) for value in range(int(one.low), int(one.high) + 1)]
