"""Style of the figures: two themes, axes that match them, and output as files."""

import io
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH = 5.4
"""[inches]: text of nine points can be read where a phone shows the figure at 350 pixels."""

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
    "#ffffff", "#17202c", "#566273", "#e4e9f0",
    ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"),
)  # fmt: skip
"""Okabe and Ito's colours (2008), without black and yellow, which is invisible on white paper."""

DARK = Theme(
    "#171e27", "#e7ecf3", "#9ba8b8", "#2c3643",
    ("#3d9fe0", "#ff7f3f", "#1fc796", "#e39ac6", "#f2b73a", "#a5d8f5"),
)  # fmt: skip
"""The same hues, lighter."""


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
