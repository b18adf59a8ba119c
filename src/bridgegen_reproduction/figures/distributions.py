"""How d_min, v_d and fitness are distributed: over the iterations, and over a whole search."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.statistics import Quartiles, quartiles
from bridgegen_reproduction.figures.look import SIZE, Theme, legend, looks, panels, title_of
from bridgegen_reproduction.paper import POPULATION
from bridgegen_reproduction.runs import Run

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LABELS = {
    "d_min": "d_min, smallest distance [m]",
    "v_d": "v_d, the ego’s speed then [km/h]",
    "fitness": "fitness, larger is more critical",
}
"""What an axis says of a quantity; an attribute of `Run` each."""

MOST = 20_000
"""Values that a violin's shape is estimated from, evenly taken from all."""


def by_iteration(runs: Sequence[Run], quantity: str) -> list[Quartiles]:
    """Return the quartiles of each 40 evaluations, over all runs; NaN where all of them failed."""
    batches: list[list[Float]] = []
    for run in runs:
        values: Float = getattr(run, quantity)
        for k in range(0, len(values), POPULATION):
            if k // POPULATION == len(batches):
                batches.append([])
            batches[k // POPULATION].append(values[k : k + POPULATION])
    return [quartiles(np.concatenate(batch)) for batch in batches]


def iterations(
    runs: Mapping[str, Sequence[Run]], quantities: Sequence[str], theme: Theme
) -> "Figure":
    """Draw the median of each iteration, and the band between its quartiles, of all seeds."""
    from matplotlib.lines import Line2D

    figure, axes = panels(len(quantities), 2.75, theme)
    styles = looks(theme)
    for axis, quantity in zip(axes, quantities, strict=True):
        for name, these in runs.items():
            spans = by_iteration(these, quantity)
            if not spans:
                continue
            x = np.arange(1, len(spans) + 1)
            low, median, high = (
                np.array([getattr(s, part) for s in spans]) for part in ("low", "median", "high")
            )
            look = styles[name]
            axis.fill_between(x, low, high, color=look.colour, alpha=0.15, linewidth=0)
            axis.plot(
                x,
                median,
                color=look.colour,
                linestyle=look.line,
                linewidth=1.6,
                marker=look.mark,
                markersize=3.2,
                markevery=max(1, len(x) // 6),
            )
            axis.set_xlim(1, max(len(spans), 2))
        axis.set_xlabel(f"iteration, {POPULATION} evaluations each")
        axis.set_ylabel(LABELS[quantity])
        if quantity != "fitness":
            axis.set_ylim(bottom=0)
    legend(
        figure,
        [
            Line2D(
                [],
                [],
                color=styles[n].colour,
                linestyle=styles[n].line,
                linewidth=1.6,
                marker=styles[n].mark,
                markersize=3.2,
                label=title_of(n),
            )
            for n in runs
        ],
        theme,
    )
    return figure


@dataclass(frozen=True)
class Violin:
    """One violin.

    Attributes:
        name: below it.
        values: ``(n,)`` float64.
        printed: the paper's mean and median; NaN where it prints none.
    """

    name: str
    values: Float
    printed: tuple[float, float]


def violins(columns: Mapping[str, Mapping[str, Violin]], theme: Theme) -> "Figure":
    """Draw all evaluations of all seeds, with quartiles, and the paper's mean and median.

    Args:
        columns: by quantity, then by algorithm.
        theme: what to draw in.
    """
    from matplotlib.lines import Line2D

    figure, axes = panels(len(columns), 3.0, theme)
    styles = looks(theme)
    for axis, (quantity, violins_) in zip(axes, columns.items(), strict=True):
        axis.grid(visible=False, axis="x")
        for place, (name, violin) in enumerate(violins_.items()):
            _violin(axis, place, violin, styles[name].colour, theme)
        axis.set_xticks(range(len(violins_)), [v.name for v in violins_.values()], color=theme.ink)
        axis.set_xlim(-0.6, len(violins_) - 0.4)
        axis.set_ylabel(LABELS[quantity])
    mark: dict[str, Any] = {"linestyle": "none", "color": theme.ink, "markersize": 5.5}
    legend(
        figure,
        [
            Line2D([], [], linewidth=4, color=theme.muted, label="ours: quartiles"),
            Line2D([], [], marker="o", markerfacecolor=theme.paper, label="ours: median", **mark),
            Line2D([], [], marker="_", label="paper: median", markeredgewidth=2, **mark),
            Line2D([], [], marker="x", label="paper: mean", markeredgewidth=1.4, **mark),
        ],
        theme,
    )
    return figure


def _violin(axes: "Axes", place: int, violin: Violin, colour: str, theme: Theme) -> None:
    values = violin.values[~np.isnan(violin.values)]
    beside = place + 0.42
    for value, mark, width in zip(violin.printed, "x_", (1.4, 2.0), strict=True):
        if not np.isnan(value):
            axes.plot(beside, value, mark, color=theme.ink, markersize=5.5, markeredgewidth=width)
    if not len(values):
        return
    if np.ptp(values) > 1e-9:  # else nothing has a shape
        step = max(1, -(-len(values) // MOST))
        drawn: Any = axes.violinplot(
            values[::step],
            [place],
            widths=0.72,
            showextrema=False,
            points=200,
            bw_method=0.12,
        )
        for body in drawn["bodies"]:
            body.set(facecolor=colour, edgecolor=colour, alpha=0.35, linewidth=0.9)
    item = quartiles(values)
    axes.plot(
        [place, place], [item.low, item.high], color=colour, linewidth=4, solid_capstyle="butt"
    )
    axes.plot(
        place, item.median, "o", color=theme.paper, markeredgecolor=theme.ink, markersize=SIZE - 2.5
    )
