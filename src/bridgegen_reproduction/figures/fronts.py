"""Hypervolume and spread over the evaluations."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.statistics import quartiles
from bridgegen.jobs.compare.fronts import spread
from bridgegen.jobs.compare.measures import Measured
from bridgegen.jobs.compare.plan import Cell
from bridgegen.jobs.compare.record import Record
from bridgegen_reproduction.figures.look import Theme, legend, looks, panels, title_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def spread_curve(record: Record, measured: Measured) -> Float:
    """Return a run's spread by each point of its curve, ``(c,)``; NaN where it is not defined."""
    values: list[float] = []
    last = None
    for front in record.fronts:
        if last is None or front is not last:
            value = spread(measured.scale.objectives(front), measured.reference)
        last = front
        values.append(value)
    return np.array(values)


def curves_of(
    records: Mapping[Cell, Record], measured: Measured, algorithms: Sequence[str]
) -> dict[str, dict[str, Float]]:
    """Return ``(n, c)`` hypervolumes and spreads of n runs by c points, by quantity, algorithm."""
    found: dict[str, dict[str, Float]] = {"hypervolume": {}, "spread": {}}
    for name in algorithms:
        cells = [cell for cell in measured.curves if cell.algorithm == name]
        if cells:
            volumes = [measured.curves[cell] for cell in cells]
            spreads = [spread_curve(records[cell], measured) for cell in cells]
            found["hypervolume"][name] = np.array(volumes)
            found["spread"][name] = np.array(spreads)
    return found


_LABELS = {
    "hypervolume": "hypervolume, share of the box [1]",
    "spread": "spread Δ, smaller is more even [1]",
}


def hypervolume_and_spread(
    curves: Mapping[str, Mapping[str, Float]], points: Sequence[int], theme: Theme
) -> "Figure":
    """Draw medians over the runs, and the bands between the quartiles.

    Args:
        curves: as ``curves_of`` returns them.
        points: c numbers of evaluations.
        theme: what to draw in.
    """
    from matplotlib.lines import Line2D

    figure, axes = panels(2, 2.75, theme)
    styles = looks(theme)
    for axis, (quantity, found) in zip(axes, curves.items(), strict=True):
        for name, values in found.items():
            spans = [quartiles(column) for column in values.T]
            low, median, high = (
                np.array([getattr(s, part) for s in spans]) for part in ("low", "median", "high")
            )
            look = styles[name]
            axis.fill_between(points, low, high, color=look.colour, alpha=0.15, linewidth=0)
            axis.plot(points, median, color=look.colour, linestyle=look.line, linewidth=1.6)
        axis.set_xlim(0, points[-1])
        axis.set_xlabel("evaluations")
        axis.set_ylabel(_LABELS[quantity])
    legend(
        figure,
        [
            Line2D(
                [],
                [],
                color=styles[n].colour,
                linestyle=styles[n].line,
                linewidth=1.6,
                label=title_of(n),
            )
            for n in curves["hypervolume"]
        ],
        theme,
    )
    return figure
