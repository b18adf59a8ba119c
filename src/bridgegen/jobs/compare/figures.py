"""The figures of a comparison, drawn by matplotlib in colours for the colour-blind."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.statistics import quartiles

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# --- Style of the figures: two themes, axes that match them, and output as files ---


WIDTH = 5.4
"""Width of a figure [inches]: text of nine points can be read where a phone shows it at 350
pixels."""

DPI = 180


@dataclass(frozen=True)
class Theme:
    """The colours of a figure.

    Attributes:
        paper: of the background.
        ink: of text, and the baseline.
        muted: of axes.
        grid: of the grid.
        colours: of the other algorithms.
    """

    paper: str
    ink: str
    muted: str
    grid: str
    colours: tuple[str, ...]


LIGHT = Theme(
    "#ffffff",
    "#17202c",
    "#566273",
    "#e4e9f0",
    ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"),
)
"""Theme on white paper: Okabe and Ito's colours (2008), without black, and yellow, which is
invisible there."""

DARK = Theme(
    "#171e27",
    "#e7ecf3",
    "#9ba8b8",
    "#2c3643",
    ("#3d9fe0", "#ff7f3f", "#1fc796", "#e39ac6", "#f2b73a", "#a5d8f5"),
)
"""Theme on a dark page: the hues of `LIGHT`, lighter."""


def canvas(height: float, theme: Theme) -> "tuple[Figure, Axes]":
    """Return a figure of `WIDTH` by ``height`` inches with one pair of axes."""
    figure = blank(WIDTH, height, theme)
    axes = figure.add_subplot()
    dress(axes, theme)
    return figure, axes


def blank(width: float, height: float, theme: Theme) -> "Figure":
    """Return an empty figure [inches]."""
    from matplotlib.figure import Figure

    # Not pyplot's: this leaves the caller's settings and figures alone.
    return Figure((width, height), dpi=DPI, facecolor=theme.paper, layout="constrained")


def dress(axes: "Axes", theme: Theme, *, size: float = 9.0) -> None:
    """Give axes a theme's colours; only their left and lower sides are drawn.

    Args:
        axes: to style.
        theme: its colours.
        size: of the numbers [points].
    """
    axes.set_facecolor(theme.paper)
    axes.tick_params(colors=theme.muted, labelsize=size)
    axes.xaxis.label.set(color=theme.ink, fontsize=size + 0.5)
    axes.yaxis.label.set(color=theme.ink, fontsize=size + 0.5)
    for name, spine in axes.spines.items():
        spine.set_color(theme.muted)
        spine.set_visible(name in ("left", "bottom"))
    axes.set_axisbelow(True)


def png(figure: "Figure") -> bytes:
    """Return a figure as a PNG, the same bytes every time."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


def pdf(figure: "Figure") -> bytes:
    """Return a figure as a PDF for papers, its text as text, the same bytes every time."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_pdf import FigureCanvasPdf

    FigureCanvasPdf(figure)
    buffer = io.BytesIO()
    unsigned = {"Creator": None, "Producer": None, "CreationDate": None}
    with rc_context({"pdf.fonttype": 42}):  # TrueType: publishers require it
        figure.savefig(buffer, format="pdf", metadata=unsigned)
    return buffer.getvalue()


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
            [values],
            positions=[row],
            orientation="horizontal",
            widths=0.6,
            whis=(0, 100),
            showcaps=False,
            manage_ticks=False,
            boxprops=line,
            whiskerprops=line,
            medianprops={"color": colour, "linewidth": 3.2, "solid_capstyle": "butt"},
        )
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
            [0.0, *(getattr(span, part) for span in spans)] for part in ("low", "median", "high")
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
