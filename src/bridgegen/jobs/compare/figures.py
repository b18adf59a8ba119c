"""The figures of a comparison, drawn by matplotlib in colours for the colour-blind."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.statistics import quartiles
from bridgegen.jobs.compare.drawing import Theme, canvas, png

STYLES: tuple[Any, ...] = ("-", (0, (5, 2)), (0, (1.5, 1.5)))
"""Line styles; each is used with all colours before the next."""


def boxes(samples: Mapping[str, Float], baseline: str, label: str, theme: Theme) -> bytes:
    """Draw a box and every run's value for each algorithm; return a PNG.

    Args:
        samples: ``(n,)`` float64, finite, by algorithm, the first on top; none where n = 0.
        baseline: drawn in ink.
        label: of the axis.
        theme: what to draw in.
    """
    names = list(samples)
    figure, axes = canvas(0.9 + 0.34 * len(names), theme)
    for row, (name, colour, _) in enumerate(_looks(names, baseline, theme)):
        values = samples[name]
        if not len(values):
            continue
        line = {"color": colour, "linewidth": 1.4}
        axes.boxplot(
            [values], positions=[row], orientation="horizontal", widths=0.6, whis=(0, 100),
            showcaps=False, manage_ticks=False, boxprops=line, whiskerprops=line,
            medianprops={"color": colour, "linewidth": 3.2, "solid_capstyle": "butt"},
        )  # fmt: skip
        # Beside one another in the order of the seeds, so that equal values do not hide each other.
        aside = np.linspace(-0.2, 0.2, len(values)) if len(values) > 1 else np.zeros(1)
        axes.plot(values, row + aside, ".", color=colour, markersize=4.5, alpha=0.65)
    axes.set_yticks(range(len(names)), names, color=theme.ink)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.set_xlabel(label)
    axes.grid(axis="x", color=theme.grid, linewidth=0.8)
    return png(figure)


def curves(
    samples: Mapping[str, Float],
    points: Sequence[int],
    baseline: str,
    label: str,
    theme: Theme,
    *,
    from_zero: bool = True,
) -> bytes:
    """Draw the median over runs, and the band between the quartiles, by evaluations; a PNG.

    Args:
        samples: ``(n, c)`` float64 by algorithm: n runs, c points; none where n = 0.
        points: c numbers of evaluations.
        baseline: drawn in ink.
        label: of the vertical axis.
        theme: what to draw in.
        from_zero: whether the vertical axis begins at 0; else where the curves are after a tenth of
            the evaluations, so that similar ends are distinguishable.
    """
    names = [name for name in samples if len(samples[name])]
    figure, axes = canvas(3.1 + 0.2 * -(-len(names) // 4), theme)
    for name, colour, style in _looks(list(samples), baseline, theme):
        if name not in names:
            continue
        spans = [quartiles(column) for column in samples[name].T]
        x = [0, *points]
        low, median, high = (
            [0.0, *(getattr(one, part) for one in spans)] for part in ("low", "median", "high")
        )
        axes.fill_between(x, low, high, color=colour, alpha=0.16, linewidth=0)
        axes.plot(x, median, color=colour, linestyle=style, linewidth=2, label=name)
    axes.set_xlim(0, points[-1])
    early = [float(quartiles(samples[name][:, len(points) // 10]).low) for name in names]
    axes.set_ylim(bottom=0 if from_zero or not early else np.floor(20 * min(early)) / 20)
    axes.set_xlabel("evaluations")
    axes.set_ylabel(label)
    axes.grid(color=theme.grid, linewidth=0.8)
    if names:
        legend = figure.legend(
            loc="outside lower center", ncols=4, frameon=False, fontsize=9, handlelength=2.6
        )
        for text in legend.get_texts():
            text.set_color(theme.ink)
    return png(figure)


def _looks(names: Sequence[str], baseline: str, theme: Theme) -> list[tuple[str, str, Any]]:
    """Return each algorithm with its colour and line style."""
    others = [name for name in names if name != baseline]
    looks = {baseline: (theme.ink, STYLES[0])}
    for k, name in enumerate(others):
        hue, style = k % len(theme.colours), k // len(theme.colours) % len(STYLES)
        looks[name] = (theme.colours[hue], STYLES[style])
    return [(name, *looks[name]) for name in names]
