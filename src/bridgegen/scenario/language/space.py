"""The search space: points of the unit cube to rows of parameters that keep every constraint."""

from collections.abc import Iterable, Mapping
from itertools import product
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Float, as_float
from bridgegen.base.errors import ScenarioError, UnknownNameError
from bridgegen.scenario.language.constraints import (
    Constraints,
    Violation,
    order,
    problems_of,
    violations,
)
from bridgegen.scenario.language.kinds import slack
from bridgegen.scenario.language.parameters import Bound, Derived, Parameter, at, nearest, read_axes
from bridgegen.scenario.language.prior import Band

# Points at which a new space is tried: all corners of the cube up to _CORNERS, and as many others.
_CORNERS = 2048


class SearchSpace:
    """What is searched of a scenario, and how a point of the unit cube becomes a row.

    Decoding takes the parameters in an order in which each comes after all that limit it, and
    spreads each over the interval that the earlier ones leave to it (``Parameter.at``), evenly or
    by its prior. So every
    point of the cube is feasible, and no algorithm needs a penalty. A parameter that is not
    searched stands at its default, or where ``fixed`` puts it, moved into its interval where a
    bound asks for it. Derived quantities follow.

    Attributes:
        name: of the scenario that is searched.
        constraints: what the space is made of.
        parameters: its parameters by name, searched or not.
        axes: the axes that are searched.
        variables: the searched parameters, in declared order: the columns of U. One whose low is
            its high is not searched.
        decisions: those of the parameters that are an adversary's decisions, of which only the
            course that comes of all of them means something.
        names: every parameter, then every derived quantity, in declared order: the columns of X.
        units: the unit of each of ``names``.
        order: all of ``names``, each after those that it follows from or that limit it.
        bounds: per parameter, what limits it.
        derived: the derived quantities by name.
        fixed: the values of the parameters that are held at one.
        defaults: where each parameter stands while it is not searched.

    Args:
        constraints: what it is made of.
        axes: what to search; the constraints' own choice if ``None``.
        fixed: parameters to hold at a value instead of searching them; that of a category by its
            name.
        name: of the scenario, for messages.
        decisions: the parameters that are an adversary's decisions.

    Raises:
        UnknownNameError: no such axis or parameter.
        ScenarioError: constraints that cannot be computed, a fixed value outside its range, or
            constraints that leave a parameter no value somewhere in the cube.
    """

    def __init__(
        self,
        constraints: Constraints,
        axes: Iterable[str] | None = None,
        fixed: Mapping[str, float | str] | None = None,
        *,
        name: str = "",
        decisions: Iterable[str] = (),
    ) -> None:
        self.name, self.constraints = name, constraints
        self.axes = read_axes(constraints.axes if axes is None else axes)
        self.parameters = parameters = constraints.parameters
        fixed, unread = _read_fixed(fixed or {}, parameters)
        self.fixed = fixed
        problems = problems_of(parameters.values(), constraints.bounds, constraints.derived)
        problems += unread + _fixed_problems(fixed, constraints)
        if problems:
            raise ScenarioError(*problems)
        columns: list[Parameter | Derived] = [*parameters.values(), *constraints.derived]
        self.names = tuple(column.name for column in columns)
        self.units = tuple(column.unit for column in columns)
        self.variables = tuple(
            p.name
            for p in parameters.values()
            if p.axis in self.axes and p.name not in fixed and p.low < p.high
        )
        self.decisions = frozenset(decisions)
        self.defaults = {p.name: p.default for p in parameters.values()} | fixed
        self._columns = {name: number for number, name in enumerate(self.names)}
        self.derived = {derived.name: derived for derived in constraints.derived}
        self.bounds: dict[str, tuple[Bound, ...]] = {
            name: tuple(b for b in constraints.bounds if b.target == name) for name in parameters
        }
        self.order = order(self.names, constraints.bounds, constraints.derived)
        # Tried when it is made: constraints that leave a parameter no value somewhere are told to
        # the author, and not to whom a search meets them after hours.
        self._decode(probes(self.n_var))

    @property
    def n_var(self) -> int:
        """Number of searched parameters: columns of U."""
        return len(self.variables)

    @property
    def levels(self) -> tuple[int, ...]:
        """Per column of U, into how many equal intervals it is divided, each a single value.

        0: it is continuous, or the intervals depend on other columns.
        """
        searched = [self.parameters[name] for name in self.variables]
        return tuple(
            round(parameter.high - parameter.low) + 1
            if parameter.kind.apart and not self.bounds[parameter.name]
            else 0
            for parameter in searched
        )

    @property
    def labels(self) -> dict[str, dict[str, Any]]:
        """How the values of its parameters are read, of those that are no plain numbers."""
        labels = {name: parameter.kind.labels() for name, parameter in self.parameters.items()}
        return {name: label for name, label in labels.items() if label}

    def index(self, name: str) -> int:
        """Return the column of X that holds ``name``.

        Raises:
            UnknownNameError: no such parameter.
        """
        if name not in self._columns:
            raise UnknownNameError("parameter", name, self.names)
        return self._columns[name]

    def values(self, row: npt.ArrayLike) -> dict[str, float]:
        """Return one row of X by name.

        Raises:
            ValueError: wrong length.
        """
        array = as_float("a row of X", row, (len(self.names),))
        return dict(zip(self.names, array.tolist(), strict=True))

    def decode(self, U: npt.ArrayLike) -> Float:
        """Turn points of the unit cube into feasible rows.

        Args:
            U: ``(N, n_var)`` in [0, 1].

        Returns:
            X ``(N, len(names))``. A row has the same bits whatever the rows around it.

        Raises:
            ValueError: wrong shape, or a value outside [0, 1].
            ScenarioError: the constraints leave a parameter no value at some row.
        """
        cube = as_float("U", U, (None, self.n_var))
        if cube.size and not (cube.min() >= 0.0 and cube.max() <= 1.0):
            row, column = np.argwhere((cube < 0.0) | (cube > 1.0))[0].tolist()
            raise ValueError(
                f"0 <= U <= 1 must hold for {self.variables[column]}, "
                f"got {float(cube[row, column])!r} in row {row}"
            )
        return self._decode(cube)

    def encode(self, X: npt.ArrayLike) -> Float:
        """Return the points of the unit cube that decode to these rows.

        Where an interval has no width any point would do: 0.5 is returned.

        Args:
            X: ``(N, len(names))``, rows of this space.

        Returns:
            U ``(N, n_var)``; ``decode`` gives X back, up to rounding.

        Raises:
            ValueError: wrong shape, or NaN or inf.
            ScenarioError: a row that no point decodes to: infeasible, or with a value other
                than this space's in a column that it does not search.
        """
        rows = as_float("X", X, (None, len(self.names)))
        table = self._table(rows)
        cube = np.empty((len(rows), self.n_var))
        for number, name in enumerate(self.variables):
            lo, hi = self.interval(name, table)
            cube[:, number] = self.parameters[name].share(table[name], lo, hi)
        back = self._decode(cube)
        # Decoded again: an infeasible row, or one of another space, has shares, too, but not its
        # own values.
        wrong = np.argwhere(np.abs(rows - back) > slack(back)).tolist()
        if wrong:
            raise ScenarioError(
                *(
                    f"no point of the unit cube decodes to row {row}: "
                    f"{self.names[column]} [{self.units[column]}] would be "
                    f"{float(back[row, column]):.6g}, got {float(rows[row, column]):.6g}"
                    for row, column in wrong[:10]
                )
            )
        return cube

    def row(self, values: Mapping[str, float]) -> Float:
        """Return the row of X with the given values, and the others at their defaults.

        Defaults are moved into the interval that the given values leave them. A given value is
        kept to the last bit, whether this space searches it or not.

        Args:
            values: by name; a derived quantity may be given if it equals its formula's value.

        Returns:
            ``(len(names),)``.

        Raises:
            UnknownNameError: no such parameter.
            ScenarioError: a given value breaks a constraint; all that do.
        """
        for name in values:
            self.index(name)
        table: dict[str, Float | float] = {}
        for name in self.order:
            if name in values:
                table[name] = float(values[name])
            elif name in self.derived:
                table[name] = float(self.derived[name].value.evaluate(table))
            else:
                lo, hi = self.interval(name, table)
                table[name] = float(np.clip(self.defaults[name], lo, hi))
        row = np.array([table[name] for name in self.names], dtype=np.float64)
        broken = self.violations(row[None, :])
        if broken:
            raise ScenarioError(*(violation.reason for violation in broken))
        return row

    def rows(self, columns: Mapping[str, Float], count: int) -> Float:
        """Return rows with given values, and the others at their defaults, as `row` does.

        Args:
            columns: ``(count,)`` values by parameter; they may break a constraint.
            count: number of rows.

        Returns:
            ``(count, len(names))``; `violations` says which break one.

        Raises:
            ScenarioError: the constraints leave a parameter no value at some row.
        """
        result = np.empty((len(self.names), count))
        table: dict[str, Float | float] = {}
        for name in self.order:
            out = result[self._columns[name]]
            if name in columns:
                out[:] = columns[name]
            elif name in self.derived:
                out[:] = self.derived[name].value.evaluate(table)
            else:
                out[:] = np.clip(self.defaults[name], *self.interval(name, table))
            table[name] = out
        return np.ascontiguousarray(result.T)

    def violations(self, X: npt.ArrayLike) -> list[Violation]:
        """Check rows against every range, bound and formula, independently of the decoder.

        Args:
            X: ``(N, len(names))``; NaN and inf are violations.

        Returns:
            All that is wrong, by row; nothing if the rows are feasible to ``TOLERANCE``.

        Raises:
            ValueError: wrong shape.
        """
        rows = as_float("X", X, (None, len(self.names)), finite=False)
        return violations(self.constraints, self._table(rows))

    def bands(self, values: Mapping[str, float]) -> list[Band]:
        """Return in which bands of their priors values of searched parameters lie."""
        priors = ((name, self.parameters[name].prior) for name in self.variables)
        return [prior.band(values[name]) for name, prior in priors if prior is not None]

    def _table(self, rows: Float) -> dict[str, Float]:
        return dict(zip(self.names, np.ascontiguousarray(rows.T), strict=True))

    def _decode(self, cube: Float) -> Float:
        shares = dict(zip(self.variables, np.ascontiguousarray(cube.T), strict=True))
        # What formulas read; a parameter that never moves stays one number in it.
        table: dict[str, Float | float] = {}
        result = np.empty((len(self.names), len(cube)))
        for name in self.order:
            out = result[self._columns[name]]
            if name in self.derived:
                out[:] = self.derived[name].value.evaluate(table)
                derived = self.derived[name]
                problem = f"'{derived}'{at(derived.place)} has no value"
                self._refuse(problem, derived.names, table, ~np.isfinite(out))
                table[name] = out
                continue
            if name not in shares and not self.bounds[name]:
                out[:] = table[name] = self.defaults[name]
                continue
            lo, hi = self.interval(name, table)
            if name in shares:
                out[:] = self.parameters[name].at(shares[name], lo, hi)
            else:
                out[:] = np.clip(self.defaults[name], lo, hi)
            table[name] = out
        return np.ascontiguousarray(result.T)

    def interval(
        self, name: str, table: Mapping[str, Float | float]
    ) -> tuple[Float | float, Float | float]:
        """Return the lowest and the highest value that the columns before it leave a parameter.

        Args:
            name: the parameter.
            table: those that come before it in ``order``, by name: a number or ``(N,)`` each.

        Raises:
            ScenarioError: they leave it no value in some row.
        """
        parameter = self.parameters[name]
        if not self.bounds[name]:
            return parameter.low, parameter.high
        lo: Float | float = parameter.low
        hi: Float | float = parameter.high
        for bound in self.bounds[name]:
            if bound.lo is not None:
                lo = np.maximum(lo, bound.lo.evaluate(table))
            if bound.hi is not None:
                hi = np.minimum(hi, bound.hi.evaluate(table))
        lo, hi, empty = parameter.kind.narrowed(lo, hi)
        rules = " and ".join(f"'{bound}'{at(bound.place)}" for bound in self.bounds[name])
        label = f"{name} [{parameter.unit}], {parameter.low:g} to {parameter.high:g}"
        names = frozenset().union(*(bound.names for bound in self.bounds[name]))
        self._refuse(f"{rules} leaves no value to {label},", names, table, empty)
        # Where limits cross, by less than the tolerance, the upper one holds; inside the range.
        return lo, np.clip(hi, parameter.low, parameter.high)

    def _refuse(
        self,
        problem: str,
        names: Iterable[str],
        table: Mapping[str, Float | float],
        bad: Bool,
    ) -> None:
        """Raise, if any row is bad, the error of a constraint that cannot be kept at the first."""
        if bad.any():
            row = int(np.flatnonzero(bad)[0])
            columns = {name: np.atleast_1d(table[name]) for name in sorted(names)}
            values = [f"{n}={float(c[row % len(c)]):.6g}" for n, c in columns.items()]
            raise ScenarioError(f"{problem} at {', '.join(values) or 'any row'}")


def _read_fixed(
    given: Mapping[str, float | str], parameters: Mapping[str, Parameter]
) -> tuple[dict[str, float], list[str]]:
    """Return the inner values to hold parameters at, and which are none."""
    fixed: dict[str, float] = {}
    problems: list[str] = []
    for name, value in given.items():
        try:
            fixed[name] = parameters[name].read(value) if name in parameters else float(value)
        except ScenarioError as error:
            problems += error.problems
        except ValueError:
            problems.append(f"cannot fix '{name}' at '{value}'{nearest(name, parameters)}")
    return fixed, problems


def _fixed_problems(fixed: Mapping[str, float], constraints: Constraints) -> list[str]:
    problems = []
    parameters = constraints.parameters
    derived = {item.name: item for item in constraints.derived}
    for name, value in fixed.items():
        if name in derived:
            problems.append(f"cannot fix '{name}', which follows from '{derived[name]}'")
            continue
        if name not in parameters:
            problems.append(f"cannot fix the unknown parameter '{name}'{nearest(name, parameters)}")
            continue
        parameter = parameters[name]
        if not parameter.low <= value <= parameter.high:
            rule = parameter.kind.rule(name, parameter.low, parameter.high)
            problems.append(f"{rule} [{parameter.unit}] must hold, got {value!r}")
        elif (kept := parameter.kind.kept(np.array([value]))) and value != round(value):
            problems.append(f"{name} [{parameter.unit}] must be {kept[1]}, got {value!r}")
    return problems


def probes(n_var: int) -> Float:
    """Return points that show what a space can hold: corners (all, if few) and others."""
    # A seed of its own: whether a scenario can be searched must not depend on the search.
    random = np.random.default_rng(0)
    if 2**n_var <= _CORNERS:
        corners = np.array(list(product((0.0, 1.0), repeat=n_var)))
    else:
        corners = random.integers(0, 2, (_CORNERS, n_var)).astype(np.float64)
    return np.concatenate([corners, random.random((_CORNERS, n_var))])
