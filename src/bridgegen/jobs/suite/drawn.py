"""The variations that an assessor's secret draws of a scenario, by where they lie in its ranges."""

import hmac
from dataclasses import dataclass, replace

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.elementary import power
from bridgegen.base.errors import InputError
from bridgegen.jobs.suite.options import SAMPLES
from bridgegen.jobs.suite.rows import Rows, rows_of
from bridgegen.openx.openscenario.ranges import FileParameter
from bridgegen.scenario.language.constraints import violations
from bridgegen.scenario.language.distributions import Discrete
from bridgegen.scenario.language.kinds import FLOAT
from bridgegen.scenario.language.parameters import Parameter
from bridgegen.scenario.language.scenario import SearchedScenario
from bridgegen.scenario.language.space import SearchSpace

INSIDE, BOUND, BESIDE, OUTSIDE = "inside", "at a bound", "beside published", "outside"

SHARES = {BOUND: 0.2, BESIDE: 0.2, OUTSIDE: 0.2}
"""Shares of what is drawn; the rest lies inside."""

MARGIN = 0.02
"""How far beyond an end of its range a parameter is moved at most, as a share of the range."""

NEAREST, FARTHEST = 0.01, 0.5
"""How far each parameter is moved from a published variation [its unit: m, m/s, s, …], evenly by
the logarithm; at most `MARGIN` of its range. From what a driver can tell at all, to what nobody
would call another test."""

_TRIES = 8  # candidates for each variation, of which the first that keep the constraints are taken


@dataclass(frozen=True)
class Draw:
    """What an assessor's key draws of each scenario.

    Attributes:
        secret: from which all random numbers follow.
        number: of variations, those outside included.
        outside: whether those outside are meant, or all others.
    """

    secret: str
    number: int
    outside: bool = False


def numbers(number: int) -> dict[str, int]:
    """Return how many variations are drawn of each kind."""
    found = {name: int(share * number) for name, share in SHARES.items()}
    return {INSIDE: number - sum(found.values()), **found}


def drawn(scenario: SearchedScenario, space: SearchSpace, draw: Draw, digest: str) -> Rows:
    """Return the rows that a secret draws of a scenario, with the kind of each.

    Inside: evenly over the ranges. At a bound: one parameter at an end of its range, in half of the
    rows all. Beside published: next to what a suite runs by default. Outside: one parameter beyond
    an end, never below 0 where its range is not. All keep the scenario's constraints. A set of
    numbers in a distribution file stands for the range that it spans.

    Args:
        scenario: of which they are.
        space: its search space.
        draw: what is drawn.
        digest: of the scenario's files: another scenario has other random numbers.

    Raises:
        InputError: nothing can be drawn.
    """
    parameters = {name: _spanned(parameter) for name, parameter in space.parameters.items()}
    moved = [name for name in space.variables if parameters[name].kind == FLOAT]
    wide = parameters | {name: _widened(parameters[name]) for name in moved}
    rules = replace(space.constraints, parameters=parameters)
    space = SearchSpace(rules, space.axes, space.fixed, name=space.name, decisions=space.decisions)
    rules = replace(rules, parameters=wide)
    open_ended = [name for name in moved if wide[name] != parameters[name]]
    parts, excluded = dict[str, Float](), 0
    for name, number in numbers(draw.number).items():
        changed = {BESIDE: moved, OUTSIDE: open_ended}.get(name, list(space.variables))
        if (name == OUTSIDE) != draw.outside or not changed:
            continue
        # A stream for each kind, so that none depends on how many another one has.
        seed = hmac.digest(draw.secret.encode(), f"{digest} {name}".encode(), "sha256")
        rng = np.random.Generator(np.random.PCG64(int.from_bytes(seed, "big")))
        X = _candidates(name, scenario, space, wide, changed, number * _TRIES, rng)
        table = {column: X[:, i] for i, column in enumerate(space.names)}
        broken = np.zeros(len(X), np.bool_)
        broken[[violation.row for violation in violations(rules, table)]] = True
        for rows in scenario.broken(table).values():
            broken |= rows
        kept = np.flatnonzero(~broken)[:number]
        excluded += int(broken[: kept[-1] if len(kept) == number else None].sum())
        parts[name] = X[kept]
    if not any(map(len, parts.values())):
        raise InputError(f"{scenario.place}: no variation can be drawn: no number varies")
    X = np.concatenate(list(parts.values()))
    names = tuple(
        name
        for i, name in enumerate(space.names)
        if name in space.variables or name in space.derived or np.ptp(X[:, i])
    )
    return Rows(X, names, excluded, strata=tuple(n for n, part in parts.items() for _ in part))


def _candidates(
    name: str,
    scenario: SearchedScenario,
    space: SearchSpace,
    wide: dict[str, Parameter],
    changed: list[str],
    n: int,
    rng: np.random.Generator,
) -> Float:
    """Return rows of one kind; those beside published ones, or outside, may break a constraint."""
    U = rng.random((n, space.n_var))
    if name == BOUND:
        one = np.arange(n)[:, np.newaxis] % space.n_var == np.arange(space.n_var)
        U = np.where(one | (rng.random((n, 1)) < 0.5), rng.integers(0, 2, U.shape), U)
    X = space.decode(U)
    if name in (INSIDE, BOUND):
        return X
    if name == BESIDE:
        X = rows_of(scenario, scenario.space(), SAMPLES, 0).X
        X = X[rng.permutation(len(X))[np.arange(n) % len(X)]]
    columns = {item: X[:, space.index(item)].copy() for item in wide}
    for k, item in enumerate(changed):
        low, high, x = space.parameters[item].low, space.parameters[item].high, columns[item]
        sign, share = rng.choice([-1.0, 1.0], n), 1.0 - rng.random(n)  # never 0: no end itself
        if name == BESIDE:
            most = min(FARTHEST, MARGIN * (high - low))
            step = sign * most * power(min(1.0, NEAREST / most), 1.0 - share)
            columns[item] = np.where((x + step < low) | (x + step > high), x - step, x + step)
        else:
            # An end that is the world's, and not the file's, has nothing beyond it.
            sign = np.where(wide[item].low == low, 1.0, np.where(wide[item].high == high, -1, sign))
            beyond = np.where(sign < 0, low, high) + sign * share * MARGIN * (high - low)
            columns[item] = np.where(np.arange(n) % len(changed) == k, beyond, x)
    return space.rows(columns, n)


def _spanned(parameter: Parameter) -> Parameter:
    """Return a parameter whose set of numbers is the range that it spans."""
    if isinstance(parameter, FileParameter) and isinstance(parameter.distribution, Discrete):
        return replace(parameter, distribution=None) if parameter.kind == FLOAT else parameter
    return parameter


def _widened(parameter: Parameter) -> Parameter:
    """Return a parameter with a wider range: not below 0 if it is not, a percentage up to 100."""
    low, high = parameter.low, parameter.high
    more = MARGIN * (high - low)
    low = low - more if low < 0.0 or low >= more else low
    high = high + more if parameter.unit != "%" or high + more <= 100.0 else high
    return replace(parameter, low=low, high=high)
