"""The rows of a scenario that a suite runs: all variations, or a sample of its space."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError
from bridgegen.openx.file_scenario import FileScenario
from bridgegen.openx.openscenario import distributions as dst
from bridgegen.openx.openscenario.ranges import FileParameter
from bridgegen.scenario.language.distributions import Discrete
from bridgegen.scenario.language.kinds import INTEGER
from bridgegen.scenario.language.parameters import Parameter
from bridgegen.scenario.language.protocols import Grid
from bridgegen.scenario.language.scenario import LogicalScenario, SearchedScenario
from bridgegen.scenario.language.space import SearchSpace

MOST_ROWS = 100_000
"""Largest number of variations of one entry."""

_DRAWS = 31  # a stream of random numbers of its own


NO_MATRIX = "none"
"""Name in place of an edition for evenly spread rows, also of scenarios with a matrix."""


@dataclass(frozen=True)
class Rows:
    """What a suite runs of a scenario.

    Attributes:
        X: ``(N, len(space.names))``.
        names: of the columns that tell its rows apart.
        excluded: number of combinations that the scenario's own constraints exclude.
        grids: of the matrix that it runs; empty: none.
        grid: ``(N,)`` which of them each row belongs to.
        strata: ``(N,)`` where an assessor drew each row; empty: none did.
    """

    X: Float
    names: tuple[str, ...]
    excluded: int
    grids: tuple[Grid, ...] = ()
    grid: tuple[int, ...] = ()
    strata: tuple[str, ...] = ()


def matrix_of(scenario: SearchedScenario, edition: str | None) -> tuple[Grid, ...]:
    """Return the grids of an edition, of all if it is None; none if rows are drawn instead."""
    if not isinstance(scenario, LogicalScenario) or edition == NO_MATRIX:
        return ()
    return tuple(grid for grid in scenario.matrix if edition in (None, grid.edition))


def rows_of(
    scenario: SearchedScenario,
    space: SearchSpace,
    samples: int,
    seed: int,
    edition: str | None = None,
) -> Rows:
    """Return the rows that a suite runs of a scenario.

    Of a deterministic distribution all combinations of its values; of a stochastic one as many
    draws as it asks for; of a logical scenario its matrix, or else its defaults, then ``samples``
    evenly spread rows (a scrambled Sobol sequence); of a scenario in which nothing varies that one.

    Raises:
        InputError: there are more than MOST_ROWS, or none is left.
    """
    if grids := matrix_of(scenario, edition):
        return _of_matrix(scenario, space, grids)
    X = _all(scenario, space, samples, seed)
    table = {name: X[:, i] for i, name in enumerate(space.names)}
    excluded = np.zeros(len(X), np.bool_)
    for rows in scenario.broken(table).values():
        excluded |= rows
    shown = {*space.variables, *space.derived}
    names = tuple(name for name in space.names if name in shown)
    return Rows(_some(X, excluded, scenario), names, int(excluded.sum()))


def _of_matrix(scenario: SearchedScenario, space: SearchSpace, grids: Sequence[Grid]) -> Rows:
    """Return all combinations of some grids that keep the scenario's constraints."""
    X = np.concatenate([space.rows(item.columns(), len(item)) for item in grids])
    grid = np.repeat(np.arange(len(grids)), [len(item) for item in grids])
    excluded = np.zeros(len(X), np.bool_)
    excluded[[violation.row for violation in space.violations(X)]] = True
    set_by_it = {name for item in grids for name in item.names}
    names = tuple(name for name in space.names if name in set_by_it)
    kept = _some(X, excluded, scenario)
    return Rows(kept, names, int(excluded.sum()), tuple(grids), tuple(grid[~excluded].tolist()))


def _some(X: Float, excluded: Bool, scenario: SearchedScenario) -> Float:
    if excluded.all():
        raise InputError(f"{scenario.place}: the scenario's constraints exclude all variations")
    return X[~excluded]


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
    for pair in product(*choices):
        table: dict[str, Float | float] = dict(zip(space.variables, pair, strict=True))
        for name in space.order:
            if name in space.derived:
                table[name] = float(space.derived[name].value.evaluate(table))
            elif name not in table:
                table[name] = space.defaults[name]
        rows.append([float(table[name]) for name in space.names])
    return np.array(rows, dtype=np.float64)


def _values(parameter: Parameter) -> list[float]:
    """Return the values that a parameter of a deterministic distribution takes."""
    if isinstance(parameter, FileParameter) and isinstance(parameter.distribution, Discrete):
        return list(parameter.distribution.values)
    assert parameter.kind is INTEGER, parameter.name  # which set of a joint distribution
    return [float(value) for value in range(int(parameter.low), int(parameter.high) + 1)]
