"""What all figures share: sizes, themes, files, and each method's colour, line and mark."""

import io
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bridgegen_reproduction.paper import METHODS, TITLES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDE = 7.16
"""[inches]: two columns of an IEEE paper."""

SIZE = 8.0
"""[points]: of numbers on axes."""

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


@dataclass(frozen=True)
class Look:
    """How a method is drawn, told apart without colour, too.

    Attributes:
        colour: of lines and areas.
        line: its style.
        mark: of points.
    """

    colour: str
    line: Any
    mark: str


def looks(theme: Theme) -> dict[str, Look]:
    """Return each method's look; the baseline is in ink."""
    colours = (theme.ink, *theme.colours[:3])
    lines: tuple[Any, ...] = ((0, (4, 1.5)), "-", (0, (1, 1)), (0, (6, 1.5, 1, 1.5)))
    return {
        method.algorithm: Look(colour, line, mark)
        for method, colour, line, mark in zip(METHODS, colours, lines, "os^D", strict=True)
    }


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


def panels(count: int, height: float, theme: Theme) -> "tuple[Figure, list[Axes]]":
    """Return a figure of so many axes beside each other."""
    figure = blank(WIDE, height, theme)
    axes = [figure.add_subplot(1, count, k + 1) for k in range(count)]
    for axis in axes:
        dress(axis, theme, size=SIZE)
        axis.grid(color=theme.grid, linewidth=0.7)
    return figure, axes


def legend(figure: "Figure", handles: list[Any], theme: Theme) -> None:
    """Put a legend below all axes."""
    drawn = figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=6,
        frameon=False,
        fontsize=SIZE,
        handlelength=2.8,
        columnspacing=1.6,
    )
    for text in drawn.get_texts():
        text.set_color(theme.ink)


def title_of(algorithm: str) -> str:
    """Return a method's name in the paper."""
    return TITLES[algorithm]
