"""The grid of a map: axes over parameters of a scenario, and the rows of its cells."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError
from bridgegen.scenario.language.kinds import slack
from bridgegen.scenario.language.parameters import Parameter
from bridgegen.scenario.language.space import SearchSpace

MOST_CELLS = 50_000_000
"""Maximum number of cells of a map; a larger number is a typing error."""


@dataclass(frozen=True)
class GridAxis:
    """One axis of a grid: values of a parameter, evenly spaced, both ends included.

    Attributes:
        low: the first value; a number in the parameter's unit, or a text with a unit.
        high: the last value, likewise.
        n: how many values, ≥ 1; the first alone if it is 1.
    """

    low: float | str
    high: float | str
    n: int


def read_axis(text: str) -> tuple[str, GridAxis]:
    """Read ``NAME=LOW:HIGH:N``.

    Raises:
        InputError: it does not read so.
    """
    name, equals, rest = text.partition("=")
    parts = [part.strip() for part in rest.split(":")]
    if not (name and equals) or len(parts) != 3 or not all(parts):
        raise InputError(f"--grid must read NAME=LOW:HIGH:N, got '{text}'")
    try:
        n = int(parts[2])
    except ValueError:
        raise InputError(f"--grid {name}: N must be a whole number, got '{parts[2]}'") from None
    return name, GridAxis(_plain(parts[0]), _plain(parts[1]), n)


def _plain(text: str) -> float | str:
    try:
        return float(text)
    except ValueError:
        return text


@dataclass(frozen=True)
class Grid:
    """The cells of a map, numbered with the last axis fastest.

    Attributes:
        names: of the axes' parameters.
        units: of them.
        values: ``(n,)`` float64 of each axis, ascending.
        space: the scenario's; its other parameters are at their defaults. Where a cell's values
            do not allow that, the cell does not apply.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    values: tuple[Float, ...]
    space: SearchSpace

    @classmethod
    def of(cls, space: SearchSpace, axes: Mapping[str, GridAxis]) -> Self:
        """Return the grid of some axes.

        Raises:
            InputError: no axis, a parameter that is not the scenario's or is no number, a value
                beyond its range, or too many cells; all that is wrong.
        """
        problems: list[str] = []
        if not axes:
            raise InputError("a map needs an axis at least (--grid NAME=LOW:HIGH:N)")
        # Only for the message, which names first what the user would vary.
        searched_first = sorted(space.parameters, key=lambda name: name not in space.variables)
        numbers = [name for name in searched_first if _is_number(space.parameters[name])]
        values = []
        for name, axis in axes.items():
            if name not in numbers:
                what = "is no number" if name in space.parameters else "is no parameter"
                problems.append(
                    f"--grid {name}: {what} of {space.name}; these are: {', '.join(numbers)}"
                )
                continue
            try:
                values.append(_values(space.parameters[name], axis))
            except InputError as error:
                problems += [f"--grid {name}: {problem}" for problem in error.problems]
        if problems:
            raise InputError(*problems)
        cells = math.prod(len(value) for value in values)
        if cells > MOST_CELLS:
            raise InputError(f"a map has at most {MOST_CELLS:,} cells, got {cells:,}")
        units = tuple(space.parameters[name].unit for name in axes)
        return cls(tuple(axes), units, tuple(values), space)

    @property
    def shape(self) -> tuple[int, ...]:
        """The number of values of each axis."""
        return tuple(len(value) for value in self.values)

    @property
    def cells(self) -> int:
        """The number of cells."""
        return math.prod(self.shape)

    def to_dict(self) -> list[dict[str, Any]]:
        """Return the axes as JSON's types."""
        return [
            {"name": name, "unit": unit, "low": float(v[0]), "high": float(v[-1]), "n": len(v)}
            for name, unit, v in zip(self.names, self.units, self.values, strict=True)
        ]

    def rows(self, start: int, stop: int) -> tuple[Float, Bool]:
        """Return the rows of consecutive cells.

        Args:
            start: number of the first cell.
            stop: number after the last.

        Returns:
            X ``(n, len(space.names))``, and ``(n,)`` which of them keep the scenario's
            constraints; the others hold nothing of use.
        """
        space, at = self.space, np.unravel_index(np.arange(start, stop), self.shape)
        given = {
            name: values[i] for name, values, i in zip(self.names, self.values, at, strict=True)
        }
        X = np.empty((stop - start, len(space.names)))
        ok = np.ones(stop - start, np.bool_)
        table: dict[str, Float | float] = {}
        with np.errstate(all="ignore"):  # of cells that break a constraint
            # Bounds and derived values are of parameters that come before: each is computed after
            # them.
            for name in space.order:
                if name in space.derived:
                    value = np.broadcast_to(space.derived[name].value.evaluate(table), len(X))
                    ok &= np.isfinite(value)
                else:
                    value = self._parameter(name, given, table, ok)
                X[:, space.index(name)] = table[name] = value
        return X, ok

    def _parameter(
        self, name: str, given: Mapping[str, Float], table: Mapping[str, Float | float], ok: Bool
    ) -> Float:
        """Return a parameter's value in each cell; ``ok`` becomes false where it has none."""
        parameter, n = self.space.parameters[name], len(ok)
        lo = np.full(n, parameter.low)
        hi = np.full(n, parameter.high)
        for bound in self.space.bounds[name]:
            if bound.lo is not None:
                lo = np.maximum(lo, bound.lo.evaluate(table))
            if bound.hi is not None:
                hi = np.minimum(hi, bound.hi.evaluate(table))
        value = given[name] if name in given else np.full(n, self.space.defaults[name])
        # A cell that breaks a constraint stays empty; moving it inside would show another cell's
        # outcome in its place.
        ok &= (value >= lo - slack(lo)) & (value <= hi + slack(hi))
        return value


def _is_number(parameter: Parameter) -> bool:
    return parameter.kind.name == "float"


def _values(parameter: Parameter, axis: GridAxis) -> Float:
    """Return an axis' values.

    Raises:
        InputError: a number of values below 1, ends in the wrong order or beyond the range.
    """
    low, high = parameter.read(axis.low), parameter.read(axis.high)
    if axis.n < 1:
        raise InputError(f"N must be at least 1, got {axis.n}")
    if axis.n > MOST_CELLS:
        raise InputError(f"N must be at most {MOST_CELLS:,}, got {axis.n:,}")
    if not low <= high:
        raise InputError(f"low <= high must hold, got {low:g} and {high:g} {parameter.unit}")
    if low < parameter.low - slack(parameter.low) or high > parameter.high + slack(parameter.high):
        raise InputError(
            f"must lie within {parameter.low:g} to {parameter.high:g} {parameter.unit}, got "
            f"{low:g} to {high:g}"
        )
    return np.linspace(low, high, axis.n)


DEFAULT_GRIDS: Mapping[str, Mapping[str, GridAxis]] = {
    "r157-cut-in": {
        "gap": GridAxis(1.0, 120.0, 60),
        "relative_speed": GridAxis("10 km/h", "90 km/h", 41),
        "lateral_speed": GridAxis(0.3, 1.8, 6),
        "ego_speed": GridAxis("60 km/h", "130 km/h", 2),
    },
    "r157-cut-out": {
        "gap": GridAxis(5.0, 150.0, 59),
        "ego_speed": GridAxis("10 km/h", "130 km/h", 49),
        "lateral_speed": GridAxis(0.5, 2.4, 6),
    },
    "r157-deceleration": {
        "deceleration": GridAxis("0.05 g", "1 g", 39),
        "ego_speed": GridAxis("10 km/h", "130 km/h", 49),
        "headway": GridAxis(1.0, 2.0, 6),
    },
}
"""The grids of the regulation's three disturbances, by the scenario's name, where none is given."""


def coarse_axes(name: str, space: SearchSpace, most: int) -> Mapping[str, GridAxis] | None:
    """Return the default grid of a scenario with every second value of its longest axes, or less.

    Args:
        name: of the scenario.
        space: its space.
        most: cells.

    Returns:
        The axes; None for a scenario without a default that fits its space.
    """
    axes = dict(DEFAULT_GRIDS.get(name, {}))
    try:
        grid = Grid.of(space, axes)
    except InputError:
        return None
    while grid.cells > most:
        longest = max(axes, key=lambda axis: axes[axis].n)
        # Both ends stay, and of an odd number of values every second one: the coarse map's cells
        # are the fine one's.
        axes[longest] = replace(axes[longest], n=(axes[longest].n + 1) // 2)
        grid = Grid.of(space, axes)
    return axes


def grid_of(
    name: str, space: SearchSpace, axes: Mapping[str, GridAxis] | Sequence[str] | None
) -> Grid:
    """Return the grid that is asked for, or the default of a scenario.

    Args:
        name: of the scenario.
        space: its space.
        axes: by the names of parameters, the pictures' X axis first, then Y, then what the
            pictures differ in; or texts ``NAME=LOW:HIGH:N``.

    Raises:
        InputError: see `Grid.of`; an axis twice; or none for a scenario without a default.
    """
    if axes is None or not len(axes):
        if name not in DEFAULT_GRIDS:
            raise InputError(
                f"{name} has no grid of its own: name its axes (--grid NAME=LOW:HIGH:N; see "
                "'bridgegen list parameters')"
            )
        return Grid.of(space, DEFAULT_GRIDS[name])
    if not isinstance(axes, Mapping):
        read = [read_axis(text) for text in axes]
        if len(dict(read)) < len(read):
            raise InputError("--grid: each parameter may be an axis once")
        axes = dict(read)
    return Grid.of(space, axes)
