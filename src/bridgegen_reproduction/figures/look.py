"""What all figures share: sizes, and each method's colour, line and mark."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bridgegen.jobs.compare.figures import Theme, blank, dress
from bridgegen_reproduction.paper import METHODS, TITLES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDE = 7.16
"""[inches]: two columns of an IEEE paper."""

SIZE = 8.0
"""[points]: of numbers on axes."""


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
